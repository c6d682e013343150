#!/usr/bin/env bash
# The image for STM32G474 silicon: builds, fits, and the control code in it has no panic, no heap, no double precision.
set -euo pipefail
cd "$(dirname "$0")/../.."

image=$(tests/board/cargo build --release --quiet --locked --package stm32g474 --message-format=json |
    grep -o '"executable":"[^"]*"' | cut -d'"' -f4)
arm-none-eabi-size "$image"
tests/board/symbols "$image" --driver-panics
echo "- the vector table leads to the handlers of the board"
# Not through a pipe: grep stops reading at the first match, and nm would die of that.
names=$(arm-none-eabi-nm "$image")
for handler in SysTick FDCAN1_IT0 HardFault; do
    grep -qi " t $handler$" <<<"$names"
done
cat <<'END'
- not tried, for want of a board: clocks, bit timing on a wire, filters, bus-off recovery, pins, watchdog, cycle counter, log
END
