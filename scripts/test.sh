#!/usr/bin/env bash
# The gate and the tests on the wheels of PyPI, but for the evidence and what takes turns
# and is not in this commit's (`scripts/evidence.sh tests` asks both);
# those of the page in Debian's Chromium, one job under a real Slurm, then what writes
# by MPI-IO once more with an h5py that does, under Debian's Open MPI. Tells the slowest
# forty and the times.
# shellcheck disable=SC2030,SC2031  # each part lives in a subshell of its own
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export NUMBA_CACHE_DIR=$scratch/numba
export PYTHONDONTWRITEBYTECODE=  # many processes start: none compiles modules anew

uv="uv==0.13.9"
warms=test_one_rank_that_warms_leaves_the_others_nothing_to_compile
requeued=test_a_warned_campaign_stops_with_75_comes_again_and_completes
browser=(chromium chromium-driver)

say() { echo "test: $*"; }
fail() { echo "test: $*" >&2; exit 1; }
# shellcheck source=scripts/debian.sh
. scripts/debian.sh

# Always the MPICH wheel, whatever mpirun the machine has: part two installs one, and
# the second run must test what the first one did.
on_wheels() (
  export HPCWHIRL_VENV=$root/.venv HPCWHIRL_EXTRAS=dev,docs HPCWHIRL_MPI=${HPCWHIRL_MPI:-mpich}
  [ -x "$HPCWHIRL_VENV/bin/python" ] || fetch_uv "$HPCWHIRL_VENV" ||
    say "uv could not be installed: pip takes its place"
  # shellcheck source=scripts/environment.sh
  . scripts/environment.sh
  export HPCWHIRL_MPIRUN=$MPIRUN
  scripts/check --no-tests
  scripts/docs.sh "$scratch/site"
  if (system_packages "the page's tests" "${browser[@]}"); then
    export HPCWHIRL_EXPECT_BROWSER=1  # a skip would now be a failure
  else
    say "the page's tests are skipped"
  fi
  scripts/releases.sh
  (system_packages "CalculiX's wheel" calculix-ccx) || say "it is skipped"
  # First: what it compiles is in the cache for all others.
  pytest --processor=1 tests/dynamics/test_compiling.py -k "$warms"
  # a file's fixtures and servers of forks are made by one worker, not by both
  pytest -n 2 --dist loadfile --processor=40 --turn=commit -m "not mpi and not evidence" -k "not $warms"
  with_mark mpi
  pytest --processor=40 --turn=commit -m "mpi and not evidence" "${files[@]}"  # alone: ranks need cores
  if (system_packages "a job of Slurm" slurmctld slurmd slurm-client munge); then
    HPCWHIRL_CLUSTER=1 PATH=$PATH:/usr/sbin:/sbin pytest --processor=3 \
      tests/cluster/test_cluster.py -k "$requeued and mpirun"
  else
    say "the job of Slurm is skipped"
  fi
)

# environment.sh installs the packages with it.
fetch_uv() {  # VENV
  "${PYTHON:-python3}" -m venv "$1" &&
    "$1/bin/python" -m pip --quiet --disable-pip-version-check install --no-compile "$uv"
}

# To collect all tests takes ten seconds; tests/conftest.py checks that none is missed.
with_mark() {  # MARK
  mapfile -t files < <(grep -rlwF "mark.$1" tests --include='test_*.py' | sort)
}

on_mpiio() (
  use_mpiio
  with_mark mpiio
  # those of part one's turn, with this h5py
  python -m pytest --processor=10 --turn=commit -m "mpiio and not evidence" "${files[@]}"
)

say "part 1 of 2: the gate and all tests on wheels"
on_wheels
say "part 2 of 2: MPI-IO"
on_mpiio
echo "test: the processor, this shell and all it started:"
times
