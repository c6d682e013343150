#!/usr/bin/env bash
# The documents are true: figures and tables are what the programs print, commands are there, links lead somewhere.
source "$(dirname "$0")/lib.bash"
source tests/ci/board.bash
cargo build --release --locked --quiet --package tests --bin docs

echo "- a wrong figure, an option and a file that are not there are found"
cat >"$work/wrong.md" <<'END'
<!-- from: echo 1 -->
2
<!-- end -->
`plant-sim run --none`, [none](none.md)
END
refused '3 problems' "$bin/docs" "$work/wrong.md"

echo "- every document"
"$bin/docs"
