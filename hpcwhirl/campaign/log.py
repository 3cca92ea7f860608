"""Plain lines for who watches a campaign, on stderr: stdout is for what was asked."""

import sys


def say(text: str) -> None:
    """Write a plain line on stderr at once."""
    sys.stderr.write(f"hpcwhirl: {text}\n")
    sys.stderr.flush()
