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

echo "- at other rates"
for rate in 500 2000; do
    sed "s/\"cycles=1\"/\"cycles=1\", \"rate_hz=$rate\"/" "$campaign/default.toml" >"at-$rate.toml"
    plant-sim campaign plan --cases "at-$rate.toml" --count 500 --seed 1 >"at-$rate.jsonl"
    # Nothing may be missed.
    plant-sim campaign run "at-$rate.jsonl" --out "at-$rate" >/dev/null
done

echo "- in two parts, one after the other"
for part in 0 1; do
    judged plant-sim campaign run plan.jsonl --shard $part/2 --out parts
done
plant-sim campaign merge parts | cmp - whole.jsonl

echo "- killed a hundred times, at any moment"
# Cases of a millisecond, so that a batch of them is soon on disk: on two cores 61 batches. A run lasts for up to five of them, its reading of the
# plan included: many kills come before the end of a batch, and all parts are done before a hundred of them, and begun anew.
cat >short.toml <<'END'
faults = ["encoder:elbow:jump=0.2", "encoder:lift:noise=0.05"]
lasts_ms = [0]
[[situation]]
name = "standing"
scenario = "gate"
set = ["cycles=1", "cycle=[{ dwell = 0.1 }]"]
begin_ms = { from = 100, until = 124, step = 0.002 }
END
plant-sim campaign plan --cases short.toml >short.jsonl
began=${EPOCHREALTIME/./}
plant-sim campaign run short.jsonl --jobs 2 --out undisturbed >/dev/null 2>"$work/undisturbed.err"
batch=$(((${EPOCHREALTIME/./} - began) / 61))
plant-sim campaign merge undisturbed >undisturbed.jsonl
mkdir killed
saved() { find killed -type f -exec cat {} + | wc -l; }
part=0 kills=0 progress=0
while [ $kills -lt 100 ]; do
    if [ $part = 4 ]; then
        plant-sim campaign merge killed | cmp - undisturbed.jsonl
        rm -r killed
        mkdir killed
        part=0
    fi
    before=$(saved)
    plant-sim campaign run short.jsonl --jobs 2 --shard $part/4 --out killed --resume >/dev/null 2>"$work/killed.err" & run=$!
    sleep "$((RANDOM * 5 * batch / 32768))e-6"
    kill -KILL $run 2>/dev/null || true
    status=0
    wait $run 2>/dev/null || status=$?
    if [ $status = 137 ]; then
        kills=$((kills + 1)) progress=$((progress + ($(saved) > before)))
        [ ! -e killed/results-$part-of-4.jsonl ] || part=$((part + 1))
    else
        # It was faster than its end.
        [ $status = 0 ] && [ -e killed/results-$part-of-4.jsonl ] || fail "a run that was to be killed: status $status"
        part=$((part + 1))
    fi
done
[ $progress -ge 10 ] || fail "only $progress of $kills killed runs had saved anything"
for part in 0 1 2 3; do
    plant-sim campaign run short.jsonl --jobs 2 --shard $part/4 --out killed --resume >/dev/null 2>"$work/killed.err"
done
plant-sim campaign merge killed | cmp - undisturbed.jsonl
echo "  $kills runs killed, $progress of them with new results; the same in the end"

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

echo "- through Snakemake, with its report, and a second time without one of the results"
need_python snakemake==9.16.3
mkdir snake
snakemake() {
    (cd snake && "$python" -m snakemake --snakefile "$campaign/Snakefile" --cores 2 "$@" --config plan="$work/plan.jsonl" parts=3 \
        >"$work/snakemake.err" 2>&1)
}
snakemake report
cmp snake/merged.jsonl whole.jsonl
plant-sim campaign report whole.jsonl >report.md || [ $? = 1 ]
cmp snake/report.md report.md
rm snake/results/results-1-of-3.jsonl snake/merged.jsonl snake/report.md
stat -c '%n %y' snake/results/* >kept
snakemake report
# One part, the merge and the report.
grep -qx '3 of 3 steps (100%) done' "$work/snakemake.err"
stat -c '%n %y' snake/results/* | grep -v -e -1-of- | cmp - kept
cmp snake/merged.jsonl whole.jsonl
cmp snake/report.md report.md
