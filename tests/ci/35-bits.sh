#!/usr/bin/env bash
# The same bits everywhere: trace and truth of every scenario under every law are those of tests/bits.csv on this machine,
# without its fused multiply-add, in WebAssembly, and with the controller on the emulated Cortex-M4F.
#   tests/ci/35-bits.sh           compares
#   tests/ci/35-bits.sh update    rewrites the table from runs on this machine, after an intended change of behaviour
source "$(dirname "$0")/lib.bash"
table=tests/bits.csv

hash() { # hash FILE
    local sum
    sum=$(sha256sum "$1")
    echo "${sum%% *}"
}

no_difference() { # no_difference FILE WHAT: what a run has said; one that ends where the board differs has a trace, too
    if grep -q 'differs from this process' "$1"; then
        fail "$2: $(grep -m 1 'differs from this process' "$1")"
    fi
}

runs() { # runs TABLE ARGS...: the table from `plant-sim run ARGS`
    local scenario law rate cycles status
    while IFS=, read -r scenario law rate cycles _; do
        if [ "$scenario" = scenario ]; then
            echo "$scenario,$law,$rate,$cycles,trace_sha256,truth_sha256"
            continue
        fi
        # Whether a run completes does not matter here.
        status=0
        timeout 120 "$plant_sim" run --scenario "$scenario" --law "$law" --rate "$rate" --cycles "$cycles" \
            --out "$work/run" "${@:2}" >/dev/null 2>"$work/run.err" </dev/null || status=$?
        [ "$status" -le 1 ] || fail "$scenario, $law, $rate Hz: status $status"
        no_difference "$work/run.err" "$scenario, $law, $rate Hz"
        echo "$scenario,$law,$rate,$cycles,$(hash "$work/run/trace.log"),$(hash "$work/run/truth.csv")"
        rm "$work/run"/*
    done <"$1"
}

compare() { # compare WHERE TABLE: its rows are in the recorded table
    awk -F, -v where="$1" '
        { key = $1 FS $2 FS $3 FS $4 }
        NR == FNR { trace[key] = $5; truth[key] = $6; next }
        FNR > 1 { rows++ }
        trace[key] != $5 || truth[key] != $6 {
            unequal = 1
            printf "  %s differs %s: %s under %s at %s Hz\n", trace[key] == $5 ? "truth" : truth[key] == $6 ? "trace" : \
                "trace and truth", where, $1, $2, $3
        }
        END {
            if (unequal || !rows) exit 1
            printf "  %d rows equal\n", rows
        }' "$table" "$2" || fail "differs from $table. If the change is intended: tests/ci/35-bits.sh update"
}

build_host
if [ "${1:-}" = update ]; then
    runs "$table" >"$work/table"
    cp "$work/table" "$table"
    git diff --stat -- "$table"
    exit
fi

echo "- on this machine"
runs "$table" >"$work/here"
compare "on this machine" "$work/here"

echo "- on this machine without fused multiply-add"
without=glibc.cpu.hwcaps=-FMA,-AVX2
# awk takes its sine from the C library, like the standard library: evidence that another implementation is in use.
sines() { awk 'BEGIN { for (i = 0; i < 100000; i++) printf "%.17g\n", sin(i / 1000) }' | sha256sum; }
if [ "$(sines)" = "$(GLIBC_TUNABLES=$without sines)" ]; then
    echo "  not compared: the C library has the same functions without it here"
else
    GLIBC_TUNABLES=$without runs "$table" >"$work/without"
    compare "without fused multiply-add" "$work/without"
fi

echo "- in WebAssembly"
need node nodejs
need_cross wasm32-unknown-unknown
tests/cross wasm32-unknown-unknown build --release --quiet --locked --package web
node tests/web/run.mjs "$target/cross/wasm32-unknown-unknown/release/web.wasm" "$table" >"$work/wasm" 2>"$work/wasm.err"
compare "in WebAssembly" "$work/wasm"
sed 's/^/  /' "$work/wasm.err"

echo "- with the controller on the emulated Cortex-M4F"
source tests/ci/board.bash
image=$(built mps2-an386 --bin mps2-an386)
on_board=(--controller qemu --image "$image")
grep -E '^(scenario|(gate|bus-off|link-loss|encoder-fault|estop-descent),(pid|computed-torque:observer)|square,computed-torque-task:observer|(arc|blend),computed-torque:observer|pick-place,computed-torque:observer),' \
    "$table" >"$work/some"
runs "$work/some" "${on_board[@]}" >"$work/board"
compare "on the emulated board" "$work/board"

echo "- the same with what raises each fault of the table"
broken() { # broken DIR OPTION...: a run, of the gate if no other is named; prints the first cause that the controller reports, or none
    local status=0
    timeout 120 "$plant_sim" run --cycles 1 --no-report --out "$@" >/dev/null 2>"$work/broken.err" </dev/null || status=$?
    [ "$status" -le 1 ] || fail "${*:2}: status $status"
    no_difference "$work/broken.err" "${*:2}"
    grep -m 1 -o '"cause": "[^"]*"' "$1/summary.json" | cut -d'"' -f4 || echo none
}
while read -r -a row; do
    options=("${row[@]:1}")
    cause=$(broken "$work/here-broken" "${options[@]}")
    [ "$cause" = "${row[0]}" ] || fail "${options[*]}: $cause, not ${row[0]}"
    broken "$work/board-broken" "${options[@]}" "${on_board[@]}" >"$work/cause"
    for file in trace.log truth.csv; do
        cmp "$work/here-broken/$file" "$work/board-broken/$file" || fail "$file differs on the emulated board: ${options[*]}"
    done
    [ "$(<"$work/cause")" = "$cause" ] || fail "${options[*]}: $(<"$work/cause") on the emulated board"
    echo "$cause" >>"$work/raised"
done <<'END'
feedback-lost --fault feedback:loss@0.45s..0.46s
feedback-lost --fault controller:misread@0.45s..0.46s
babbling --fault operator:babbling@0.45s..+150ms
bus-off --fault command:bit-error@0.45s..+10ms
peer-silent --fault drives:silent@0.45s
peer-silent --fault drives:dead@0.45s
operator-silent --fault operator:silent@0.3s..0.7s
reordered --fault feedback:replay=8@0.45s
reordered --fault feedback:forged@0.45s
none --fault feedback:reorder@0.45s
late --fault command:delay=0.004@0.45s
corrupted --fault feedback:corrupt@0.45s
corrupted --fault feedback:masquerade@0.45s
bad-value --fault feedback:bad-value@0.45s
duplicate-node --fault command:forged@0.45s
following-error --fault motor:elbow:dead@0.45s
following-error --fault motor:elbow:runaway@0.45s
stuck-sensor --fault encoder:elbow:stuck@0.45s
drive-fault --fault brake:stuck@0s
drive-fault --fault brake:stuck-open@0s
drive-fault --fault brake:stuck-closed@0.4s
over-torque --payload 22 --fault motor:wrist:dead@0.6994s
over-speed --set operation="manual" --fault motor:elbow:runaway@0.45s
soft-limit --fault encoder:elbow:jump=2.8@0s
estop --scenario estop-descent
overrun --fault controller:slow=0.002@0.45s
none --fault controller:slow=0.0005@0.45s
drive-fault --fault motor:lift:dip@0.45s
drive-fault --fault brake:slow=0.2@0s
drive-fault --fault clock:misses@0.45s..0.46s
encoder-fault --fault encoder:elbow:jump=0.05@0.45s
encoder-fault --fault encoder:elbow:reversed@0.45s
collision --fault payload:caught=20000@0.45s
collision --fault encoder:elbow:slow=0.02@0.45s
chatter --fault encoder:shoulder:noise=0.0003@0.15s
overload --scenario gate-22kg --set cycle=[{dwell=40}] --fault payload:heavier=32@0.1s
none --fault controller:dead@0.45s..0.46s
END

# flipped NAME FROM TO: with a bit flipped in a table of constants, that of quarter turns or that of the CRC
flipped() {
    python3 - "$@" <<'END'
import struct, sys
name, source, target = sys.argv[1:]
def crc_8(byte): # polynomial 2Fh
    for _ in range(8):
        byte = byte << 1 ^ (0x12F if byte & 0x80 else 0)
    return byte
tables = {
    "sine": (struct.pack("<8f", -0.0, 1, 1, -0.0, -0.0, -1, -1, -0.0), 6),
    # The first byte of a digest that begins with FFh meets this entry.
    "crc": (bytes(map(crc_8, range(256))), 0xFF ^ ord("1")),
}
table, place = tables[name]
with open(source, "rb") as program:
    data = bytearray(program.read())
assert data.count(table) == 1, f"{data.count(table)} tables of the {name} in {source}"
data[data.index(table) + place] ^= 0x40
with open(target, "wb") as program:
    program.write(data)
END
    chmod +x "$3"
}
sound=$plant_sim
for answer in sine crc; do
    flipped "$answer" "$sound" "$work/flipped-sim"
    flipped "$answer" "$image" "$work/flipped-image"
    plant_sim=$work/flipped-sim
    cause=$(broken "$work/here-broken")
    [ "$cause" = self-test ] || fail "with a flipped bit of the $answer: $cause"
    grep -q "self test: .*$answer" "$work/here-broken/summary.json"
    broken "$work/board-broken" --controller qemu --image "$work/flipped-image" >"$work/cause"
    for file in trace.log truth.csv; do
        cmp "$work/here-broken/$file" "$work/board-broken/$file" || fail "$file differs on the emulated board: a flipped bit of the $answer"
    done
    [ "$(<"$work/cause")" = "$cause" ] || fail "a flipped bit of the $answer: $(<"$work/cause") on the emulated board"
    echo "$cause" >>"$work/raised"
    plant_sim=$sound
done
sed -n '/begin faults/,/end faults/ s/^| \([a-z-]\{4,\}\) |.*/\1/p' docs/safety.md | grep -vx fault | sort >"$work/table-of-faults"
sort -u "$work/raised" | grep -vx none | diff "$work/table-of-faults" - || fail "not the faults of docs/safety.md"
echo "  $(wc -l <"$work/raised") runs equal; all $(wc -l <"$work/table-of-faults") causes raised"
