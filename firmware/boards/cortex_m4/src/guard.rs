//! Stack guard, and priority of faults over everything else.

use cortex_m::asm;
use cortex_m::peripheral::{MPU, NVIC, SCB};

/// The 32 KiB below RAM, more than any one stack frame: every overflow hits them. No board uses these addresses, and
/// the guard costs no RAM.
const BELOW_RAM: u32 = 0x1FFF_8000;
/// Region attributes (Armv7-M, B3.5.9): never execute, no access, 2^(14 + 1) bytes, enabled.
const NO_ACCESS: u32 = 1 << 28 | 14 << 1 | 1;
/// Default memory map everywhere else; the unit is on.
const DEFAULT_MAP: u32 = 1 << 2 | 1;
/// Memory faults have their own handler.
const MEMORY_FAULTS: u32 = 1 << 16;

/// The lowest priority: the greatest number, however many bits the core has.
const LOWEST: u8 = 0xFF;
/// Indices of SysTick and PendSV among the priorities of the system handlers, which begin with exception 4.
const SYSTICK: usize = 15 - 4;
const PENDSV: usize = 14 - 4;
/// Interrupts of an Armv7-M core, with a priority byte each.
const INTERRUPTS: usize = 240;

/// Guards the stack. Call it first, before any interrupt is enabled.
pub fn guard() {
    // SAFETY: registers of the core that nothing else uses. No code relies on addresses in the guarded range, or on
    // one interrupt preempting another: they all get the same priority, below that of the faults.
    unsafe {
        let mpu = &*MPU::PTR;
        mpu.rnr.write(0);
        mpu.rbar.write(BELOW_RAM);
        mpu.rasr.write(NO_ACCESS);
        mpu.ctrl.write(DEFAULT_MAP);
        let scb = &*SCB::PTR;
        scb.shpr[SYSTICK].write(LOWEST);
        scb.shpr[PENDSV].write(LOWEST);
        for priority in (*NVIC::PTR).ipr.iter().take(INTERRUPTS) {
            priority.write(LOWEST);
        }
        scb.shcsr.modify(|enabled| enabled | MEMORY_FAULTS);
    }
    asm::dsb();
    asm::isb();
}
