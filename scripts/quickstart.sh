#!/usr/bin/env bash
# From a fresh clone to a map and a page that explores it: the environment, then the
# built-in campaign on two ranks.
#   scripts/quickstart.sh [DIR]    results go to DIR (default campaign)
set -euo pipefail
out=${1:-campaign}
# shellcheck source=scripts/environment.sh
. "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

echo "quickstart: running the built-in campaign on 2 ranks into $out"
"$MPIRUN" -n 2 hpcwhirl campaign --out "$out"
for file in map.png report.html; do
  if [ ! -s "$out/$file" ]; then
    echo "quickstart: the campaign ended but left no $out/$file" >&2
    exit 1
  fi
done
out=$(cd "$out" && pwd)
echo "quickstart: done; the map is $out/map.png"
echo "quickstart: click through its cases in a browser: $out/report.html"
