"""Why a statement of the paper does not agree, beside it; the statement stays as it is.

Reasons stand in reasons.toml; one is shown only where the verdict is another than
`agrees`.
"""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

from paper.text import VERDICTS, Statement

TABLE = Path(__file__).with_suffix(".toml")
REASONS: dict[str, str] = tomllib.loads(TABLE.read_text("utf-8"))


def with_reason(statement: Statement) -> Statement:
    """Return a statement with the reason for its miss, if it is one and is known."""
    reason = REASONS.get(statement.claim)
    if statement.verdict == VERDICTS[2] or reason is None:
        return statement
    return replace(statement, computed=f"{statement.computed}. Why: {reason}")
