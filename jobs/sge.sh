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

# USR1: the time limit is near; stop the campaign, then requeue the job.
# TERM INT USR2: the job was cancelled; stop the campaign, do not requeue.
running='' again=yes told=no
# shellcheck disable=SC2317,SC2329  # the traps call it
stop() {
  caught=yes told=yes
  [ -n "$running" ] || return 0
  kill -USR1 "$running" || true
  # send it twice: a process that is just starting may lose a signal
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

work=(hpcwhirl campaign "$file" --out "$out")

code=75  # as if stopped, if a signal came before the campaign began
if [ "$told" = no ]; then
  # USR2, which some schedulers send to all, must not kill the ranks
  (trap '' USR2; exec timeout --foreground --preserve-status -s USR1 14280 mpirun -n "$ranks" "${work[@]}") &
  running=$!
  [ "$told" = no ] || stop  # a signal came between the start and running=$!
  while :; do  # a trapped signal ends `wait` although the ranks still run: wait again
    caught=no code=0
    wait "$running" || code=$?
    [ "$caught" = yes ] || break
  done
fi
# Ranks die of a signal that comes before Python handles it: nothing is lost, requeue.
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
  code=1  # not 75, at which some schedulers requeue the job
fi
exit "$code"
