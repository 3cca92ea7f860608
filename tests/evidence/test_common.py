"""What scripts share: rows that are kept, works in turn, shares, pages."""

import json

from common import TOP, in_turn, kept, share, table, tell, with_section


def test_rows_are_measured_once_and_stay_in_their_file(tmp_path):
    path, asked = tmp_path / "rows", []

    def measure(one):
        asked.append(one["index"])
        return {"square": one["index"] ** 2}

    wanted = [{"index": i, "engine": "one"} for i in range(4)]
    some = kept(path, wanted[:2], measure)
    assert kept(path, wanted, measure)[:2] == some
    assert asked == [0, 1, 2, 3]
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    assert rows == [one | {"square": i**2} for i, one in enumerate(wanted)]
    assert kept(path, wanted[2:3], measure) == rows[2:3]


def test_works_are_done_in_turn():
    order = []

    def work(name):
        order.append(name)
        return float(len(order))

    found = in_turn({n: (lambda n=n: work(n)) for n in "ab"}, 3)
    assert "".join(order) == "ababab"
    assert found == {"a": [1.0, 3.0, 5.0], "b": [2.0, 4.0, 6.0]}


def test_shares_and_tables_are_told_in_markdown():
    assert share(0, 0) == "none"
    assert share(5, 10).startswith("5 of 10: 50.0% (23.7% to 76.3%)")
    assert table(("a", "b"), [(1, "x")]) == ["| a | b |", "|---|---|", "| 1 | x |"]


def test_what_is_measured_takes_its_place_on_a_page(tmp_path, monkeypatch, capsys):
    page = tmp_path / "page.md"
    page.write_text("# A\n\nby hand\n\n## Measured\n\nbefore\n\n## B\n\nby hand\n")
    words = [TOP / "scripts/common.py", tmp_path, "--write", "two words"]
    monkeypatch.setattr("sys.argv", list(map(str, words)))
    tell("now", page)
    assert capsys.readouterr().out == "now\n"
    told = "python scripts/common.py FOLDER --write 'two words'"
    assert page.read_text() == (
        f"# A\n\nby hand\n\n## Measured\n\nMade by `{told}`.\n\nnow\n\n"
        "## B\n\nby hand\n"
    )


def test_a_section_takes_the_place_of_what_it_was():
    page = with_section("# Title\n\ntext", "## one, fast\n\na")
    page = with_section(page, "## one, default\n\nb\n")
    again = with_section(page, "## one, fast\n\nc\n")
    assert again == page.replace("\n\na\n", "\n\nc\n")
    assert again.startswith("# Title\n\ntext\n\n## one, fast")
    assert again.endswith("## one, default\n\nb\n")
