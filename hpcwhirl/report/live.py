"""A page that follows a campaign while it runs, by a server on this machine alone.

The server listens on the loopback address and answers two requests, whose paths begin
with a random word: other users of the machine cannot guess them. The page asks for its
state and is loaded anew when cases have ended; its address keeps case and filter. It is
made anew at most every `EVERY` seconds, and takes no more than a tenth of one core. The
server ends by itself when the campaign has, or when nobody asks for the page any more.
"""

from __future__ import annotations

import json
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

from hpcwhirl.campaign.progress import Progress, progress_of
from hpcwhirl.errors import InputError, cases_told
from hpcwhirl.report.page.build import live_page, waiting_page
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.reading.results_file import Results

HERE = "127.0.0.1"
EVERY = 2.0  # s between looks at the journals
SHARE = 0.1  # largest share of the time in which pages are made
GRACE = 10.0  # s that the server waits for a last request once the campaign has ended
QUIET = 600.0  # s without a request after which it ends


@dataclass(frozen=True)
class State:
    """What the page is told of the campaign.

    Attributes
    ----------
    version : number of the page, which increases with every new one
    text : line on the page, such as "8 of 22 cases have ended"
    over : whether the campaign has ended, so that nothing changes any more
    """

    version: int
    text: str
    over: bool


class Live(ThreadingHTTPServer):
    """The server of one campaign's page.

    Attributes
    ----------
    word : first part of all paths
    page, state : bytes of the page; what is told of the campaign
    asked : time of the last request, s, of `time.monotonic`
    is_told : whether the last page has been told that the campaign has ended
    """

    daemon_threads = True

    def __init__(self, port: int = 0) -> None:
        self.word = secrets.token_urlsafe(12)
        self.page, self.state = b"", State(0, "", over=False)
        self.asked, self.is_told = time.monotonic(), False
        try:
            super().__init__((HERE, port), Answer)
        except (OSError, OverflowError) as failed:
            msg = f"--live: port {port} of {HERE} cannot be used: {failed}"
            raise InputError(msg) from None

    @property
    def address(self) -> str:
        """Address of the page."""
        return f"http://{HERE}:{self.server_port}/{self.word}/"


class Answer(BaseHTTPRequestHandler):
    """Answers a request with the page or its state, and refuses all else."""

    server: Live

    def do_GET(self) -> None:
        """Answer one request."""
        if self.headers.get("Host") != f"{HERE}:{self.server.server_port}":
            self.send_error(403)  # a name that leads here, in a page from elsewhere
            return
        self.server.asked = time.monotonic()
        if self.path == f"/{self.server.word}/":
            self._send("text/html; charset=utf-8", self.server.page)
        elif self.path.partition("?")[0] == f"/{self.server.word}/state":
            state = self.server.state
            self._send("application/json", json.dumps(state.__dict__).encode())
            shown = self.path.endswith(f"?version={state.version}")
            self.server.is_told |= state.over and shown
        else:
            self.send_error(404)

    def _send(self, kind: str, body: bytes) -> None:
        self.send_response(200)
        heads = {"Content-Type": kind, "Content-Length": str(len(body)),
                 "Cache-Control": "no-store", "X-Content-Type-Options": "nosniff",
                 "Referrer-Policy": "no-referrer",
                 "X-Frame-Options": "DENY"}  # fmt: skip
        for name, value in heads.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Write no log."""


def serve(
    directory: Directory,
    gathered: Callable[[], None],
    begun: Callable[[str], None],
    port: int = 0,
) -> str:
    """Serve a campaign's page until the campaign has ended; return why it ended.

    Parameters
    ----------
    directory : the campaign
    gathered : gathers `results.h5` from the journals if cases have ended since
    begun : is called with the page's address when it can be opened
    port : port of the server, 0 for a free one

    Raises
    ------
    InputError
        for a port that cannot be used, or a directory without a campaign
    """
    found = progress_of(directory)
    with Live(port) as live:
        _renew(live, directory, gathered, found)
        Thread(target=live.serve_forever, args=(0.1,), daemon=True).start()
        try:
            begun(live.address)
            _follow(live, directory, gathered)
        finally:
            live.shutdown()
    if live.state.over:
        return live.state.text
    return f"nobody has asked for the page for {QUIET:g} s"


def _follow(live: Live, directory: Directory, gathered: Callable[[], None]) -> None:
    """Renew the page when cases have ended, until it is not needed any more."""
    live.asked, took, last = time.monotonic(), 0.0, time.monotonic()
    while not _is_needless(live, last):
        time.sleep(EVERY)
        found = progress_of(directory)
        now = time.monotonic()
        if live.state.over or now - last < took / SHARE:
            continue
        if _text(found) != live.state.text or _is_over(found):
            _renew(live, directory, gathered, found)
            last = time.monotonic()
            took = last - now


def _is_needless(live: Live, last: float) -> bool:
    """Return whether the server can end; last : time at which the page was made."""
    now = time.monotonic()
    if live.state.over and (live.is_told or now - live.asked > GRACE):
        return True
    return now - (last if live.state.over else live.asked) > QUIET


def _renew(
    live: Live, directory: Directory, gathered: Callable[[], None], found: Progress
) -> None:
    """Make the page of the cases that have ended so far.

    found : progress of the campaign, read before
    """
    text = _text(found)
    if found.done + found.failed:
        gathered()
    if directory.results.exists():
        with Results(directory.results) as results:
            page = live_page(results, live.state.version + 1, text)
    else:
        page = waiting_page(live.state.version + 1, text)
    live.page = page.encode()
    live.state = State(live.state.version + 1, text, over=_is_over(found))


def _is_over(found: Progress) -> bool:
    """Return whether a campaign has ended, or was stopped and nobody computes it."""
    at_it = any(not one.died for one in found.running)
    return not found.left or (bool(found.stopped) and not at_it)


def _text(found: Progress) -> str:
    ended = found.cases - found.left
    so_far = " wanted so far" if found.grows and found.left else ""
    text = f"{ended} of {cases_told(found.cases)}{so_far} have ended"
    return f"{text}; stopped: {found.stopped}" if found.stopped else text
