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

# Built beside the tests, of which it takes what is not ours. tests/fuzz/rustc adds what libFuzzer needs.
RUSTC_WORKSPACE_WRAPPER=$root/tests/fuzz/rustc cargo build --quiet --locked --package fuzz --features libfuzzer --profile test
fuzz=$target/debug/fuzz
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
arguments 400000
asc 25000
board 500000
candump 10000
dbc 500000
frame 500000
gains 8000
judges 3000
model 20000
node 5000
payload 200000
pcapng 20000
scenario 20000
slcan 500000
TARGETS
