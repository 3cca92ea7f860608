#!/bin/bash
#$ -S /bin/bash
#$ -cwd
#$ -N hpcwhirl
#$ -pe mpi 32
#$ -l h_rt=04:00:00
#$ -notify
#$ -r y
#$ -j y
# Printed by: hpcwhirl job sge campaign.toml --script jobs/sge.sh
# Submit with: qsub jobs/sge.sh

# USR1: the time is nearly over; stop, keep all, come again.
# TERM INT USR2: someone ended the job; stop, keep all, leave it at that.
running='' again=yes told=no
# shellcheck disable=SC2317,SC2329  # the traps call it
stop() {
  caught=yes told=yes
  [ -n "$running" ] || return 0
  kill -USR1 "$running" || true
  # once more: a process that is just being made may lose a signal
  { sleep 3; kill -USR1 "$running"; } >/dev/null 2>&1 &
}
trap stop USR1
trap 'again=no; stop' TERM INT USR2

set -eo pipefail
file=campaign.toml
out=campaign
ranks=32
most_requeues=20
# module load the MPI that mpi4py was built for (--module)
# source VENV/bin/activate (--venv)

set -u
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1
mkdir -p "$out"
# compiled once, kept for the next run; one rank a node fills it, all may write there
export NUMBA_CACHE_DIR="${NUMBA_CACHE_DIR:-$(cd "$out" && pwd)/numba-cache}"

work=(hpcwhirl campaign "$file" --out "$out")

code=75  # as of what was told to stop before it began
if [ "$told" = no ]; then
  # USR2, which some schedulers send to all, must not kill the ranks
  (trap '' USR2; exec timeout --foreground --preserve-status -s USR1 14280 mpirun -n "$ranks" "${work[@]}") &
  running=$!
  [ "$told" = no ] || stop  # told just now
  while :; do  # a signal that is caught ends the wait, not what is waited for
    caught=no code=0
    wait "$running" || code=$?
    [ "$caught" = yes ] || break
  done
fi
# Told to stop before Python could hear it, ranks die of that: nothing is lost.
if [ "$told" = yes ]; then
  case $code in 0 | 1 | 2 | 70) ;; *) code=75 ;; esac
fi

used_up() {
  echo "hpcwhirl: started again $most_requeues times, and there is more to do:" \
    "submit it once more" >&2
}
if [ "$code" = 75 ] && [ "$again" = yes ]; then  # there is more to do
  count="$out/requeues-${JOB_ID}_$SGE_TASK_ID"
  used=$(cat "$count" 2>/dev/null || echo 0)
  if [ "$used" -lt "$most_requeues" ]; then
    echo "$((used + 1))" >"$count"
    exit 99
  fi
  used_up
  code=1  # not 75: that would bring it back
fi
exit "$code"
