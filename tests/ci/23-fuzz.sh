#!/usr/bin/env bash
# Whatever reads text or bytes from outside keeps its promises for inputs that libFuzzer makes of the corpus in tests/fuzz,
# guided by what they reach in the code. The seed is fixed: the same program sees the same inputs.
#
#   tests/ci/23-fuzz.sh                   every target, about a minute
#   tests/ci/23-fuzz.sh TARGET SECONDS    one target for longer, from another seed each time
#
# An input that breaks a promise is kept in target/fuzz/found. Mend what it shows, and move it into tests/fuzz/corpus/TARGET:
# `cargo test -p fuzz` runs it from then on.
source "$(dirname "$0")/lib.bash"
need c++ g++

# What cargo-fuzz passes without a sanitizer: rustc counts the edges, libFuzzer comes as C++ with its crate.
flags="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 -Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
-Cllvm-args=-sanitizer-coverage-pc-table -Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1 --cfg fuzzing"
host=$(rustc -vV | sed -n 's/^host: //p')
# With --target, build scripts and macros are compiled without the flags.
RUSTFLAGS=$flags cargo build --quiet --locked --package fuzz --features libfuzzer --profile fuzz --target "$host" --target-dir "$target/fuzz"
fuzz=$target/fuzz/$host/fuzz/fuzz
found=$target/fuzz/found
mkdir -p "$found"

corpora() { # corpora TARGET: folders with its seeds
    echo "tests/fuzz/corpus/$1"
    case $1 in
        scenario) echo plant-sim/scenarios ;;
        model) echo plant-sim/models ;;
    esac
}

search() { # search TARGET OPTION...
    local name=$1
    mkdir -p "$work/$name"
    # The first folder takes what is new.
    FUZZ_TARGET=$name RUST_BACKTRACE=0 "$fuzz" -timeout=10 -rss_limit_mb=1024 -max_len=16384 -artifact_prefix="$found/$name-" "${@:2}" \
        "$work/$name" $(corpora "$name") 2>"$work/$name.err" ||
        fail "$name: $(grep -A 1 panicked "$work/$name.err" | paste -s -d ' '); the input is in $found"
    printf '  %-10s %s\n' "$name" "$(grep -o 'Done .*' "$work/$name.err")"
}

if [ $# -gt 0 ]; then
    search "$1" -max_total_time="$2"
    exit
fi
while read -r name runs; do
    search "$name" -seed=1 -runs="$runs"
done <<'TARGETS'
arguments 1000000
asc 50000
board 500000
candump 20000
dbc 500000
frame 500000
gains 20000
judges 5000
model 20000
node 10000
payload 200000
pcapng 20000
scenario 20000
slcan 500000
TARGETS
