//! Must not link: proof that a panic in an image is detected. Empty on any other target.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../src/board/panic.rs"]
mod panic;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    let bytes = [1, 2, 3];
    // An index that the compiler cannot know.
    let index = cortex_m::peripheral::SYST::get_current() as usize;
    let _ = core::hint::black_box(bytes[index]);
    loop {
        cortex_m::asm::wfi();
    }
}

#[cfg(not(target_os = "none"))]
fn main() {}
