//! Links, and must be refused by `tests/board/symbols`: proof that heap and double precision in an image are detected.
//! Empty on any other target.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../src/board/panic.rs"]
mod panic;

#[cfg(target_os = "none")]
mod image {
    extern crate alloc;

    use core::alloc::{GlobalAlloc, Layout};
    use core::hint::black_box;

    /// An allocator that never has any memory.
    struct Empty;

    // SAFETY: a null pointer means that there is no memory; so nothing is ever freed.
    unsafe impl GlobalAlloc for Empty {
        #[inline(never)]
        unsafe fn alloc(&self, _: Layout) -> *mut u8 {
            black_box(core::ptr::null_mut())
        }

        unsafe fn dealloc(&self, _: *mut u8, _: Layout) {}
    }

    #[global_allocator]
    static HEAP: Empty = Empty;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        // SAFETY: the layout is not empty.
        black_box(unsafe { alloc::alloc::alloc(Layout::new::<u32>()) });
        black_box(black_box(1.5_f64) * black_box(2.5));
        loop {
            cortex_m::asm::wfi();
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() {}
