//! How much stack has been used: the start-up code paints it, whatever was called has overwritten the paint.

use core::ptr;

/// What `cortex-m-rt` paints with.
const PAINT: u32 = 0xCCCC_CCCC;

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// Most bytes of stack used since the start.
pub(crate) fn used() -> usize {
    let top = &raw const _stack_start;
    let mut lowest = &raw const _stack_end;
    // SAFETY: the linker script puts the stack between these symbols, aligned to words. Words of it are read only, and
    // as volatile, since live frames above change behind the compiler's back.
    while lowest < top && unsafe { ptr::read_volatile(lowest) } == PAINT {
        lowest = lowest.wrapping_add(1);
    }
    top as usize - lowest as usize
}
