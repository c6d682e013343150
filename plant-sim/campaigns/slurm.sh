#!/bin/bash
# A campaign as a job array of Slurm. Every task runs its part of the plan, and goes on where an earlier try was ended:
#
#     sbatch --array=0-99 slurm.sh plan.jsonl results
#
# What is missing afterwards, of the 100 parts:
#
#     sbatch --array="$(plant-sim campaign missing results)" slurm.sh plan.jsonl results 100
#
#SBATCH --job-name=campaign
#SBATCH --requeue

plan=$1 out=$2 parts=${3:-$SLURM_ARRAY_TASK_COUNT}
plant-sim campaign run "$plan" --shard "$parts" --jobs "${SLURM_CPUS_PER_TASK:-1}" --resume --out "$out"
status=$?
# 1: a case missed a requirement. The results are there, and another try would not change them.
[ "$status" = 1 ] && [ -e "$out/results-$SLURM_ARRAY_TASK_ID-of-$parts.jsonl" ] || exit "$status"
