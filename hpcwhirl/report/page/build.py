"""The page as one file with styles, scripts and data; it loads no other file.

Data from inputs enter the page in two ways only: as JSON without ``<``, which the
script inserts as text, and as base64. A content security policy in the head forbids
network access, and all scripts except those whose digests the policy lists.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
from importlib import resources
from pathlib import Path
from typing import Any

from hpcwhirl.errors import InputError
from hpcwhirl.report.page.data import PageData, page_data
from hpcwhirl.safe_open import open_regular
from hpcwhirl.store.atomic import sweep_idle, write_whole
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.reading.results_file import Results

LIBRARIES = ("vendor/d3.min.js", "vendor/plot.min.js")
SCRIPTS = ("expression", "data", "words", "axes", "story", "refined", "map", "charts",
           "case", "table", "main")  # fmt: skip
DIGEST = re.compile(rb'<meta name="hpcwhirl-results" content="([0-9a-f]{64})">')
HEAD_BYTES = 4096  # beginning of the page that contains the line with the digest


def write_page(directory: Directory, out: Path | None = None) -> Path:
    """Write the page of a finished campaign and return its path.

    out : the file to write; None: `report.html` in the directory
    """
    results = Results(directory.results)
    if not len(results):
        raise InputError(f"{results.path} has no cases: nothing to show")
    path = out or directory.page
    sweep_idle(path.parent, path.name)  # files left by a killed process
    write_whole(path, page_of(page_data(results)).encode(), held=True)
    return path


def is_stale(directory: Directory) -> bool:
    """Return whether a campaign's page exists but shows older results."""
    try:
        with open_regular(directory.page) as file:
            found = DIGEST.search(file.read(HEAD_BYTES))
    except OSError:
        return False
    with Results(directory.results) as results:
        return not found or found[1].decode() != results.digest()


def page_of(content: PageData) -> str:
    """Return the HTML text of a campaign's page from its data."""
    scripts = [_asset(name) for name in LIBRARIES]
    own = "\n".join(_asset(f"assets/{name}.js") for name in SCRIPTS)
    scripts.append(f'"use strict";\n(() => {{\n{own}\n}})();\n')
    parts = {
        "policy": _policy(scripts),
        "digest": content.facts["digest"],
        "title": html.escape(f"{content.facts['engine']}: hpcwhirl campaign"),
        "style": _asset("assets/page.css"),
        "facts": _json(content.facts),
        "columns": base64.b64encode(content.columns).decode(),
        "traces": "".join(base64.b64encode(r).decode() for r in content.records),
        "scripts": "".join(f"<script>{text}</script>\n" for text in scripts),
    }
    frame = _asset("assets/page.html")
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], frame)


def _asset(name: str) -> str:
    place = resources.files("hpcwhirl.report.page").joinpath(name)
    return place.read_text("utf-8")


def _json(facts: dict[str, Any]) -> str:
    """Return JSON that cannot end the HTML element around it."""
    return json.dumps(facts, allow_nan=False).replace("<", "\\u003c")


def _policy(scripts: list[str]) -> str:
    """Return the content security policy: these scripts, inline styles, no network."""
    hashes = (hashlib.sha256(text.encode()).digest() for text in scripts)
    allowed = " ".join(f"'sha256-{base64.b64encode(h).decode()}'" for h in hashes)
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
