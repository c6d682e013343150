#!/usr/bin/env bash
# A campaign of a thousand cases: the same results on one machine and in parts, killed at any moment, as a job array of a real
# Slurm and through Snakemake. What they come to is in docs/campaign.md, which 40-docs.sh compares.
source "$(dirname "$0")/lib.bash"
build_host
export PATH=$bin:$PATH
campaign=$root/plant-sim/campaigns
cd "$work"

judged() { # judged COMMAND...: it may say that a case missed a requirement
    "$@" 2>"$work/judged.err" || [ $? = 1 ]
}

plant-sim campaign plan --count 1000 --seed 1 >plan.jsonl
echo "- a thousand cases at once"
judged plant-sim campaign run plan.jsonl --out whole
plant-sim campaign merge whole >whole.jsonl
[ "$(wc -l <whole.jsonl)" = 1001 ]
judged plant-sim campaign report whole.jsonl --picture worst.svg >/dev/null
grep -q '</svg>' worst.svg

echo "- in two parts, one after the other"
for part in 0 1; do
    judged plant-sim campaign run plan.jsonl --shard $part/2 --out parts
done
plant-sim campaign merge parts | cmp - whole.jsonl

echo "- killed at any moment"
for _ in 1 2 3 4 5 6; do
    plant-sim campaign run plan.jsonl --out killed --resume 2>"$work/killed.err" &
    sleep "$((RANDOM % 2)).$((RANDOM % 10))5"
    kill -KILL $! 2>/dev/null || true
    wait $! 2>/dev/null || true
done
judged plant-sim campaign run plan.jsonl --out killed --resume
plant-sim campaign merge killed | cmp - whole.jsonl

echo "- as a job array of Slurm, one task of which is lost and run again"
need_slurm
slurm() { # slurm NUMBERS [PARTS]
    sbatch --quiet --wait --array="$1" --output="$work/task-%a.err" "$campaign/slurm.sh" "$work/plan.jsonl" "$work/slurm" "${@:2}"
}
slurm 0-3
plant-sim campaign merge slurm | cmp - whole.jsonl
rm slurm/results-2-of-4.jsonl
[ "$(plant-sim campaign missing slurm)" = 2 ]
slurm "$(plant-sim campaign missing slurm)" 4
plant-sim campaign merge slurm | cmp - whole.jsonl
stop_slurm

echo "- through Snakemake"
need_python snakemake==9.16.3
mkdir snake
(cd snake && "$python" -m snakemake --snakefile "$campaign/Snakefile" --cores 2 --quiet all \
    --config plan="$work/plan.jsonl" parts=3 >"$work/snakemake.err" 2>&1)
cmp snake/merged.jsonl whole.jsonl
