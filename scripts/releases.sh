#!/usr/bin/env bash
# Compiled code with other releases of numba than the tests' one: the lowest that
# pyproject.toml allows, and the newest if it is another one. Kernels are compiled, kept
# on disk and found again; with --march scheme paper is integrated, too (a minute of the
# processor). Each release is in a virtual environment of its own, which lends the rest
# from $HPCWHIRL_VENV (default .venv).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
venv=$(cd "${HPCWHIRL_VENV:-.venv}" && pwd)
lowest=$(sed -n 's/^ *"numba>=\([0-9.]*\)".*/\1/p' pyproject.toml)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
tests='not others'  # they are of no release
site='import sysconfig; print(sysconfig.get_path("purelib"))'
version='import numba; print(numba.__version__)'
march='
from hpcwhirl import simulate
from hpcwhirl.scene import apply_settings, named_scene
scene = apply_settings(named_scene("table2"), {"scheme": "paper", "duration": 2e-3})
print("releases: marched, motion:", simulate(scene).regime)
'

install() {  # NUMBA
  "$venv/bin/python" -m venv --without-pip "$scratch/$1"
  "$venv/bin/python" -m pip --quiet --disable-pip-version-check \
    --python "$scratch/$1/bin/python" install "$1"
  "$venv/bin/python" -c "$site" >"$scratch/$1/lend.pth"
  mv "$scratch/$1/lend.pth" "$("$scratch/$1/bin/python" -c "$site")/lend.pth"
}

try() {  # NUMBA
  local python=$scratch/$1/bin/python
  install "$1"
  echo "releases: numba $("$python" -c "$version")"
  export NUMBA_CACHE_DIR=$scratch/cache PYTHONPATH=$PWD
  "$python" -m pytest -q -p no:cacheprovider tests/dynamics/test_kernel_cache.py -k "$tests"
  [ -z "$with_march" ] || "$python" -c "$march"
}

newest() {
  "$venv/bin/python" -m pip --disable-pip-version-check index versions numba 2>/dev/null |
    sed -n '1s/numba (\(.*\))/\1/p'
}

with_march=
[ "${1:-}" != --march ] || with_march=yes
try "numba==$lowest.0"
if [ "$(newest)" = "$("$venv/bin/python" -c "$version")" ]; then
  echo "releases: the newest is that of all tests"
else
  try numba
fi
