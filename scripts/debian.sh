# shellcheck shell=bash
# Sourced by the other scripts: packages of Debian that tests need, and the environment
# .venv-mpiio, with Debian's Open MPI and an h5py that writes by MPI-IO. The caller
# defines $root, the clone, and say and fail, which print a line.
# shellcheck disable=SC2154  # $root

# h5py's parallel build is a build from source: pinned to one that compiles here.
h5py_parallel="h5py==3.16.0"
mpiio_packages=(libhdf5-openmpi-dev openmpi-bin gcc hdf5-tools)

missing_of() {  # PACKAGE...
  local name
  for name in "$@"; do
    dpkg-query -W -f '${Status}' "$name" 2>/dev/null | grep -q 'install ok installed' ||
      echo "$name"
  done
}

system_packages() {  # WHAT PACKAGE...
  local what=$1 missing log
  shift
  command -v dpkg-query >/dev/null || fail "$what need Debian or Ubuntu (packages: $*)"
  mapfile -t missing < <(missing_of "$@")
  [ "${#missing[@]}" -gt 0 ] || return 0
  [ "$(id -u)" = 0 ] ||
    fail "$what need: sudo apt-get install --no-install-recommends ${missing[*]}"
  say "installing ${missing[*]}"
  export DEBIAN_FRONTEND=noninteractive
  log=$(mktemp)
  { apt-get -qq update &&
    apt-get -qq install --yes --no-install-recommends "${missing[@]}"; } >"$log" 2>&1 ||
    { tail -20 "$log" >&2; fail "apt-get could not install ${missing[*]}"; }
  rm -f "$log"
}

first_of() {  # WHAT CANDIDATE...
  local what=$1 path
  shift
  for path in "$@"; do
    if [ -e "$path" ]; then echo "$path"; return 0; fi
  done
  fail "$what not found (looked for $*)"
}

has_mpiio() {  # VENV
  "$1/bin/python" -c 'import h5py, sys; sys.exit(not h5py.get_config().mpi)' 2>/dev/null
}

# All but h5py is that of .venv. No build isolation: it would compile mpi4py too. No
# cache: a wheel of h5py built for another MPI crashes. No optimisation, no symbols for a
# debugger: compiling is most of the work.
build_h5py() {  # VENV
  local pip=("$1/bin/python" -m pip --quiet --disable-pip-version-check) libraries log
  local place='import sysconfig; print(sysconfig.get_path("purelib"))'
  libraries=$(first_of "parallel HDF5" /usr/lib/*/hdf5/openmpi)
  say "building a parallel h5py (a minute or two)"
  "${PYTHON:-python3}" -m venv --clear --without-pip "$1"
  "$root/.venv/bin/python" -c "$place" >"$("$1/bin/python" -c "$place")/wheels.pth"
  "${pip[@]}" install --no-compile cython pkgconfig 'setuptools>=77' wheel
  log=$(mktemp)
  HDF5_MPI=ON CC=mpicc.openmpi CFLAGS='-O0 -g0' HDF5_LIBDIR=$libraries \
    HDF5_INCLUDEDIR=/usr/include/hdf5/openmpi "${pip[@]}" install --no-compile --no-cache-dir --no-build-isolation \
    --ignore-installed --no-deps --no-binary=h5py "$h5py_parallel" >"$log" 2>&1 ||
    { tail -30 "$log" >&2; fail "h5py did not build"; }
  rm -f "$log"
  has_mpiio "$1" || fail "h5py was built but without MPI-IO"
}

# Leaves the shell in .venv-mpiio; to be called in a subshell.
use_mpiio() {
  # without extras: their packages are those of .venv
  export HPCWHIRL_VENV=$root/.venv-mpiio HPCWHIRL_EXTRAS=
  system_packages "the MPI-IO tests" "${mpiio_packages[@]}"
  # Debian's own, even where another MPI comes first on PATH.
  MPI4PY_LIBMPI=$(first_of "Open MPI" /usr/lib/*/libmpi.so.40)
  export MPI4PY_LIBMPI HPCWHIRL_MPI=/usr/bin/mpirun.openmpi
  has_mpiio "$HPCWHIRL_VENV" || build_h5py "$HPCWHIRL_VENV"
  # h5py must stay the one just built.
  PIP_CONSTRAINT=$HPCWHIRL_VENV/constraints.txt
  export PIP_CONSTRAINT
  echo "$h5py_parallel" >"$PIP_CONSTRAINT"
  # shellcheck source=scripts/environment.sh
  . scripts/environment.sh || exit 1
  has_mpiio "$HPCWHIRL_VENV" || fail "pip replaced the parallel h5py"
  export HPCWHIRL_MPIRUN=$MPIRUN HPCWHIRL_EXPECT_MPIIO=1
}
