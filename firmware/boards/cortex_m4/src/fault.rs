//! Where the core goes when something has failed: torque off, reason kept, reset.

use core::arch::naked_asm;
use core::mem::MaybeUninit;
use core::ptr;

use cortex_m::interrupt;
use cortex_m::peripheral::{FPU, SCB};
use firmware::cabinet::reset::{Record, Stop};
use protocol::messages::ResetReason;

/// The frame could not be written (CFSR: STKERR, MSTKERR).
const NO_FRAME: u32 = 1 << 12 | 1 << 4;
/// The program counter among the words that the core stacks.
const PROGRAM_COUNTER: usize = 6;
/// Words of an exception frame without the FPU's.
const FRAME: usize = 8;
/// Bytes of stack that are enough for the rest of this file.
const ROOM: usize = 256;
/// Registers of the FPU are still to be stacked (FPCCR: LSPACT).
const LAZY_STACKING: u32 = 1;

unsafe extern "Rust" {
    /// The board's: takes torque away and lets the brake close, by registers alone, since what has failed may be what a
    /// driver needs. Returns the outputs as found and as read back.
    safe fn board_torque_off() -> [u8; 2];
}

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// In RAM that the start-up code does not touch. Used by more than the compiler sees: by the program before.
#[used]
#[unsafe(link_section = ".uninit.kept")]
static KEPT: MaybeUninit<Record> = MaybeUninit::uninit();

fn kept() -> &'static Record {
    // SAFETY: a record is four words, of which every value is valid.
    unsafe { KEPT.assume_init_ref() }
}

/// A fault for which no handler of its own is enabled, or that came where no other could be taken.
///
/// Where there is no room left on the stack, or no stack, the handler begins a new one at the top: what is there is of no
/// use any more.
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

/// The stack has left its place, or an address was not to be touched.
#[unsafe(naked)]
#[unsafe(export_name = "MemoryManagement")]
unsafe extern "C" fn memory_fault() -> ! {
    naked_asm!("b {}", sym hard_fault)
}

extern "C" fn fault(frame: *const u32) -> ! {
    // SAFETY: registers of the core, and nothing else runs any more. Without the flag the first instruction of the FPU
    // would write to the old stack.
    let status = unsafe {
        (*FPU::PTR).fpccr.modify(|bits| bits & !LAZY_STACKING);
        (*SCB::PTR).cfsr.read()
    };
    let stack = &raw const _stack_end..&raw const _stack_start;
    let last = frame.wrapping_add(FRAME - 1);
    let is_there = status & NO_FRAME == 0 && stack.contains(&frame) && stack.contains(&last);
    let at = if is_there {
        // SAFETY: the core has written the frame, and it lies within the stack.
        unsafe { ptr::read_volatile(frame.wrapping_add(PROGRAM_COUNTER)) }
    } else {
        0
    };
    stop(ResetReason::HardFault, at, status)
}

/// Takes torque away and resets the board, which then starts for this reason.
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

/// How the program ended before this start, if it ended here. Tells it once.
pub fn last_stop() -> Option<Stop> {
    kept().take()
}
