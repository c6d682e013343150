#!/usr/bin/env bash
# The documents are correct: figures and tables match the programs' output, commands exist, links lead somewhere.
source "$(dirname "$0")/lib.bash"
source tests/ci/board.bash
cargo build --release --locked --quiet --package tests --bin docs

echo "- a wrong figure, a missing option and a missing file are found"
cat >"$work/wrong.md" <<'END'
<!-- from: echo 1 -->
2
<!-- end -->
`plant-sim run --none`, [none](none.md)
END
refused '3 problems' "$bin/docs" "$work/wrong.md"

echo "- every document"
"$bin/docs"
