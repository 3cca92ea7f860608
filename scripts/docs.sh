#!/usr/bin/env bash
# The documentation as a site that works offline: the manual's pages, which stay the one
# source, a page for each input, command and public name, the gallery of jobs/, and the
# pages of measurements. A dead link or anchor fails.
#   scripts/docs.sh [DIR]    into DIR (default: site); open DIR/index.html
# Runs in $HPCWHIRL_VENV (default .venv) with the extra `docs`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=${1:-site}
case $out in /*) ;; *) out=$PWD/$out ;; esac
if [ -e "$out" ] && [ ! -f "$out/index.html" ]; then  # it will be replaced
  echo "docs: $out is there but is no site" >&2
  exit 2
fi
venv=${HPCWHIRL_VENV:-$PWD/.venv}
if [ -x "$venv/bin/mkdocs" ]; then
  PATH=$venv/bin:$PATH
else
  export HPCWHIRL_EXTRAS=dev,docs
  # shellcheck source=scripts/environment.sh
  . scripts/environment.sh
fi

# The pages lie as in the repository, so that their links hold unchanged.
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
pages=$scratch/pages
mkdir "$pages"
git ls-files -z -- README.md LICENSE CITATION.cff .pictures jobs hpcwhirl/manual tests/dynamics \
  'scripts/*.md' 'scripts/*.py' | xargs -0 cp --parents -t "$pages"
python scripts/docs/reference.py "$pages"
NO_MKDOCS_2_WARNING=1 HPCWHIRL_PAGES=$pages mkdocs build --quiet --strict \
  --config-file scripts/docs/mkdocs.yml --site-dir "$scratch/site"
rm -rf "$out"
mv "$scratch/site" "$out"
echo "docs: $out/index.html"
