"""Progress lines of a campaign, on stderr; stdout is for the results of commands."""

import sys


def say(text: str) -> None:
    """Write a plain line on stderr at once."""
    sys.stderr.write(f"hpcwhirl: {text}\n")
    sys.stderr.flush()
