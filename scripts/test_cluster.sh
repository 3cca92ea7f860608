#!/usr/bin/env bash
# Campaigns under a real Slurm and a real Grid Engine of one node: submitted, warned and
# requeued, cancelled, as arrays of shards, with mpirun and with srun. Installs both on
# Debian or Ubuntu if it runs as root, or says what is missing. Needs no more than two
# cores, and leaves no service running.
#   scripts/test_cluster.sh [PYTEST OPTION...]
# Once with the MPI of $HPCWHIRL_VENV (default .venv), and once more with that of
# .venv-mpiio (Debian's Open MPI) if scripts/test.sh has made it.
# shellcheck disable=SC2030,SC2031  # each run lives in a subshell of its own
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
# gridengine wants something that sends mail; msmtp-mta is no service, Debian's choice is
packages=(slurmctld slurmd slurm-client munge
  gridengine-master gridengine-exec gridengine-client msmtp-mta)
begun=$SECONDS

say() { echo "test_cluster: $*"; }
fail() { echo "test_cluster: $*" >&2; exit 1; }

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
  local absent log
  PATH=$PATH:/usr/sbin:/sbin
  absent=$(missing | tr '\n' ' ')
  [ -n "$absent" ] || return 0
  command -v apt-get >/dev/null || fail "missing: $absent"
  [ "$(id -u)" = 0 ] ||
    fail "needs: sudo apt-get install --no-install-recommends ${packages[*]}"
  say "installing ${packages[*]}"
  log=$(mktemp)
  export DEBIAN_FRONTEND=noninteractive
  { no_services &&
    apt-get -qq update &&
    apt-get -qq install --yes --no-install-recommends "${packages[@]}"; } >"$log" 2>&1 ||
    { tail -20 "$log" >&2; fail "apt-get could not install ${packages[*]}"; }
  rm -f "$log"
}

on() (  # VENV
  export HPCWHIRL_VENV=$1 HPCWHIRL_EXTRAS=dev HPCWHIRL_CLUSTER=1
  # shellcheck source=scripts/environment.sh
  . scripts/environment.sh
  export HPCWHIRL_MPIRUN=$MPIRUN
  pytest -m cluster "${@:2}"
)

[ "$(id -u)" = 0 ] || fail "the daemons have to be started as root"
install
export PATH=$PATH:/usr/sbin:/sbin
HPCWHIRL_MPI=${HPCWHIRL_MPI:-mpich} on "${HPCWHIRL_VENV:-$root/.venv}" "$@"
if [ -x "$root/.venv-mpiio/bin/python" ] && [ -x /usr/bin/mpirun.openmpi ]; then
  MPI4PY_LIBMPI=$(ls /usr/lib/*/libmpi.so.40)
  export MPI4PY_LIBMPI
  HPCWHIRL_MPI=/usr/bin/mpirun.openmpi on "$root/.venv-mpiio" "$@"
fi
say "passed in $((SECONDS - begun)) s"
