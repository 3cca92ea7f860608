#!/bin/bash
# A campaign under Slurm: sbatch jobs/slurm.sh FILE.toml DIR
# Adapt what is marked; see "On a cluster" in the README.
#SBATCH --job-name=hpcwhirl
#SBATCH --ntasks=32              # adapt
#SBATCH --cpus-per-task=1
#SBATCH --time=04:00:00          # adapt
#SBATCH --signal=B:USR1@120      # finish slices 2 minutes before the end
#SBATCH --requeue
#SBATCH --open-mode=append
set -euo pipefail

file=$1 out=$2
# module load openmpi            # adapt: the MPI that mpi4py was built for
# source /path/to/venv/bin/activate
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1
export NUMBA_CACHE_DIR=${NUMBA_CACHE_DIR:-$out/numba-cache}
most_restarts=20

mpirun -n "$SLURM_NTASKS" hpcwhirl campaign "$file" --out "$out" &
running=$!
trap 'kill -USR1 "$running"' USR1 TERM
code=0
wait "$running" || code=$?
while kill -0 "$running" 2>/dev/null; do  # a trapped signal ends only the wait
  code=0
  wait "$running" || code=$?
done

if [ "$code" = 75 ] && [ "${SLURM_RESTART_COUNT:-0}" -lt "$most_restarts" ]; then
  scontrol requeue "$SLURM_JOB_ID"  # the same command continues where it stopped
fi
exit "$code"
