#!/usr/bin/env bash
# The lowest versions of all dependencies that pyproject.toml allows: installs them in a
# virtual environment of its own, and lets them compute, gather, draw and be read. Takes
# uv from $HPCWHIRL_VENV (default .venv), where scripts/test.sh has put it, and some two
# minutes of the processor, since kernels are compiled. PYTHON chooses the interpreter.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
uv=${HPCWHIRL_VENV:-.venv}/bin/uv
[ -x "$uv" ] || { echo "lowest: no $uv: bash scripts/test.sh installs it" >&2; exit 1; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export NUMBA_CACHE_DIR=$scratch/numba OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

"$uv" venv --quiet --python "${PYTHON:-python3}" "$scratch/venv"
"$uv" pip install --quiet --system-certs --resolution lowest-direct \
  --python "$scratch/venv/bin/python" "$root"
"$uv" pip list --python "$scratch/venv/bin/python" 2>/dev/null | grep -E -i \
  '^(numpy|scipy|numba|mpi4py|h5py|pydantic|rich|tomli.w|matplotlib|xarray|h5netcdf|threadpoolctl|cf.units) '
cd "$scratch"
PATH=$scratch/venv/bin:$PATH
cat >two.toml <<'F'
[scene]
duration = 0.01
[output]
traces = "full"
[sweep]
speed = [300, 410]
gap = ["0.1 mm", "0.2 mm"]
F
hpcwhirl campaign two.toml --out out --dry-run
hpcwhirl campaign two.toml --out out
hpcwhirl cases out --csv --where "regime != divergent"
hpcwhirl figures out --kind orbit --kind ledger
hpcwhirl classify out --set rise=0.3 --write
hpcwhirl margin out
hpcwhirl model two.toml >model.txt
hpcwhirl report out
python -c '
import hpcwhirl
data = hpcwhirl.open_results("out")
assert data.sizes["case"] == 4 and (data.status == "ok").all()
data.hpcwhirl.map()
print(data.hpcwhirl.where("speed > 300").speed.values)
'
echo "lowest: all ran"
