#!/usr/bin/env bash
# Everything that the paper does not give, from nothing: the environment, the bladed
# disk's sections from its frequencies, then casing, dampings and pulse from motions,
# three hours at most on two processes.
#   scripts/identify.sh [DIR] [OPTION...]    results go to DIR (default build/identify);
#                                            options as of scripts/identify/engine.py
# The same command continues a search that was stopped.
set -euo pipefail
out=build/identify
if [ $# -gt 0 ] && [ "${1#-}" = "$1" ]; then
  out=$1
  shift
fi
export HPCWHIRL_EXTRAS=${HPCWHIRL_EXTRAS:-identify}
# shellcheck source=scripts/environment.sh
. "$(dirname "${BASH_SOURCE[0]}")/environment.sh"
export HPCWHIRL_MPIRUN=$MPIRUN
cd "$HPCWHIRL_ROOT"
mkdir -p "$out"

lap=$SECONDS
python scripts/identify/rotor.py | tee "$out/rotor.txt"
echo "identify: the bladed disk took $((SECONDS - lap)) s"
lap=$SECONDS
python scripts/identify/engine.py --out "$out" --workers 2 "$@"
echo "identify: the engine took $((SECONDS - lap)) s, everything $SECONDS s"
