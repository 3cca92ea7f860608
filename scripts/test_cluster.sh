#!/usr/bin/env bash
# Campaigns under a real Slurm and a real Grid Engine of one node: submitted, warned and
# requeued, cancelled, as arrays of shards, with mpirun and with srun. Installs both on
# Debian or Ubuntu if it runs as root, or says what is missing. Needs no more than two
# cores, and leaves no service running.
#   scripts/test_cluster.sh [PYTEST OPTION...]
# Once with the MPI of $HPCWHIRL_VENV (default .venv), and once more with that of
# .venv-mpiio, Debian's Open MPI. A run of all tests is noted in scripts/last_run.md.
# shellcheck disable=SC2030,SC2031  # each run lives in a subshell of its own
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
# gridengine wants something that sends mail; msmtp-mta is no service, Debian's choice is
packages=(slurmctld slurmd slurm-client munge
  gridengine-master gridengine-exec gridengine-client msmtp-mta)

say() { echo "test_cluster: $*"; }
fail() { echo "test_cluster: $*" >&2; exit 1; }
# shellcheck source=scripts/debian.sh
. scripts/debian.sh

missing() {
  local name
  for name in slurmctld slurmd sbatch munged; do
    command -v "$name" >/dev/null || echo "$name"
  done
  for name in sge_qmaster sge_execd qsub; do
    [ -x "/usr/lib/gridengine/$name" ] || echo "$name (Grid Engine)"
  done
}

# Neither a cluster of the machine's own nor daemons for it: tests start theirs.
no_services() {
  echo "gridengine-common shared/gridengineconfig boolean false" | debconf-set-selections
  [ -e /etc/default/gridengine ] ||
    printf 'SGE_START_MASTERD=no\nSGE_START_EXECD=no\n' >/etc/default/gridengine
}

install() {
  [ -n "$(missing)" ] || return 0
  command -v debconf-set-selections >/dev/null || fail "missing: $(missing | xargs)"
  no_services
  system_packages "the schedulers" "${packages[@]}"
}

on_wheels() (  # PYTEST OPTION...
  export HPCWHIRL_VENV=${HPCWHIRL_VENV:-$root/.venv} HPCWHIRL_EXTRAS=dev
  export HPCWHIRL_MPI=${HPCWHIRL_MPI:-mpich}
  # shellcheck source=scripts/environment.sh
  . scripts/environment.sh || exit 1
  export HPCWHIRL_MPIRUN=$MPIRUN
  python -m pytest -m cluster tests/cluster "$@"
)

on_mpiio() (  # PYTEST OPTION...
  use_mpiio
  python -m pytest -m cluster tests/cluster "$@"
)

[ "$(id -u)" = 0 ] || fail "the daemons have to be started as root"
export PATH=$PATH:/usr/sbin:/sbin HPCWHIRL_CLUSTER=1
install
result=passed
on_wheels "$@" || result=FAILED
on_mpiio "$@" || result=FAILED
[ "$#" -gt 0 ] || "$root/.venv/bin/python" scripts/last_run.py cluster "$result"
say "$result in $SECONDS s"
[ "$result" = passed ]
