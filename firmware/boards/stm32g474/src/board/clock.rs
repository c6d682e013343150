//! Clocks: 160 MHz for the core, 80 MHz for FDCAN, a 1 kHz interrupt, and the cycle counter.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::exception;
use embassy_stm32::rcc::{
    Hse, HseMode, Pll, PllMul, PllPreDiv, PllQDiv, PllRDiv, PllSource, Sysclk, mux,
};
use embassy_stm32::time::Hertz;
use protocol::time::{Instant, Period};

/// Period of the timer and of the drives' samples.
pub(crate) const TICK: Period = Period::of_rate(1000.0);
/// Cycles of the core in a period.
pub(crate) const CYCLES_PER_TICK: u32 = 160_000;

/// Periods since the start.
pub(crate) static TICKS: AtomicU32 = AtomicU32::new(0);

/// 24 MHz crystal / 6 * 80 = 320 MHz; / 2 for the core, / 4 for FDCAN. CiA 601-3 recommends 80 MHz;
/// the core's 160 MHz is a multiple of it and below its limit of 170 MHz.
pub(crate) fn config() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    config.rcc.hse = Some(Hse {
        freq: Hertz(24_000_000),
        mode: HseMode::Oscillator,
    });
    config.rcc.pll = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV6,
        mul: PllMul::MUL80,
        divp: None,
        divq: Some(PllQDiv::DIV4),
        divr: Some(PllRDiv::DIV2),
    });
    config.rcc.sys = Sysclk::PLL1_R;
    // Above 150 MHz the core needs the higher voltage (RM0440, 6.1.5).
    config.rcc.boost = true;
    config.rcc.mux.fdcansel = mux::Fdcansel::PLL1_Q;
    config
}

/// The node's time. A resolution of one sample is enough: the node's time-outs are many samples long.
pub(crate) struct Clock {
    seen: u32,
    now: Instant,
}

impl Clock {
    /// Starts timer and cycle counter. Call it once.
    pub(crate) fn start() -> Self {
        if let Some(mut core) = cortex_m::Peripherals::take() {
            core.DCB.enable_trace();
            core.DWT.enable_cycle_counter();
            core.SYST.set_clock_source(SystClkSource::Core);
            core.SYST.set_reload(CYCLES_PER_TICK - 1);
            core.SYST.clear_current();
            core.SYST.enable_interrupt();
            core.SYST.enable_counter();
        }
        Self {
            seen: 0,
            now: Instant::ORIGIN,
        }
    }

    /// Whether the timer has fired since the last [`Self::advance`].
    pub(crate) fn is_due(&self) -> bool {
        TICKS.load(Ordering::Relaxed) != self.seen
    }

    /// Updates the time; `true` if it has advanced.
    pub(crate) fn advance(&mut self) -> bool {
        let ticks = TICKS.load(Ordering::Relaxed);
        let passed = ticks.wrapping_sub(self.seen);
        self.seen = ticks;
        self.now += TICK.duration() * passed;
        passed != 0
    }

    /// Time of the last update.
    pub(crate) fn now(&self) -> Instant {
        self.now
    }
}

/// The timer: the only writer of the count.
#[exception]
fn SysTick() {
    TICKS.store(
        TICKS.load(Ordering::Relaxed).wrapping_add(1),
        Ordering::Relaxed,
    );
}
