//! What the operating system offers a thread with deadlines.

use std::io;
use std::time::Duration;

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};
use thread_priority::unix::{
    RealtimeThreadSchedulePolicy, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};
use thread_priority::{ThreadPriority, ThreadPriorityValue};

/// Real-time priority, below the interrupt threads (50): above them a busy loop could starve the drivers it waits for.
const PRIORITY: u8 = 49;

/// Requests `SCHED_FIFO` and locked memory for the calling thread. Whatever is not permitted is skipped: the loop then
/// runs like any other program, at times late.
///
/// Returns one sentence per refused request.
#[must_use]
pub fn claim() -> Vec<String> {
    let mut refused = Vec::new();
    let scheduled = ThreadPriorityValue::try_from(PRIORITY)
        .map_err(|_| thread_priority::Error::Priority("priority out of range"))
        .and_then(|priority| {
            set_thread_priority_and_policy(
                thread_native_id(),
                ThreadPriority::Crossplatform(priority),
                ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo),
            )
        });
    if let Err(error) = scheduled {
        let reason = match error {
            thread_priority::Error::OS(code) => format!("{}", io::Error::from_raw_os_error(code)),
            other => format!("{other}"),
        };
        refused.push(format!(
            "no SCHED_FIFO: {reason} (needs CAP_SYS_NICE or an rtprio limit)"
        ));
    }
    if let Err(error) = mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE) {
        refused.push(format!(
            "memory not locked: {} (needs CAP_IPC_LOCK or a memlock limit)",
            io::Error::from(error)
        ));
    }
    refused
}

/// Time since an arbitrary origin (`CLOCK_MONOTONIC`).
#[must_use]
pub fn monotonic() -> Duration {
    // The kernel keeps tv_nsec below 1e9 and the clock positive.
    Duration::try_from(clock_gettime(ClockId::Monotonic)).unwrap_or_default()
}

/// Sleeps until [`monotonic`] reaches `deadline`. An absolute deadline does not drift with the duration of the
/// preceding work; one that has passed returns at once.
pub fn sleep_until(deadline: Duration) {
    let Ok(deadline) = Timespec::try_from(deadline) else {
        return;
    };
    while let Err(rustix::io::Errno::INTR) = clock_nanosleep_absolute(ClockId::Monotonic, &deadline)
    {
    }
}
