"""`hpcwhirl manual`: show a page of the manual that is part of this package."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from difflib import get_close_matches
from functools import cache
from importlib import resources

from hpcwhirl.errors import InputError, one_line, unknown

ALIKE = 0.8  # least similarity of a misspelt name, from 0 to 1
SHORTEST = 3  # letters of a word that is looked for in titles
WIDE = 100  # characters in a line, beyond which text is hard to read


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl manual` on its parser."""
    parser.add_argument(
        "page", nargs="?", metavar="PAGE", help="name of a page (default: list pages)"
    )


def run(args: argparse.Namespace) -> int:
    """Print a page of the manual, or without a name the list of pages.

    If stdout is no terminal, the page is plain Markdown. Returns the exit code
    """
    if args.page is None:
        _list()
        return 0
    texts = pages()
    if args.page not in texts:
        raise _no_page(args.page, texts)
    _show(texts[args.page])
    return 0


def _no_page(word: str, texts: Mapping[str, str]) -> InputError:
    """Return the error for a page that does not exist.

    It names the page with a very similar name, else the pages whose title or purpose
    has the word, else the most similar name.

    word, texts : what was asked for; {name of a page: its text}
    """
    heads = {name: text.split("\n\n")[:2] for name, text in texts.items()}
    found = [n for n, head in heads.items() if word.lower() in " ".join(head).lower()]
    if get_close_matches(word, texts, 1, ALIKE) or len(word) < SHORTEST or not found:
        return unknown("page of the manual", word, texts)
    told = f"unknown page of the manual '{one_line(word)}'"
    return InputError(f"{told}; see {' or '.join(found)}")


@cache
def pages() -> dict[str, str]:
    """Return the manual: {name of a page: its text in Markdown}."""
    folder = resources.files("hpcwhirl").joinpath("manual")
    files = sorted(folder.iterdir(), key=lambda file: file.name)
    return {
        file.name.removesuffix(".md"): file.read_text("utf-8")
        for file in files
        if file.name.endswith(".md")
    }


def purpose(text: str) -> str:
    """Return the first paragraph of a page, which says what the page is for.

    text : text of the page in Markdown
    """
    return text.split("\n\n")[1].strip()


def _list() -> None:
    print("hpcwhirl manual PAGE shows one of:")
    wide = max(map(len, pages()))
    for name, text in pages().items():
        print(f"  {name:{wide}}  {purpose(text)}")


def _show(text: str) -> None:
    if not sys.stdout.isatty():
        print(text, end="")
        return
    from rich.console import Console
    from rich.markdown import Markdown

    console = Console()
    console.width = min(console.width, WIDE)
    console.print(Markdown(text, hyperlinks=False))
