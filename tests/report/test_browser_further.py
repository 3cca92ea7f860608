"""The page in a browser: its address, a map that stays, zoom, hover, sorting."""

import made_up
import numpy as np
import pytest
from test_browser import (  # noqa: F401 - fixtures
    chromium,
    click,
    data_of,
    enter,
    errors,
    find,
    made,
    opened,
    page,
    text_of,
    wait,
)

from hpcwhirl import campaign
from hpcwhirl.report.page.build import write_page
from hpcwhirl.store.directory.campaign_directory import Directory

pytestmark = [pytest.mark.browser, pytest.mark.slow]
LISTED = "return Array.from(document.querySelectorAll('#list-body tr[data-case]'),"
LISTED += " (r) => Number(r.dataset.case))"


def address_of(driver):
    return driver.execute_script("return decodeURIComponent(location.hash)")


def shown_at(driver, folder, address):
    driver.get("about:blank")
    path = write_page(Directory(folder))
    return opened(driver, f"{path}{address}")


def test_the_address_names_case_and_filter(page, made):  # noqa: F811
    click(page, 7)
    enter(page, "#filter", "speed > 320")
    enter(page, "#choose-x", "gap", "change")
    address = address_of(page)
    assert address == "#case=7&filter=speed > 320&x=gap&y=speed"
    again = shown_at(page, made, address.replace(" ", "%20"))
    assert data_of(again, "case") == "7"
    assert text_of(again, "#filter-note") == "8 of 12 cases"
    assert find(again, "#choose-x").get_attribute("value") == "gap"
    assert address_of(again) == address
    assert errors(again) == []


def test_back_returns_to_the_case_before(page):  # noqa: F811
    click(page, 7)
    click(page, 3)
    page.back()
    wait(page, lambda: data_of(page, "case") == "7")
    page.forward()
    wait(page, lambda: data_of(page, "case") == "3")


@pytest.mark.parametrize(
    ("address", "told"),
    [("#case=99", "case=99"), ("#case=", "case="), ("#colour=blue", "colour=blue"),
     ("#x=sped", "x=sped"), ("#%E0%A4%A", "%E0%A4%A"), ("#case=<b>", "case=<b>")],
)  # fmt: skip
def test_an_address_that_names_nothing_here_says_so(chromium, made, address, told):  # noqa: F811
    shown = shown_at(chromium, made, address)
    assert text_of(shown, "#address-note").endswith(f"not on this page: {told}.")
    assert len(shown.execute_script(LISTED)) == 12
    assert errors(shown) == []


def test_the_map_stays_in_sight_of_the_last_case_of_the_list(page):  # noqa: F811
    page.execute_script("scrollTo(0, document.documentElement.scrollHeight)")
    place = page.execute_script(
        "const r = document.getElementById('map').getBoundingClientRect();"
        "return [r.top, r.bottom, innerHeight, scrollY]"
    )
    top, bottom, height, scrolled = place
    assert scrolled > 100
    assert 0 <= top < bottom <= height


def test_a_column_sorts_the_list_and_its_csv(page, made):  # noqa: F811
    find(page, "[data-sort=gap]").click()
    gaps = np.array([1, 1, 2, 2] * 3)
    assert page.execute_script(LISTED) == np.argsort(gaps, kind="stable").tolist()
    find(page, "[data-sort=gap]").click()
    assert page.execute_script(LISTED)[0] == 11
    head = find(page, "th[aria-sort]")
    assert head.get_attribute("aria-sort") == "descending"
    assert address_of(page).endswith("sort=-gap")
    again = shown_at(page, made, "#sort=-gap")
    assert again.execute_script(LISTED)[0] == 11


def ends_of(driver, number):
    """Return the texts of the ticks across of a figure, as numbers."""
    return driver.execute_script(
        "return Array.from(document.querySelectorAll(`.figures > figure:nth-child(${"
        "arguments[0]}) [aria-label*='x-axis tick label'] text`), "
        "(t) => Number(t.textContent.replaceAll(',', '').replace('−', '-')))", number,
    )  # fmt: skip


@pytest.mark.parametrize("number", [1, 4])  # orbit, spectrum
def test_a_part_that_is_dragged_over_is_enlarged(page, number):  # noqa: F811
    from selenium.webdriver import ActionChains

    whole = ends_of(page, number)
    figure = find(page, f".figures > figure:nth-child({number})")
    svg = figure.find_element("css selector", "svg")
    page.execute_script("arguments[0].scrollIntoView({block: 'center'})", svg)
    (
        ActionChains(page)
        .move_to_element_with_offset(svg, -30, -20)
        .click_and_hold()
        .move_by_offset(60, 40)
        .release()
        .perform()
    )
    wait(page, lambda: float(figure.get_attribute("data-zoom") or 1) > 2)
    part = ends_of(page, number)
    assert max(part) - min(part) < 0.5 * (max(whole) - min(whole))
    figure.find_element("css selector", ".zoom button:last-child").click()
    assert ends_of(page, number) == whole
    plus = figure.find_element("css selector", ".zoom button")
    plus.send_keys(" ")
    assert float(figure.get_attribute("data-zoom")) == pytest.approx(2, rel=1e-3)
    assert errors(page) == []


@pytest.mark.parametrize(("number", "told"), [(1, "|Z| = "), (4, " Ω")])
def test_what_is_below_the_mouse_is_told(page, number, told):  # noqa: F811
    from selenium.webdriver import ActionChains

    svg = find(page, f".figures > figure:nth-child({number}) svg")
    page.execute_script("arguments[0].scrollIntoView({block: 'center'})", svg)
    selector = f".figures > figure:nth-child({number}) [aria-label=tip]"

    def seen():  # an orbit may be as wide as its figure
        for right in range(30, 150, 15):
            ActionChains(page).move_to_element_with_offset(svg, right, 0).perform()
            if told in find(page, selector).text:
                return True
        return False

    wait(page, seen)


def test_a_run_up_shows_its_speed_over_time_and_a_waterfall(chromium, tmp_path):  # noqa: F811
    document = {
        "scene": {"duration": 0.1, "speed": "3600 rpm", "force": "6 kN"},
        "solver": {"modes": 54},
        "engine": {"rotor": {"blades": 9}},
        "sweep": {"acceleration": [400.0, 800.0]},
        "output": {"interval": 5e-4},
    }
    place = tmp_path / "out"
    campaign(document, place)
    shown = opened(chromium, write_page(Directory(place)))
    click(shown, 1)
    titles = [h.text for h in shown.find_elements("css selector", "#case figure h4")]
    assert titles[:3] == [
        "Speed over time", "Waterfall, static frame", "Orbit, static frame"
    ]  # fmt: skip
    assert "Orbit, rotating frame" not in titles
    words = shown.find_elements("css selector", ".figures > :first-child rect")
    assert words
    assert shown.find_elements("css selector", ".figures > :nth-child(2) image")
    assert errors(shown) == []


def test_inputs_that_vary_together_are_one_axis(chromium, tmp_path):  # noqa: F811
    ramps = {"speed": [300, 400], "acceleration": [50.0, -50.0]}
    tables = {"zip": ramps, "sweep": {"gap": [1e-4, 2e-4, 3e-4]}}
    out = made_up.campaign(tmp_path / "out", tables, samples=50)
    page = opened(chromium, write_page(Directory(out)))  # noqa: F811
    chosen = [find(page, f"#choose-{n}").get_attribute("value")
              for n in ("x", "y", "across", "down")]  # fmt: skip
    assert chosen == ["speed", "gap", "", ""]
    assert len(page.find_elements("css selector", "#map rect[data-case]")) == 6
