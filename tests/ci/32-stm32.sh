#!/usr/bin/env bash
# The image for STM32G474 silicon: builds, fits, and the control code in it has no panic, no heap, no double precision.
source "$(dirname "$0")/lib.bash"
source tests/ci/board.bash

image=$(built stm32g474)
arm-none-eabi-size "$image"
tests/board/symbols "$image" --no-panic-in '(firmware|protocol)/src/'
echo "- an inlined panic is found: the one planted in another image"
faults=$(built mps2-an386 --bin mps2-an386-faults)
refused 'boards/mps2_an386/src/faults.rs' tests/board/symbols "$faults" --no-panic-in 'firmware/boards/mps2_an386/src/'
echo "- the vector table leads to the handlers of the board"
# Not through a pipe: grep stops reading at the first match, and nm would die of that.
names=$(arm-none-eabi-nm "$image")
for handler in SysTick FDCAN1_IT0 HardFault MemoryManagement; do
    grep -qi " t $handler$" <<<"$names" || fail "no $handler in the image"
done
cat <<'END'
- not tried, for want of a board: clocks, bit timing on a wire, filters, bus-off recovery, pins, watchdog, cycle counter, log
END
