#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
#
# One run as a Slurm job that survives its time limit:
#
#     sbatch scripts/hpc/job.sh MODEL OUT.h5 [OPTION of rockdda run ...]
#
# MODEL is a folder with a geometry or block file, an analysis file and at most one .nml. Five minutes before the limit
# Slurm sends USR1; rockdda ends its step, writes a checkpoint and leaves with code 4; the job is put back into the
# queue and goes on where it stopped. Started once more, by hand or after a crash of the node, it goes on too, or says
# that the run is done. Cancelled (SIGTERM), it ends in the same order and stays out of the queue.
#
# With $SCRATCH_DIR set the run works in a folder there, and the results are copied back when it ends, however it ends.
#
#SBATCH --job-name=rockdda
#SBATCH --nodes=1 --ntasks=1 --cpus-per-task=1
#SBATCH --time=24:00:00
#SBATCH --signal=USR1@300
#SBATCH --requeue --open-mode=append
set -u

if [ $# -lt 2 ]; then
  sed -n '4,14s/^# \{0,1\}//p' "$0" >&2
  exit 2
fi
model=$(realpath -- "$1") || exit 2
mkdir -p -- "$(dirname -- "$2")" || exit 5
out=$(realpath -- "$2") || exit 2
shift 2
stem=${out%.h5}
rockdda=${ROCKDDA:-rockdda}

# Whole cores, threads in their places, none for BLAS.
export OMP_NUM_THREADS=${SLURM_CPUS_PER_TASK:-1} OMP_PLACES=cores OMP_PROC_BIND=close OPENBLAS_NUM_THREADS=1

say() { printf '%s %s: %s\n' "$(date -u +%FT%TZ)" "${SLURM_JOB_ID:-no job}" "$*"; }

# copy FROM_STEM TO_STEM: results before the checkpoint, each in one step, so that the pair always fits: results may go
# beyond their checkpoint, never the other way round. An undo file, which a crash leaves, leads back from these results
# only: the older one goes before them.
copy() {
  local ending
  for ending in h5 log ckpt.h5 h5.undo; do
    [ -f "$1.$ending" ] || continue
    cp -- "$1.$ending" "$2.$ending.copy" || return 5
    [ "$ending" != h5 ] || rm -f -- "$2.h5.undo" || return 5
    mv -- "$2.$ending.copy" "$2.$ending" || return 5
  done
}

work=$stem
if [ -n "${SCRATCH_DIR:-}" ]; then
  folder=$(mktemp -d -- "$SCRATCH_DIR/rockdda-XXXXXX") || exit 5
  trap 'rm -rf -- "$folder"' EXIT
  work=$folder/$(basename -- "$stem")
  copy "$stem" "$work" || exit 5
fi

if [ -f "$work.ckpt.h5" ]; then
  command=("$rockdda" resume "$work.ckpt.h5" --threads "$OMP_NUM_THREADS")
else
  command=("$rockdda" run "$model" -o "$work.h5" --threads "$OMP_NUM_THREADS" "$@")
  # killed before its first checkpoint: there is nothing to lose
  if [ -f "$work.h5" ] && ! "$rockdda" info "$work.h5" --json --quiet 2>/dev/null | grep -q '"steps": [1-9]'; then
    command+=(--force)
  fi
fi

say "${command[*]}"
srun "${command[@]}" --quiet --json >"$stem.json.part" &
run=$!
# A job that is cancelled gets SIGTERM as a whole, this script too: stay until the run has written its checkpoint.
trap 'signalled=yes; kill -TERM "$run" 2>/dev/null' TERM INT HUP
signalled=yes
while [ -n "$signalled" ]; do
  signalled=
  wait "$run"
  code=$?
done
mv -- "$stem.json.part" "$stem.json"
if [ "$work" != "$stem" ]; then
  copy "$work" "$stem" || { say "cannot copy the results back; they are left in $folder"; trap - EXIT; exit 5; }
fi
fact() { sed -n 's/.*"'"$1"'": \([0-9]*\)[,}].*/\1/p' "$stem.json"; }
reason() { sed -n 's/.*"exit_reason": "\([^"]*\)".*/\1/p' "$stem.json"; }

case $code in
  0) say "done after $(fact steps) steps" ;;
  4 | 138) # 128 + SIGUSR1: the time was over before the run could begin
    case $(reason) in
      *SIGTERM | *SIGINT | *SIGHUP)
        say "cancelled ($(reason)) after step $(fact steps); start the job again to go on"
        exit 4
        ;;
    esac
    if [ "$(fact steps)" = "$(fact first_step)" ]; then
      say "stopped before a single step was done: a longer --time is needed"
      exit 4
    fi
    say "stopped after step $(fact steps), back into the queue"
    if [ -n "${SLURM_ARRAY_JOB_ID:-}" ]; then
      scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID"
    else
      scontrol requeue "$SLURM_JOB_ID"
    fi
    ;;
  *)
    say "failed with exit code $code, see above and $stem.log"
    exit "$code"
    ;;
esac
