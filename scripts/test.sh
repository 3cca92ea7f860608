#!/usr/bin/env bash
# The gate and all tests but the evidence (scripts/evidence.sh tests) on the wheels of
# PyPI, those of the page in Debian's Chromium, then what writes by MPI-IO once more with
# an h5py that does, under Debian's Open MPI. Tells the slowest forty and the times.
# shellcheck disable=SC2030,SC2031  # each part lives in a subshell of its own
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export NUMBA_CACHE_DIR=$scratch/numba
export PYTHONDONTWRITEBYTECODE=  # many processes start: none compiles modules anew

# h5py's parallel build is a build from source: pinned to one that compiles here.
h5py_parallel="h5py==3.16.0"
uv="uv==0.13.9"
warms=test_one_rank_that_warms_leaves_the_others_nothing_to_compile
packages=(libhdf5-openmpi-dev openmpi-bin gcc hdf5-tools)
browser=(chromium chromium-driver)

say() { echo "test: $*"; }
fail() { echo "test: $*" >&2; exit 1; }

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
  pytest -n 2 --dist loadfile --processor=40 -m "not mpi and not evidence" -k "not $warms"
  with_mark mpi
  pytest --processor=40 -m "mpi and not evidence" "${files[@]}"  # alone: ranks need cores
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

missing_of() {  # PACKAGE...
  local name
  for name in "$@"; do
    dpkg-query -W -f '${Status}' "$name" 2>/dev/null | grep -q 'install ok installed' ||
      echo "$name"
  done
}

system_packages() {  # WHAT PACKAGE...
  local what=$1 missing
  shift
  command -v dpkg-query >/dev/null || fail "$what need Debian or Ubuntu (packages: $*)"
  mapfile -t missing < <(missing_of "$@")
  [ "${#missing[@]}" -gt 0 ] || return 0
  [ "$(id -u)" = 0 ] ||
    fail "$what need: sudo apt-get install --no-install-recommends ${missing[*]}"
  say "installing ${missing[*]}"
  export DEBIAN_FRONTEND=noninteractive
  apt-get -qq update
  apt-get -qq install --yes --no-install-recommends "${missing[@]}" >"$scratch/apt.log" 2>&1 ||
    { tail -20 "$scratch/apt.log" >&2; fail "apt-get could not install ${missing[*]}"; }
}

first_of() {  # WHAT CANDIDATE...
  local what=$1 path
  shift
  for path in "$@"; do
    if [ -e "$path" ]; then echo "$path"; return 0; fi
  done
  fail "$what not found (looked for $*)"
}

has_mpiio() {
  "$1/bin/python" -c 'import h5py, sys; sys.exit(not h5py.get_config().mpi)' 2>/dev/null
}

# All but h5py is that of part one. No build isolation: it would compile mpi4py too. No
# cache: a wheel of h5py built for another MPI crashes. No optimisation, no symbols for a
# debugger: compiling is most of the work.
build_h5py() {  # VENV
  local pip=("$1/bin/python" -m pip --quiet --disable-pip-version-check) libraries
  local place='import sysconfig; print(sysconfig.get_path("purelib"))'
  libraries=$(first_of "parallel HDF5" /usr/lib/*/hdf5/openmpi)
  say "building a parallel h5py (a minute or two)"
  "${PYTHON:-python3}" -m venv --clear --without-pip "$1"
  "$root/.venv/bin/python" -c "$place" >"$("$1/bin/python" -c "$place")/wheels.pth"
  "${pip[@]}" install --no-compile cython pkgconfig 'setuptools>=77' wheel
  HDF5_MPI=ON CC=mpicc.openmpi CFLAGS='-O0 -g0' HDF5_LIBDIR=$libraries \
    HDF5_INCLUDEDIR=/usr/include/hdf5/openmpi "${pip[@]}" install --no-compile --no-cache-dir --no-build-isolation \
    --ignore-installed --no-deps --no-binary=h5py "$h5py_parallel" \
    >"$scratch/h5py.log" 2>&1 ||
    { tail -30 "$scratch/h5py.log" >&2; fail "h5py did not build"; }
  has_mpiio "$1" || fail "h5py was built but without MPI-IO"
}

on_mpiio() (
  # without extras: their packages are those of part one
  export HPCWHIRL_VENV=$root/.venv-mpiio HPCWHIRL_EXTRAS=
  system_packages "the MPI-IO tests" "${packages[@]}"
  # Debian's own, even where another MPI comes first on PATH.
  MPI4PY_LIBMPI=$(first_of "Open MPI" /usr/lib/*/libmpi.so.40)
  export MPI4PY_LIBMPI HPCWHIRL_MPI=/usr/bin/mpirun.openmpi
  has_mpiio "$HPCWHIRL_VENV" || build_h5py "$HPCWHIRL_VENV"
  # h5py must stay the one just built.
  echo "$h5py_parallel" >"$scratch/constraints.txt"
  export PIP_CONSTRAINT=$scratch/constraints.txt
  # shellcheck source=scripts/environment.sh
  . scripts/environment.sh
  has_mpiio "$HPCWHIRL_VENV" || fail "pip replaced the parallel h5py"
  export HPCWHIRL_MPIRUN=$MPIRUN HPCWHIRL_EXPECT_MPIIO=1
  with_mark mpiio
  python -m pytest --processor=10 -m mpiio "${files[@]}"  # that of part one, with this h5py
)

say "part 1 of 2: the gate and all tests on wheels"
on_wheels
say "part 2 of 2: MPI-IO"
on_mpiio
echo "test: the processor, this shell and all it started:"
times
