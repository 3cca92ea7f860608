"""Progress lines of a campaign, on stderr; stdout is for the results of commands."""

import sys


def say(text: str) -> None:
    """Write a line of plain text on stderr, and flush it."""
    sys.stderr.write(f"hpcwhirl: {text}\n")
    sys.stderr.flush()
