"""The page in a real browser: clicked, moved, filtered, and read back."""

import csv
import json
import os
import shlex
import shutil
from collections import Counter
from dataclasses import asdict, replace

import made_up
import numpy as np
import pytest

from hpcwhirl import campaign, open_results
from hpcwhirl.analysis.regimes import Thresholds, name_regime
from hpcwhirl.cli import main
from hpcwhirl.cli.options import scene_of
from hpcwhirl.report.page.build import page_data, write_page
from hpcwhirl.scene import digest
from hpcwhirl.scene.quantities import ROW, STATUS
from hpcwhirl.scene.units import showing
from hpcwhirl.scene.words import REGIMES, word_of
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.reading.results_file import Results

pytestmark = [pytest.mark.browser, pytest.mark.slow]
EXPECTED = os.environ.get("HPCWHIRL_EXPECT_BROWSER") == "1"
FLAGS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
         "--window-size=1400,1400")  # fmt: skip
HURT = "<img src=x onerror='window.hurt=1'>"
SCRIPT = "</script><script>window.hurt=1</script>"
GRID = {"sweep": {"speed": [300, 350, 410], "gap": [1e-4, 2e-4], "friction": [0, 0.1]}}
WORDS = "return Array.from(document.querySelectorAll('[data-case]:is(rect, circle)'),"
WORDS += " (c) => [Number(c.dataset.case), c.dataset.word, c.dataset.whirl])"
SET = "const [e, v, kind] = arguments; e.value = v; "
SET += "e.dispatchEvent(new Event(kind, {bubbles: true}))"


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    """Return a driver of Chromium, whose downloads go to `downloads`."""
    programs = [shutil.which(name) for name in ("chromium", "chromedriver")]
    if not all(programs) and not EXPECTED:
        pytest.skip("no chromium and chromedriver: scripts/test.sh installs them")
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    for flag in FLAGS:
        options.add_argument(flag)
    options.binary_location = programs[0]
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(programs[1]))
    driver.downloads = tmp_path_factory.mktemp("downloads")
    there = {"behavior": "allow", "downloadPath": str(driver.downloads)}
    driver.execute_cdp_cmd("Browser.setDownloadBehavior", there)
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    place = tmp_path_factory.mktemp("made") / "out"
    return made_up.campaign(place, GRID, samples=500, messages={5: f"{HURT}{SCRIPT}"})


@pytest.fixture
def page(chromium, made):
    """Return the driver on a fresh page of `made`."""
    return opened(chromium, write_page(Directory(made)))


def opened(driver, path):
    driver.get(f"file://{path}")
    wait(driver, lambda: data_of(driver, "drawn"))
    return driver


def wait(driver, reached):
    from selenium.webdriver.support.ui import WebDriverWait

    return WebDriverWait(driver, 60).until(lambda _: reached())


def data_of(driver, name):
    ask = "return document.documentElement.dataset[arguments[0]] ?? null"
    return driver.execute_script(ask, name)


def find(driver, selector):
    return driver.find_element("css selector", selector)


def text_of(driver, selector):
    return find(driver, selector).text


def click(driver, case):
    """Click a cell where it is, as a mouse does."""
    from selenium.webdriver import ActionChains

    cell = find(driver, f"#map [data-case='{case}']")
    ActionChains(driver).move_to_element(cell).click().perform()


def enter(driver, selector, value, kind="input"):
    driver.execute_script(SET, find(driver, selector), str(value), kind)


def errors(driver):
    return [e["message"] for e in driver.get_log("browser") if e["level"] == "SEVERE"]


def cells(driver):
    """Return {case: (word, whirl)} of all cells."""
    return {case: (word, whirl) for case, word, whirl in driver.execute_script(WORDS)}


def rows(folder):
    """Return the cases' rows of numbers and words."""
    results = Results(folder)
    columns = {n: results[n] for n in (*STATUS, *ROW)}
    return [{n: c[i].item() for n, c in columns.items()} for i in range(len(results))]


def named(row, limits):
    """Return (word, whirl) of a row as the map shows it."""
    if row["status"] != "ok":
        return word_of(row["status"], "none", "none"), "none"
    outcome, regime, whirl = name_regime(row, limits)
    return word_of("ok", outcome, regime), whirl


def test_the_map_has_every_case_under_its_word(page, made):
    wanted = {i: named(row, Thresholds()) for i, row in enumerate(rows(made))}
    assert cells(page) == wanted
    counts = Counter(word for word, _ in wanted.values())
    buttons = page.find_elements("css selector", "#legend [data-word]")
    shown = {b.get_attribute("data-word"): int(b.text.split()[-1]) for b in buttons}
    assert shown == counts
    assert text_of(page, "#title") == "four_motions: 12 cases"
    assert errors(page) == []


def test_a_clicked_cell_shows_its_case(page, made):
    click(page, 7)
    assert data_of(page, "case") == "7"
    assert text_of(page, "#tip").startswith("case 7: ")
    assert "Case 7 · speed 350 rad/s · gap 0.2 mm · friction 0.1" in text_of(
        page, "#case h3"
    )
    titles = [h.text for h in page.find_elements("css selector", "#case figure h4")]
    assert titles == [
        "Orbit, static frame", "Orbit, rotating frame", "Radius of the centre, |Z|(t)",
        "Spectrum, static frame", "Energy of both bodies",
        "What feeds it, and what it loses",
    ]  # fmt: skip
    command = shlex.split(text_of(page, "#case .command code"))
    assert command[-4:] == ["--out", "case-7.h5", "--plot", "case-7"]
    assert digest(scene_of("table2", command[3:-4:2])) == Results(made).plan.digests[7]
    because = text_of(page, "#case .because")
    assert because.endswith(f"Hence: {rows(made)[7]['regime']}.")


def test_neighbouring_speeds_read_as_they_are(chromium, tmp_path):
    speeds = [12_345.6, 12_345.9, 12_346.2]
    folder = made_up.campaign(tmp_path / "out", {"sweep": {"speed": speeds}})
    page = opened(chromium, write_page(Directory(folder)))
    ticks = page.execute_script(
        "return Array.from(document.querySelectorAll('#map "
        '[aria-label="x-axis tick label"] text\'), (t) => t.textContent)'
    )
    assert [float(tick) for tick in ticks] == speeds
    for case, speed in enumerate(speeds):
        click(page, case)
        assert f"speed {speed} rad/s" in text_of(page, "#case h3")


def test_why_is_told_in_sentences_with_units(page, made):
    found = rows(made)
    for case, row in enumerate(found):
        if row["status"] != "ok" or row["outcome"] == "unstable":
            continue
        line = f"#list-body tr[data-case='{case}'] button"
        page.execute_script("arguments[0].click()", find(page, line))
        because = text_of(page, "#case .because")
        assert "NaN" not in because
        if row["certificate"] < 0 and row["late_contacts"]:
            verb = "took out" if row["late_fed"] < 0 else "put in"
            assert f"Rotation and friction {verb} " in because
            assert " J, damping and impacts took " in because
        if row["stop"] == "amplitude":
            assert (
                "Tips reached 10 % of the radius (amplitude_limit) at 0.1 s" in because
            )


def test_the_first_case_is_of_the_word_that_asks_for_a_look(page, made):
    first = rows(made)[int(data_of(page, "case"))]
    shown = {word for word, _ in cells(page).values()}
    order = ["divergent", "sustained", "undecided", "unstable", "damped"]
    assert first["regime"] == next(word for word in order if word in shown)


def test_powers_stand_on_a_logarithmic_axis(page):
    ticks = page.execute_script(
        "return Array.from(document.querySelectorAll('.figures > figure:nth-child(6) "
        '[aria-label*="y-axis tick label"] text\'), (t) => t.textContent)'
    )
    assert len(ticks) > 1
    assert all(float(t) == 10.0 ** round(np.log10(float(t))) for t in ticks)


@pytest.fixture(scope="module")
def refined(tmp_path_factory):
    """Return a campaign refined over speed and gap, which is logarithmic."""
    document = {
        "solver": {"preset": "draft"},
        "sweep": {"speed": [100, 200, 300, 400], "gap": [1e-4, 2e-4, 8e-4]},
        "refine": {"over": ["speed", "gap"], "levels": 3, "scale": {"gap": "log"}},
    }

    def field(given):
        chance = hash((given["speed"], given["gap"])) % 2  # of numbers: no seed
        if given["speed"] < 200:
            return "damped"
        if given["gap"] > 1.5e-4 and given["speed"] > 250:
            return "sustained" if chance else "undecided"
        return "divergent" if given["gap"] < 3e-6 * given["speed"] / 5 else "damped"

    place = tmp_path_factory.mktemp("refined") / "out"
    return made_up.refined_campaign(place, document, field)


def test_a_refined_map_is_filled_as_map_png_is(chromium, refined):
    page = opened(chromium, write_page(Directory(refined)))
    boxes = page.execute_script(
        "return Array.from(document.querySelectorAll('#map [aria-label=rect] rect'), "
        "(r) => ['x', 'y', 'width', 'height'].map((n) => Number(r.getAttribute(n))))"
    )
    x, y, width, height = np.array(boxes).T
    whole = (np.max(x + width) - x.min()) * (np.max(y + height) - y.min())
    assert (width * height).sum() == pytest.approx(whole, rel=1e-6)
    # gap is logarithmic: from 1e-4 to 2e-4 a third of the way to 8e-4
    ticks = page.execute_script(
        "return Array.from(document.querySelectorAll('#map [aria-label=rect] rect'), "
        "(r) => [r.dataset.case, Number(r.getAttribute('y')) + Number(r.getAttribute("
        "'height'))])"
    )
    lowest = max(bottom for _, bottom in ticks)
    gap = Results(refined)["gap"]
    own = [bottom for case, bottom in ticks if gap[int(case)] == 2e-4]
    above = (lowest - max(own)) / (lowest - y.min())
    assert 0.2 < above < 1 / 3
    boundary = page.find_elements("css selector", "#map [aria-label=link] path")
    assert len(boundary) > 3
    dots = page.find_elements("css selector", "#map [aria-label=text] text")
    assert [dot.text for dot in dots] == ["•"] * len(dots)
    assert len(dots) % 4 == 0
    assert dots
    assert cells(page).keys() <= set(range(len(gap)))
    enter(page, "#filter", "speed > 250")
    bright = "#map [aria-label=rect] rect:not(.faded)"
    kept = page.find_elements("css selector", bright)
    assert 0 < len(kept) < len(boxes)
    assert errors(page) == []


def test_folds_of_branches_are_a_table_below_the_map(chromium, tmp_path):
    sweep = {"sweep": {"speed": [300.0, 320.0, 340.0]}, "branch": {"over": "speed"}}
    folder = made_up.campaign(tmp_path / "out", sweep)
    page = opened(chromium, write_page(Directory(folder)))
    with Results(folder) as results:
        (table,) = page_data(results).facts["tables"]
    shown = page.execute_script(
        "const one = document.querySelector('#tables details'); one.open = true; "
        "return [one.querySelector('summary').innerText, Array.from("
        "one.querySelectorAll('tr'), (r) => Array.from(r.cells, (c) => c.innerText))]"
    )
    assert shown == [table["title"], [table["head"], *table["rows"]]]


def test_a_narrow_page_is_one_column_with_the_case_below_the_map(page):
    sizes = {"width": 500, "height": 1000, "deviceScaleFactor": 1, "mobile": False}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", sizes)
    try:
        ends = [find(page, f"#{name}").rect for name in ("map", "case", "list")]
        assert ends[0]["y"] + ends[0]["height"] <= ends[1]["y"]
        assert ends[1]["y"] + ends[1]["height"] <= ends[2]["y"]
        width = page.execute_script("return document.documentElement.scrollWidth")
        assert width <= 500
    finally:
        page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_what_a_preset_loses_is_one_line_until_asked(chromium, refined):
    page = opened(chromium, write_page(Directory(refined)))
    line = text_of(page, "#preset")
    assert line.startswith("preset draft: ")
    assert line.endswith("(more)")
    find(page, "#preset summary").click()
    assert len(text_of(page, "#preset")) > 2 * len(line)


def test_orbits_close_where_the_motion_does(page, made):
    """The centre turns backward at 2 Omega in the static frame, at 3 Omega on board."""
    for figure, turns in ((1, 2), (2, 3)):
        path = page.execute_script(
            "const lines = document.querySelectorAll(`.figures > figure:nth-child(${"
            "arguments[0]}) [aria-label=line] path`); return lines[lines.length - 1]"
            ".getAttribute('d')", figure,
        )  # fmt: skip
        points = np.array([p.split(",") for p in path[1:].split("L")], float)
        away = (points - (points.min(axis=0) + np.ptp(points, axis=0) / 2)) @ [1, 1j]
        assert np.ptp(np.abs(away)) < 0.02 * np.abs(away).mean()
        angle = np.unwrap(np.angle(away))
        caption = text_of(page, f".figures > :nth-child({figure}) figcaption")
        seconds = 1e-3 * float(caption.split()[1])
        row = rows(made)[int(data_of(page, "case"))]
        expected = turns * row["speed"] * seconds  # y of a screen points down
        assert abs(angle[-1] - angle[0] - expected) < 0.02 * expected


def test_a_moved_threshold_renames_as_classify_does(page, made):
    page.execute_script("document.getElementById('limits').open = true")
    for name, value in (("rise", 0.01), ("replaced", 0.2), ("ledger", 1e-9)):
        enter(page, f"#value-{name}", value)
    wait(page, lambda: data_of(page, "changed"))
    limits = replace(Thresholds(), rise=0.01, replaced=0.2, ledger=1e-9)
    found = rows(made)
    assert cells(page) == {i: named(row, limits) for i, row in enumerate(found)}
    moved = [named(r, limits) != named(r, Thresholds()) for r in found]
    assert any(moved)
    command = text_of(page, "#limits-note code")
    assert command == (
        "hpcwhirl classify DIR --set ledger=1e-9 --set rise=0.01 --set replaced=0.2"
    )
    find(page, "#limits-back").click()
    wait(page, lambda: data_of(page, "changed") == "0")
    assert cells(page) == {i: named(r, Thresholds()) for i, r in enumerate(found)}


def test_a_slider_moves_its_threshold(page):
    from selenium.webdriver import Keys

    page.execute_script("document.getElementById('limits').open = true")
    before = find(page, "#value-unclear").get_attribute("value")
    find(page, "#limit-unclear").send_keys(Keys.ARROW_RIGHT * 10)
    wait(page, lambda: data_of(page, "changed"))
    assert float(find(page, "#value-unclear").get_attribute("value")) > float(before)


def test_a_thousand_cases_are_named_as_python_names_them(chromium, tmp_path):
    speeds = [float(v) for v in range(100, 600)]
    folder = made_up.campaign(
        tmp_path / "out", {"sweep": {"speed": speeds, "gap": [1e-4, 2e-4]}}
    )
    page, found = opened(chromium, write_page(Directory(folder))), rows(folder)
    page.execute_script("document.getElementById('limits').open = true")
    random, words = np.random.default_rng(5), set()
    for _ in range(6):
        limits = Thresholds(**{
            name: float(f"{made_up.near(random, value):.6g}")
            for name, value in asdict(Thresholds()).items()
        })  # fmt: skip
        for name, value in asdict(limits).items():
            enter(page, f"#value-{name}", value)
        wanted = {i: named(row, limits) for i, row in enumerate(found)}
        wait(page, lambda wanted=wanted: cells(page) == wanted)
        words |= {word for word, _ in wanted.values()}
    assert words == {*REGIMES, "unstable", "overloaded"}


CONDITIONS = (
    "regime == sustained or regime == damped and not speed > 350",
    "300 < speed <= 410 and gap / 1e-4 != 2",
    "speed * 2 + 10 - 5 >= 705",
    "-growth_rate + 2 * 3 - 1 < (friction + 1) * 5",
    "status == 'failed' or word == unstable",
    "word not in (damped, undecided) and case in [1, 2, 3, 5]",
    "solver.time_step > 0 and gap == 2e-4",
    "gap > 0.15 mm and speed >= 3000 rpm",
    "force in (30 kN, 1e9) and pulse == 0.63 ms or duration == 1e-3",
    "orbit_radius > 1e-30 mm and message == ''",
    "gap > 0.15",
    "",
)
REFUSED = (
    "sped > 400", "divergent", "regime == damped or divergent", "speed", "word",
    "not damped", "regime == fast", "gap > 3 rpm", "gap > '0.1 mm'", "speed > 400 rmp",
)  # fmt: skip


@pytest.mark.parametrize("text", CONDITIONS)
def test_a_filter_keeps_what_cases_where_keeps(page, made, text, capsys):
    kept = list(range(12))
    if text:
        capsys.readouterr()
        assert main(["cases", str(made), "--where", text, "--json"]) == 0
        kept = [row["case"] for row in json.loads(capsys.readouterr().out)["cases"]]
    enter(page, "#filter", text)
    assert text_of(page, "#filter-note").startswith(f"{len(kept)} of" if text else "")
    bright = page.execute_script(
        "return Array.from(document.querySelectorAll('#map [data-case]:not(.faded)'),"
        " (c) => Number(c.dataset.case))"
    )
    assert sorted(bright) == kept


def test_a_filter_is_refused_as_cases_where_refuses_and_keeps_the_last(
    page, made, capsys
):
    enter(page, "#filter", "speed > 400")
    for text in REFUSED:
        enter(page, "#filter", text)
        assert main(["cases", str(made), "--where", text]) == 2
        told = capsys.readouterr().err.partition("; did you mean")[0]
        note = text_of(page, "#filter-note").partition("; known")[0]
        assert note in told
        assert note
        assert len(page.find_elements("css selector", "#map .faded")) == 8


def test_a_filter_that_selects_nothing_says_that_numbers_are_in_si(page):
    enter(page, "#filter", "gap > 0.15")
    told = "0 of 12 cases; plain numbers are in SI, here in m; with 0.15 mm it selects"
    assert text_of(page, "#filter-note") == f"{told} 6 cases"


def test_orbits_show_what_came_before_when_asked(page):
    def places():
        return int(text_of(page, "#case figcaption").split()[3])

    late = places()
    find(page, "#early").click()
    assert places() > 2 * late
    assert page.switch_to.active_element.get_attribute("id") == "early"
    find(page, "#after").click()
    assert find(page, "#early").is_selected()
    find(page, "#early").click()
    assert errors(page) == []


def test_arrow_keys_go_from_case_to_case_and_say_where(page):
    from selenium.webdriver import Keys

    click(page, 0)
    place = find(page, "#map")
    place.send_keys(Keys.ARROW_RIGHT)
    assert data_of(page, "case") == "4"
    place.send_keys(Keys.ARROW_UP)
    assert data_of(page, "case") == "6"
    place.send_keys(Keys.ARROW_RIGHT * 2)  # the second leads into the next panel
    assert data_of(page, "case") == "3"
    assert "speed 300 rad/s" in find(page, "#spoken").get_attribute("textContent")


def test_other_axes_show_every_case_or_say_what_is_left_out(page):
    enter(page, "#choose-across", "", "change")
    assert set(cells(page)) == {0, 2, 4, 6, 8, 10}
    assert "6 of 12 cases at friction = 0" in text_of(page, "#shown")
    enter(page, "#at-friction", "all", "change")
    assert set(cells(page)) == set(range(12))
    enter(page, "#choose-x", "gap", "change")
    assert "gap" in text_of(page, "#map")
    enter(page, "#choose-colour", "late_fed", "change")
    assert errors(page) == []


def test_every_control_has_a_name_and_the_document_a_language(page):
    for element in page.find_elements("css selector", "#limits-body, details"):
        page.execute_script("arguments[0].open = true", element)
    controls = page.find_elements("css selector", "button, input, select, summary")
    assert len(controls) > 20
    assert [
        c.get_attribute("outerHTML") for c in controls if not c.accessible_name
    ] == []
    assert find(page, "html").get_attribute("lang") == "en"
    pictures = page.find_elements(
        "css selector", "#case .figures > figure > :is(svg, figure)"
    )
    assert all(p.get_attribute("aria-label") for p in pictures)


def test_dark_and_light_follow_the_reader(page):
    looks = {}
    for scheme in ("dark", "light"):
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        looks[scheme] = [
            brightness(find(page, "body").value_of_css_property(name))
            for name in ("background-color", "color")
        ]
    (ground, ink), (paper, print_on_it) = looks["dark"], looks["light"]
    assert max(ground, print_on_it) < 60
    assert min(ink, paper) > 200


def brightness(colour):
    numbers = colour[colour.index("(") + 1 : -1].split(",")[:3]
    return sum(map(float, numbers)) / 3


def test_cases_saved_as_csv_are_those_of_the_file(page, made):
    enter(page, "#filter", "speed > 300")
    find(page, "#csv").click()
    path = page.downloads / "cases.csv"
    wait(page, lambda: path.is_file() and path.stat().st_size)
    with path.open(newline="", encoding="utf-8") as file:
        saved = list(csv.DictReader(file))
    found, data = rows(made), open_results(made)
    assert [int(s["case"]) for s in saved] == list(range(4, 12))
    for line in saved:
        row = found[int(line["case"])]
        assert line["regime"] == row["regime"]
        assert float(line["speed"]) == row["speed"]
        if row["status"] == "ok":
            assert float(line["late_lost"]) == row["late_lost"]
        assert line["message"] == row["message"]
    assert set(saved[0]) >= set(data.attrs["swept"].split())


def test_what_twins_doubt_is_pale_told_and_listed_and_units_are_practical(
    chromium, tmp_path
):
    """Of the twins of 350 rad/s half, and of 410 all are of another word."""

    def field(given):
        other = {350: given.get("twin", 0) % 2, 410: bool(given.get("twin"))}
        return "sustained" if other.get(given["speed"]) else "damped"

    document = {
        "sweep": {"speed": [300, 350, 410], "gap": [2e-4]},
        "twins": {"count": 4, "spread": {"force": 1e-6}, "sure": 0.9},
    }
    folder = made_up.refined_campaign(tmp_path / "out", document, field)
    page = opened(chromium, write_page(Directory(folder)))
    cells_ = page.find_elements("css selector", "#map rect[data-case]")
    pale = {int(c.get_attribute("data-case")) for c in cells_
            if "unsure" in c.get_attribute("class").split()}  # fmt: skip
    assert pale == {1, 2}
    assert "pale: fewer than 90 % of twins have its word, 2 cases" in text_of(
        page, "#legend"
    )
    find(page, "[data-list=unsure]").click()
    listed = page.find_elements("css selector", "#list-body tr[data-case]")
    order = [row.get_attribute("data-case") for row in listed]
    assert order == ["2", "1"]  # the surest last
    enter(page, "#filter", "gap > 1e-4")  # of metres
    assert text_of(page, "#filter-note") == "3 of 3 cases"
    assert main(["report", str(folder), "--units", "rpm,um"]) == 0
    page = opened(chromium, folder / "report.html")
    assert "Case 2 · speed 3915.21 rpm · gap 200 um" in text_of(page, "#case h3")
    assert errors(page) == []


@pytest.mark.parametrize("name", [HURT, f"</title>{SCRIPT}", "ab & 'c' \"d\""])
def test_markup_in_inputs_is_text(chromium, tmp_path, name):
    document = {
        "engine": {"name": name},
        "sweep": {"speed": [300, 410], "engine.rotor.mistuning": [[0.0] * 22]},
    }
    folder = made_up.campaign(
        tmp_path / "out", document, messages={1: f"{HURT}{SCRIPT}"}
    )
    page = opened(chromium, write_page(Directory(folder)))
    click(page, 1)
    assert page.execute_script("return window.hurt ?? null") is None
    assert page.find_elements("css selector", "img, iframe, object, embed") == []
    title = find(page, "#title").get_attribute("textContent")
    assert title == f"{name}: 2 cases"
    assert page.title.split() == f"{name}: hpcwhirl campaign".split()
    assert f"{HURT}{SCRIPT}" in [
        p.get_attribute("textContent") for p in page.find_elements("css selector", "p")
    ]
    assert errors(page) == []


def test_the_page_asks_the_network_for_nothing_and_may_not(page):
    loaded = page.execute_script(
        "return performance.getEntriesByType('resource').map((r) => r.name)"
    )
    assert loaded == []
    refused = page.execute_async_script(
        "const done = arguments[0]; document.addEventListener("
        "'securitypolicyviolation', (e) => done(e.effectiveDirective));"
        "fetch('http://127.0.0.1:9/').catch(() => 0)"
    )
    assert refused == "connect-src"
    assert errors(page)  # told, and gone from the log


def test_what_has_no_traces_or_no_result_says_so(chromium, tmp_path):
    folder = made_up.campaign(
        tmp_path / "out", {"sweep": {"speed": [1, 2]}}, messages={0: "a", 1: "b"}
    )
    page = opened(chromium, write_page(Directory(folder)))
    assert set(cells(page).values()) == {("failed", "none")}
    assert text_of(page, "#case .message") == "a"
    assert "No result" in text_of(page, "#case .note")
    assert errors(page) == []


@pytest.fixture(scope="module")
def turning(tmp_path_factory):
    """Return the page of a short campaign with full traces, whose wheels move."""
    place = tmp_path_factory.mktemp("turning") / "out"
    document = {
        "scene": {"duration": 0.03},
        "solver": {"modes": 54},
        "engine": {"rotor": {"blades": 9}},
        "output": {"traces": "full", "forces": "supports"},
        "sweep": {"speed": [380, 420]},
    }
    campaign(document, place)
    return write_page(Directory(place), animate=[1])


def frame_of(driver):
    return int(find(driver, ".motion").get_attribute("data-frame") or -1)


def moved(driver, past):
    wait(driver, lambda: frame_of(driver) != past)
    return frame_of(driver)


INK = "const c = document.querySelector('.motion canvas'); return c.getContext('2d')"
INK += ".getImageData(0, 0, c.width, c.height).data.filter((v, i) => i % 4 === 3 && v)"
INK += ".length"


def test_the_wheel_moves_until_it_is_stopped(chromium, turning):
    page = opened(chromium, turning)
    click(page, 1)
    moved(page, moved(page, -1))
    assert page.execute_script(INK) > 1000
    button = find(page, ".motion .play")
    button.send_keys(" ")
    assert button.text == "Play"
    held = frame_of(page)
    from selenium.webdriver.common.keys import Keys

    find(page, ".motion input[type=range]").send_keys(Keys.ARROW_RIGHT)
    assert frame_of(page) == held + 1
    click(page, 0)
    assert not page.find_elements("css selector", ".motion")
    assert "hpcwhirl report DIR --animate 0" in text_of(page, "#case")
    assert not errors(page)


BRIGHTNESS = "const c = document.querySelector('.motion canvas');"
BRIGHTNESS += "const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
BRIGHTNESS += (
    "let [sum, n] = [0, 0]; for (let i = 0; i < d.length; i += 4) if (d[i + 3])"
)
BRIGHTNESS += " { sum += d[i] + d[i + 1] + d[i + 2]; n += 1; } return sum / n / 765;"


def test_the_wheel_is_printed_in_the_colours_of_the_day(chromium, turning):
    """A canvas that was drawn by night is nearly invisible on paper."""
    emulate, night = "Emulation.setEmulatedMedia", [
        {"name": "prefers-color-scheme", "value": "dark"}]  # fmt: skip
    chromium.execute_cdp_cmd(emulate, {"features": night})
    try:
        page = opened(chromium, turning)
        click(page, 1)
        find(page, ".motion .play").click()
        by_night = page.execute_script(BRIGHTNESS)
        chromium.execute_cdp_cmd(emulate, {"features": night, "media": "print"})
        wait(page, lambda: page.execute_script(BRIGHTNESS) < 0.8 * by_night)
        assert not find(page, ".motion .controls").is_displayed()
    finally:
        chromium.execute_cdp_cmd(emulate, {"features": [], "media": ""})


def test_loads_of_supports_and_drive_are_drawn_with_their_peaks(chromium, turning):
    with Results(turning.parent) as results, showing(("N", "kN mm")):
        peak, torque = results["support_peak"][1], results["torque_peak"][1]
        page = opened(chromium, write_page(Directory(turning.parent)))
    click(page, 1)
    force, drive = page.find_elements("css selector", ".loads figcaption")
    assert float(force.text.split("N: centre ")[1]) == pytest.approx(peak, rel=1e-3)
    told = drive.text.rpartition("at most ")[2]
    assert told.endswith(" kN mm")
    assert float(told.split()[0]) == pytest.approx(torque, rel=1e-3)
    assert not errors(page)


def test_the_wheel_stands_still_for_who_prefers_that(chromium, turning):
    prefers = [{"name": "prefers-reduced-motion", "value": "reduce"}]
    chromium.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": prefers})
    try:
        page = opened(chromium, turning)
        click(page, 1)
        wait(page, lambda: frame_of(page) == 0)
        assert find(page, ".motion .play").text == "Play"
        assert page.execute_script(INK) > 1000
    finally:
        chromium.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_cases_whose_free_motion_grows_are_hatched(page, made):
    count = sum(row["free_growth"] > 0.0 for row in rows(made))
    assert count
    assert len(page.find_elements("css selector", "#map .growing")) == count
    assert "free motion grows without contact" in text_of(page, "#legend")
    assert len(cells(page)) == len(rows(made))
