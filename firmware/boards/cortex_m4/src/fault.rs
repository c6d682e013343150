//! Fault handling of the core: torque off, reason kept, reset.

use core::arch::naked_asm;
use core::mem::MaybeUninit;
use core::ptr;

use cortex_m::interrupt;
use cortex_m::peripheral::{FPU, SCB};
use firmware::cabinet::reset::{Record, Stop};
use protocol::messages::ResetReason;

/// The exception frame could not be written (CFSR: STKERR, MSTKERR).
const NO_FRAME: u32 = 1 << 12 | 1 << 4;
/// Index of the program counter among the words that the core stacks.
const PROGRAM_COUNTER: usize = 6;
/// Words of an exception frame without FPU registers.
const FRAME: usize = 8;
/// Bytes of stack sufficient for the rest of this file.
const ROOM: usize = 256;
/// FPU registers have yet to be stacked (FPCCR: LSPACT).
const LAZY_STACKING: u32 = 1;

unsafe extern "Rust" {
    /// Provided by the board: switches torque off and lets the brake close, by registers alone, since drivers may
    /// depend on what has failed. Returns the outputs as found and as read back.
    safe fn board_torque_off() -> [u8; 2];
}

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// In RAM that the start-up code does not touch. The compiler cannot see one of its users: the program before the
/// reset.
#[used]
#[unsafe(link_section = ".uninit.kept")]
static KEPT: MaybeUninit<Record> = MaybeUninit::uninit();

fn kept() -> &'static Record {
    // SAFETY: a record is four words, and every value of them is valid.
    unsafe { KEPT.assume_init_ref() }
}

/// A fault without an enabled handler of its own, or where no other could be taken.
///
/// If the stack is exhausted or invalid, the handler starts a new one at the top: its contents are no longer needed.
#[unsafe(naked)]
#[unsafe(export_name = "HardFault")]
unsafe extern "C" fn hard_fault() -> ! {
    naked_asm!(
        "mov r0, sp",
        "movw r1, #:lower16:_stack_end",
        "movt r1, #:upper16:_stack_end",
        "add r1, r1, #{room}",
        "cmp r0, r1",
        "bhs 0f",
        "movw r1, #:lower16:_stack_start",
        "movt r1, #:upper16:_stack_start",
        "mov sp, r1",
        "0: b {fault}",
        room = const ROOM,
        fault = sym fault,
    )
}

/// The stack has overflowed, or a forbidden address was accessed.
#[unsafe(naked)]
#[unsafe(export_name = "MemoryManagement")]
unsafe extern "C" fn memory_fault() -> ! {
    naked_asm!("b {}", sym hard_fault)
}

extern "C" fn fault(frame: *const u32) -> ! {
    // SAFETY: registers of the core, and nothing else runs any more. With the flag set, the first FPU instruction would
    // write to the old stack.
    let status = unsafe {
        (*FPU::PTR).fpccr.modify(|bits| bits & !LAZY_STACKING);
        (*SCB::PTR).cfsr.read()
    };
    let stack = &raw const _stack_end..&raw const _stack_start;
    let last = frame.wrapping_add(FRAME - 1);
    let is_there = status & NO_FRAME == 0 && stack.contains(&frame) && stack.contains(&last);
    let at = if is_there {
        // SAFETY: the core has written the frame, and it is within the stack.
        unsafe { ptr::read_volatile(frame.wrapping_add(PROGRAM_COUNTER)) }
    } else {
        0
    };
    stop(ResetReason::HardFault, at, status)
}

/// Switches torque off and resets the board, which then starts with this reason.
pub fn restart(reason: ResetReason) -> ! {
    stop(reason, 0, 0)
}

fn stop(reason: ResetReason, at: u32, status: u32) -> ! {
    interrupt::disable();
    let pins = board_torque_off();
    kept().keep(&Stop {
        reason,
        pins,
        at,
        status,
    });
    SCB::sys_reset()
}

/// How the program ended before this start, if it ended here. Returned once.
pub fn last_stop() -> Option<Stop> {
    kept().take()
}
