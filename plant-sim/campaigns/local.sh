#!/bin/bash
# A campaign on this machine, from plan to report: local.sh COUNT [SEED]
set -eo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
plant-sim campaign plan --count "$1" --seed "${2:-1}" >"$folder/plan.jsonl"
# 1: a case missed a requirement; the report says which.
plant-sim campaign run "$folder/plan.jsonl" --out "$folder" &>"$folder/said" || [ $? = 1 ] || { cat "$folder/said" >&2; exit 1; }
plant-sim campaign merge "$folder" >"$folder/merged.jsonl"
plant-sim campaign report "$folder/merged.jsonl" 2>"$folder/said" || [ $? = 1 ]
