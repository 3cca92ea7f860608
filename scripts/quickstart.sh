#!/usr/bin/env bash
# From a fresh clone to a map: the environment, then the built-in campaign on two ranks.
#   scripts/quickstart.sh [DIR]    results go to DIR (default campaign)
set -euo pipefail
out=${1:-campaign}
# shellcheck source=scripts/environment.sh
. "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

echo "quickstart: running the built-in campaign on 2 ranks into $out"
"$MPIRUN" -n 2 hpcwhirl campaign --out "$out"
if [ ! -s "$out/map.png" ]; then
  echo "quickstart: the campaign ended but left no map at $out/map.png" >&2
  exit 1
fi
echo "quickstart: done; the map is $(cd "$out" && pwd)/map.png"
