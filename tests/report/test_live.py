"""A page that follows its campaign: on this machine alone, and it ends by itself."""

import json
import socket
import subprocess
import sys
from http.client import HTTPConnection
from threading import Thread
from urllib.parse import urlsplit

import made_up
import pytest
from test_browser import chromium, click, data_of, errors, find, wait  # noqa: F401

from hpcwhirl.cli import main
from hpcwhirl.cli.so_far import gathered_so_far
from hpcwhirl.errors import InputError
from hpcwhirl.report import live
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.reader import rows_in

pytestmark = pytest.mark.turns

SWEEP = {"sweep": {"speed": [300, 350, 410, 500]}}


@pytest.fixture
def going(tmp_path):
    """Return a campaign without its last record and results, and a way to add it."""
    folder = made_up.campaign(tmp_path / "out", SWEEP, samples=500)
    (folder / "results.h5").unlink()
    (journal,) = (folder / "journal").iterdir()
    whole = journal.read_bytes()
    last = max(int(rows.starts.max()) for rows in rows_in(journal, {}))
    journal.write_bytes(whole[:last])

    def end():
        with journal.open("ab") as file:
            file.write(whole[last:])

    return folder, end


@pytest.fixture
def served(going, monkeypatch):
    """Return the address of its page, the thread that serves it, and `end`."""
    monkeypatch.setattr(live, "EVERY", 0.05)
    folder, end = going
    addresses, told = [], []

    def run():
        told.append(live.serve(
            Directory(folder), lambda: gathered_so_far(folder, quiet=True),
            addresses.append,
        ))  # fmt: skip

    thread = Thread(target=run, daemon=True)
    thread.start()
    while not addresses and thread.is_alive():
        thread.join(0.05)
    yield addresses[0], thread, end
    end()
    monkeypatch.setattr(live, "GRACE", 0.0)
    thread.join(60)
    assert told == ["4 of 4 cases have ended"]


def get(address, path="", host=None):
    """Return status and body of a request."""
    parts = urlsplit(address)
    line = HTTPConnection(parts.hostname, parts.port, timeout=30)
    line.request("GET", path if path.startswith("/") else parts.path + path,
                 headers={"Host": host or parts.netloc})  # fmt: skip
    answer = line.getresponse()
    body = answer.read().decode()
    line.close()
    return answer.status, body


def test_the_server_follows_the_journals_and_ends_with_the_campaign(served):
    address, thread, end = served
    assert urlsplit(address).hostname == "127.0.0.1"
    status, page = get(address)
    assert status == 200
    assert "3 of 4 cases have ended" in page
    assert json.loads(get(address, "state")[1])["version"] == 1
    assert thread.is_alive()
    end()
    while not (state := json.loads(get(address, "state")[1]))["over"]:
        assert thread.is_alive()
    assert state["version"] == 2
    thread.join(1)  # a page that shows less has not been told of the last one
    assert thread.is_alive()
    assert get(address)[1].count('data-version="2"') == 1
    get(address, "state?version=2")
    thread.join(60)
    assert not thread.is_alive()
    with pytest.raises(OSError, match="refused"):
        get(address)


def test_only_this_machine_and_who_knows_the_address_is_answered(served):
    address, *_ = served
    port = urlsplit(address).port
    for path in ("/", "/state", "/../etc/passwd", "/x" + urlsplit(address).path):
        assert get(address, path)[0] == 404
    assert get(address, host=f"evil.example:{port}")[0] == 403
    own = socket.gethostbyname(socket.gethostname())
    if not own.startswith("127."):
        with (
            pytest.raises(OSError, match="refused"),
            socket.create_connection((own, port), timeout=5),
        ):
            pass


def test_nobody_asks_and_the_server_ends(going, monkeypatch):
    monkeypatch.setattr(live, "EVERY", 0.05)
    monkeypatch.setattr(live, "QUIET", 0.2)
    folder, _ = going
    told = live.serve(Directory(folder), lambda: gathered_so_far(folder), str)
    assert told == "nobody has asked for the page for 0.2 s"


def test_a_campaign_without_a_case_has_a_page_that_waits(going, monkeypatch):
    monkeypatch.setattr(live, "EVERY", 0.05)
    monkeypatch.setattr(live, "QUIET", 0.2)
    folder, _ = going
    (journal,) = (folder / "journal").iterdir()
    journal.write_bytes(b"")
    pages = []
    live.serve(Directory(folder), lambda: None, lambda a: pages.append(get(a)[1]))
    assert "0 of 4 cases have ended" in pages[0]


def test_a_port_in_use_and_files_beside_are_refused_in_one_line(going, capsys):
    folder, _ = going
    with socket.create_server((live.HERE, 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["report", str(folder), "--live", str(port)]) == 2
    assert f"port {port} of 127.0.0.1 cannot be used" in capsys.readouterr().err
    with pytest.raises(InputError, match="70000"):
        live.Live(70000)
    assert main(["report", str(folder), "--live", "--out", "x.html"]) == 2
    assert "--live writes no file" in capsys.readouterr().err


def test_the_command_prints_the_address_and_ends(going):
    folder, end = going
    end()
    call = [sys.executable, "-m", "hpcwhirl", "report", str(folder), "--live"]
    with subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          text=True) as process:  # fmt: skip
        address = process.stdout.readline().strip()
        assert json.loads(get(address, "state?version=1")[1])["over"]
        assert process.wait(60) == 0
        assert "the server has ended: 4 of 4 cases" in process.stderr.read()


@pytest.mark.browser
@pytest.mark.slow
def test_the_page_in_a_browser_shows_what_has_ended_since(chromium, served):  # noqa: F811
    address, _, end = served
    chromium.get(address)
    wait(chromium, lambda: data_of(chromium, "drawn"))
    shown = "#map [data-case='3'][data-word=missing]"
    assert chromium.find_elements("css selector", shown)
    click(chromium, 1)
    end()
    wait(chromium, lambda: not chromium.find_elements("css selector", shown))
    wait(chromium, lambda: data_of(chromium, "case") == "1")
    wait(chromium, lambda: "4 of 4" in find(chromium, "#live").text)
    assert errors(chromium) == []
