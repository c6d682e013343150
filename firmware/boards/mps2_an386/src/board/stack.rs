//! Stack usage: the start-up code paints the stack, and calls overwrite the paint.

use core::ptr;

/// Value that `cortex-m-rt` paints with.
const PAINT: u32 = 0xCCCC_CCCC;

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// Most bytes of stack used since the start.
pub(crate) fn used() -> usize {
    let top = &raw const _stack_start;
    let mut lowest = &raw const _stack_end;
    // SAFETY: the linker script puts the stack between these symbols, aligned to words. They are only read,
    // and as volatile, since the live frames above change without the compiler's knowledge.
    while lowest < top && unsafe { ptr::read_volatile(lowest) } == PAINT {
        lowest = lowest.wrapping_add(1);
    }
    top as usize - lowest as usize
}
