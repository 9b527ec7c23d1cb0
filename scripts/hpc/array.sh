#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
#
# A folder of models as an array of jobs, one run each:
#
#     sbatch --array=1-$(ls -d MODELS/*/ | wc -l)%20 scripts/hpc/array.sh MODELS RESULTS [OPTION of rockdda run ...]
#
# Task k takes the k-th folder of MODELS in alphabetical order and writes RESULTS/NAME.h5. Each task survives its time
# limit and can be started again, see job.sh.
#
#SBATCH --job-name=rockdda-array
#SBATCH --nodes=1 --ntasks=1 --cpus-per-task=1
#SBATCH --time=24:00:00
#SBATCH --signal=USR1@300
#SBATCH --requeue --open-mode=append
set -u

if [ $# -lt 2 ] || [ -z "${SLURM_ARRAY_TASK_ID:-}" ]; then
  sed -n '4,9s/^# \{0,1\}//p' "$0" >&2
  exit 2
fi
models=("$1"/*/)
results=$2
shift 2
number=$SLURM_ARRAY_TASK_ID
if [ "$number" -lt 1 ] || [ "$number" -gt ${#models[@]} ] || [ ! -d "${models[number - 1]}" ]; then
  echo "array.sh: there is no model number $number: ${#models[@]} folders" >&2
  exit 2
fi
model=${models[number - 1]%/}
# Slurm runs a copy of this script: $ROCKDDA_HPC says where job.sh is, else it is looked for beside this script.
exec bash "${ROCKDDA_HPC:-$(dirname -- "$0")}/job.sh" "$model" "$results/$(basename -- "$model").h5" "$@"
