"""Size of `hpcwhirl report`'s page, and the time it takes to write and to draw it.

    python scripts/cost/pages.py [--cases 2000,20000]

Rows are made up, orbits of 500 samples are zeros: a page keeps as many bytes of any.
Drawn: milliseconds until the first picture stands in headless Chromium, as the page
counts them since it was asked for (`data-drawn`): the first time, and the median of
five; renamed: after a moved threshold, median of five.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from evidence.synthetic import grid_of, synthetic

from hpcwhirl.report.page.build import write_page

SAMPLES = 500
TIMES = 5
FLAGS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
         "--window-size=1400,1400")  # fmt: skip
RENAME = """
const done = arguments[0], start = performance.now();
const value = document.getElementById('value-rise');
value.value = 0.2;
value.dispatchEvent(new Event('input', {bubbles: true}));
const wait = () => document.documentElement.dataset.changed === undefined
  ? requestAnimationFrame(wait) : done(performance.now() - start);
wait();
"""


def browser() -> Any:
    """Return a driver of Chromium."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    for flag in FLAGS:
        options.add_argument(flag)
    options.binary_location = shutil.which("chromium") or ""
    return webdriver.Chrome(options, Service(shutil.which("chromedriver") or ""))


def drawn(driver: Any, path: Path) -> tuple[float, float]:
    """Return (until drawn, until renamed), ms."""
    driver.get(f"file://{path}")
    while True:
        found = driver.execute_script("return document.documentElement.dataset.drawn")
        if found is not None:
            return float(found), float(driver.execute_async_script(RENAME))
        time.sleep(0.05)


def line(driver: Any, count: int) -> None:
    """Print one line of the table."""
    gaps = max(int((count / 5) ** 0.5), 1)
    speeds = np.linspace(200.0, 600.0, count // gaps).tolist()
    cases = grid_of(speed=speeds, gap=np.geomspace(5e-5, 1e-3, gaps).tolist())
    with tempfile.TemporaryDirectory(prefix="page-cost-") as place:
        folder = synthetic(Path(place) / "out", cases, samples=SAMPLES)
        begin = time.process_time()
        path = write_page(folder)
        spent = time.process_time() - begin
        times = np.array([drawn(driver, path) for _ in range(TIMES)])
        size = path.stat().st_size / 1e6
    first, (middle, again) = times[0, 0], np.median(times, axis=0)
    print(f"| {len(cases)} | {size:.2f} MB | {spent:.1f} s | {first:.0f} ms, "
          f"{middle:.0f} ms | {again:.0f} ms |", flush=True)  # fmt: skip


def main() -> int:
    """Write the pages, open them, print a line for each."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", default="2000,20000", metavar="N[,N]")
    args = parser.parse_args()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} before the run")
    print("| cases | report.html | CPU to write | drawn | renamed |")
    print("|---|---|---|---|---|")
    driver = browser()
    try:
        for count in map(int, args.cases.split(",")):
            line(driver, count)
    finally:
        driver.quit()
    return 0


if __name__ == "__main__":
    sys.exit(main())
