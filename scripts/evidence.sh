#!/usr/bin/env bash
# What the tests of scripts/test.sh are too short for: tests of the research scripts,
# whole attacks and crash points, and the pages of measurements.
#   scripts/evidence.sh                  list what there is, with its cost
#   scripts/evidence.sh NAME...          run these
#   scripts/evidence.sh --pages NAME...  run these and write their pages
#   scripts/evidence.sh [--pages] all    run everything; a failure does not end it
# Each run is noted in scripts/last_run.md.
# Runs in $HPCWHIRL_VENV (default .venv) with the extras of the tests.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# NAME | order of the processor's time | COMMAND | what --pages adds
table() {
  cat <<'END'
tests       | 40 min  | pytest --turn=all --processor=40               |
planted     | 2 hours | python scripts/evidence/planted.py             |
mutants     | 1 hour  | python scripts/evidence/mutants.py             | --write
extremes    | 3 min   | python scripts/extremes/decide.py              | --write
attacks     | 3 hours | python scripts/evidence/attack.py              | --write
crashes     | 20 min  | python scripts/evidence/crash_points.py        | --write
agreement   | 1 hour  | python scripts/evidence/agreement.py exact     |
rotors      | 3 min   | python scripts/evidence/rotors.py              | --write
bars        | minutes | python scripts/evidence/bars.py                |
estimates   | hours   | python scripts/evidence/estimates.py           | --write
words-hold  | hours   | python scripts/evidence/words_hold.py          | --write
words-full  | 20 min  | python scripts/evidence/words_hold.py --rotation full | --write
basins      | 10 min  | python scripts/evidence/basins.py              |
neighbours  | minutes | python scripts/evidence/neighbours.py          |
decided     | hours   | python scripts/evidence/words_hold.py --cells  | --write
motions     | 20 min  | python scripts/evidence/motions.py             | --write
early       | 10 min  | python scripts/evidence/early.py               | --write
claims      | hours   | python scripts/evidence/claims.py              | --write
foresight   | 1 hour  | python scripts/evidence/foresight.py           | --write
combinations | 10 min | python scripts/evidence/combinations.py       | --write
releases    | minutes | scripts/releases.sh --march                    |
lowest      | minutes | scripts/lowest.sh                              |
packages    | minutes | scripts/packaging/check.sh                     |
scale-cost  | 1 hour  | python scripts/evidence/scale_cost.py          | --write
million     | minutes | python scripts/evidence/million.py             |
END
}

fail() { echo "evidence: $*" >&2; exit 2; }

row_of() {  # NAME
  table | awk -F' *[|] *' -v name="$1" '$1 == name { found = 1; print $3 "|" $4 }
    END { exit !found }'
}

pages=no names=()
for word in "$@"; do
  case $word in
    --pages) pages=yes ;;
    all) mapfile -t names < <(table | cut -d' ' -f1) ;;
    -*) fail "unknown option $word (allowed: --pages)" ;;
    *) row_of "$word" >/dev/null || fail "unknown name $word; known: $(table | cut -d' ' -f1 | xargs)"
       names+=("$word") ;;
  esac
done
if [ "${#names[@]}" = 0 ]; then
  table
  exit 0
fi

export HPCWHIRL_EXTRAS=dev
# shellcheck source=scripts/environment.sh
. scripts/environment.sh
export HPCWHIRL_MPIRUN=$MPIRUN
failed=()
for name in "${names[@]}"; do
  IFS='|' read -r command more < <(row_of "$name")
  [ "$pages" = yes ] || more=
  read -ra words <<<"$command $more"
  echo "evidence: $name: ${words[*]}"
  TIMEFORMAT="evidence: $name took %U s and %S s of the processor, %R s of the clock"
  result=passed
  time "${words[@]}" || { result=FAILED; failed+=("$name"); }
  python scripts/last_run.py "$name" "$result${more:+, page written}"
done
[ "${#failed[@]}" = 0 ] || { echo "evidence: FAILED: ${failed[*]}" >&2; exit 1; }
