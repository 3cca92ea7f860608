"""The paper's statements, each judged from stored results, none by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
from paper.found import BANDS, PAPER_SPEEDS, Found, strongest
from paper.motions import kinds, motion_statements, only_damped
from paper.text import Statement, number, said
from paper.veering import frequencies, full_rotor

from hpcwhirl.analysis.whirl import after_revolutions, amplitude_spectrum
from hpcwhirl.reduction.bodies import rotor_model
from hpcwhirl.structure import blade_stiffness


def statements(found: Found) -> list[Statement]:
    """Return every statement, in the order of the paper."""
    parts = (_modes, _centre, _convergence, _table1, _lines, _two_lobes)
    return [s for part in parts for s in part(found)] + motion_statements(found)


def _modes(found: Found) -> list[Statement]:
    rotor = found.cases["table2"].scene(0).engine.rotor
    own = frequencies(full_rotor(rotor))
    numbers = {
        "1F, k = 0": (41.66, own[0, "1F"], 0.005),
        "1F, k = 1": (40.84, own[1, "1F"], 0.005),
        "1F, k = 3": (42.02, own[3, "1F"], 0.005),
        "1F, k = 4": (42.01, own[4, "1F"], 0.005),
        "suspension": (102.3, own[1, "suspension"], 0.005),
        "2F but for k = 1, read off spectra": (
            240.0,
            float(np.mean([own[k, "2F"] for k in range(12) if k != 1])),
            0.02,
        ),
        "2F, k = 1, read off spectra": (250.0, own[1, "2F"], 0.02),
    }
    out = [
        number("Fig. 4, 5, 6", name, paper, here, "Hz", tolerance)
        for name, (paper, here, tolerance) in numbers.items()
    ]
    stiffness = blade_stiffness(rotor)
    claim = "k_blade = 6.8e4 N/m"
    return [*out, number("Sec. 2.1", claim, 6.8e4, stiffness, "N/m", 0.01)]


def _centre(found: Found) -> list[Statement]:
    rotor = found.cases["table2"].scene(0).engine.rotor
    full = full_rotor(rotor)
    free, held = frequencies(full), frequencies(full_rotor(rotor, clamped=True))
    moved = {key: abs(held[key] / f - 1) for key, f in free.items() if key in held}
    low = {f"{n}F" for n in range(1, 13)}
    others = max(m for (k, n), m in moved.items() if k != 1 and n in low)
    ones = min(m for (k, n), m in moved.items() if k == 1 and n in low)
    hub = np.abs(full.shapes[-2:]).max(axis=0)
    leak = hub[full.diameter != 1].max() / hub.max()
    twelfth = max(f for (_, n), f in free.items() if n == "12F") / 1e3
    eta = found.cases["table2"].rows[0]["modes"]
    off = _family_error(free, frequencies(rotor_model(rotor, eta)))
    return [
        said("Eq. 11", "the centre belongs to k = 1 alone",
             f"centre of all other modes ≤ {leak:.1g} of the largest", leak < 1e-9),
        said("Fig. 5", "a clamped centre changes the k = 1 frequencies alone",
             f"1F–12F: others by ≤ {others:.1g}, k = 1 by ≥ {ones:.2g}, relative",
             others < 1e-9 and ones > 1e-6),
        said("Fig. 5a", "12 families up to 10 kHz", f"12F reaches {twelfth:.3g} kHz",
             twelfth <= 10.0),
        said("Sec. 3.3", f"first five families within 0.75 % at η = {eta}",
             f"largest difference {100 * off[0]:.2g} %, {off[1]}", off[0] <= 0.0075),
    ]  # fmt: skip


def _family_error(
    full: dict[Any, float], reduced: dict[Any, float]
) -> tuple[float, str]:
    """Return the largest relative difference of 1F to 5F, and where."""
    wanted = [key for key in full if key[1] in {f"{n}F" for n in range(1, 6)}]
    off = {key: abs(reduced[key] / full[key] - 1) for key in wanted}
    k, family = max(off, key=lambda key: off[key])
    return off[k, family], f"{family} k = {k}"


def _convergence(found: Found) -> list[Statement]:
    out = []
    for name, text, value in (("steps", "Δt", 1e-6), ("modes", "η", 110)):
        tables = {s: found.convergence(name, s) for s in PAPER_SPEEDS}
        part = {
            s: [r for r in t if _finer(name, r["value"], value)]
            for s, t in tables.items()
        }
        if min(len(p) for p in part.values()) < 2:
            claim = f"converged at {text} = {value:g}"
            out.append(said("Sec. 3.3", claim, "too coarse a campaign", None))
            continue
        same = sum(len({*kinds(p)}) == 1 for p in part.values())
        early = max(r["early"] for p in part.values() for r in p)
        late = max(r["late"] for p in part.values() for r in p)
        told = f"{same} of {len(part)} speeds keep one kind of motion"
        numbers = f"from the finest: first 20 ms {early:.2g}, late radius {late:.2g}"
        out.append(
            said(
                "Sec. 3.3",
                f"kind of motion converged at {text} = {value:g}",
                told,
                same == len(part),
            )
        )
        agrees = early < 0.01 if name == "steps" else max(early, late) > 0.01
        claim = "" if name == "steps" else "not perfectly "
        out.append(
            said(
                "Sec. 3.3",
                f"displacements {claim}converged at {text} = {value:g} (1 %)",
                numbers,
                agrees,
            )
        )
    return out


def _finer(name: str, here: float, value: float) -> bool:
    return here <= 1.01 * value if name == "steps" else here >= value


def _table1(found: Found) -> list[Statement]:
    return [
        only_damped(
            "Table 1",
            f"k = {k}: only damped motion",
            found.rows("table1", nodal_diameter=k),
        )
        for k in (1, 2)
    ]


def _lines(found: Found) -> list[Statement]:
    """Judge the lines of Fig. 6, k = 1."""
    tip, hub = (
        {n: found.level(1, p, *b) for n, b in BANDS.items()} for p in ("tip", "centre")
    )
    overall = {p: found.level(1, p, 5, 900) for p in ("tip", "centre")}
    high = np.median(found.level(1, "tip", 300, 900) / overall["tip"])
    ratio = np.median(overall["centre"] / overall["tip"])
    own = np.mean(hub["suspension"] >= 0.99 * overall["centre"])
    first = np.mean(tip["1F"] >= 0.99 * overall["tip"])
    floor = found.level(1, "centre", 230, 245)
    split = np.median(floor / found.level(1, "centre", 246, 265))
    return [
        number("Fig. 6a", "tip: line of 1F at 45 Hz", 45,
               found.peak(1, "tip", *BANDS["1F"]), "Hz", 0.1),
        number("Fig. 6b", "centre: line of the suspension at 105 Hz", 105,
               found.peak(1, "centre", *BANDS["suspension"]), "Hz", 0.05),
        number("Fig. 6b", "centre: line of 2F at 250 Hz", 250,
               found.peak(1, "centre", *BANDS["2F"]), "Hz", 0.03),
        said("Fig. 6a", "the tip's strongest line is 1F",
             f"at {100 * first:.0f} % of the speeds", bool(first > 0.5)),
        said("Fig. 6b", "the centre's strongest line is the suspension",
             f"at {100 * own:.0f} % of the speeds", bool(own > 0.5)),
        said("Fig. 6", "the centre moves far less than the tips (a fifth)",
             f"ratio of the strongest lines, median: {ratio:.2g}", ratio < 0.2),
        said("Fig. 6a", "no significant line above 300 Hz (a fiftieth)",
             f"of the strongest, median: {high:.2g}", high < 0.02),
        said("Fig. 6b", "the centre has no line at 240 Hz",
             f"230–245 Hz over 246–265 Hz, median: {split:.2g}", split < 1),
    ]  # fmt: skip


TWO_LOBES = (
    ("Fig. 7", "the centre stays at rest"),
    ("Fig. 8", "opposed blades show the same response"),
    ("Fig. 7", "no response at 105 Hz"),
    ("Fig. 7", "1F predominant"),
)


def _two_lobes(found: Found) -> list[Statement]:
    name = found.two_lobes
    cases, line = found.cases[name], found.line(name, nodal_diameter=2)
    line = [case for case in line if cases.rows[case]["contacts"] > 0]
    if not line:
        return [
            said(where, f"k = 2: {claim}", "no blade touches", None)
            for where, claim in TWO_LOBES
        ]
    gap = 1e3 * cases.rows[line[0]]["gap"]
    there = "" if name == "table1" else f"at 1 mm no blade touches; at {gap:g} mm: "
    rest = max(cases.rows[i]["centre_peak"] for i in line)
    apart, band = 0.0, np.array([])
    for case in line:
        traces, row = cases.traces(case), cases.rows[case]
        turns = traces["time"][-1] * abs(row["speed"]) / (2 * np.pi)
        late = after_revolutions(traces["time"], row["speed"], max(turns - 5, 0.0))
        tips = traces["tips"][late, :, 1]
        half = tips.shape[1] // 2
        apart = max(
            apart, float(np.abs(tips[:, 0] - tips[:, half]).max() / np.abs(tips).max())
        )
        hertz = amplitude_spectrum(tips[:, 0], row["sample_interval"])
        hub = strongest(*hertz, 95, 115)[1] / strongest(*hertz, 30, 60)[1]
        band = np.append(band, hub)
    first = np.mean(
        found.level(2, "tip", *BANDS["1F"]) >= 0.99 * found.level(2, "tip", 5, 900)
    )
    return [
        said("Fig. 7", "k = 2: the centre stays at rest", f"{there}peak ≤ {rest:.1g} m",
             rest < 1e-9),
        said("Fig. 8", "k = 2: opposed blades show the same response",
             f"{there}difference ≤ {apart:.1g} of the largest", apart < 1e-6),
        said("Fig. 7", "k = 2: no response at 105 Hz",
             f"{there}95–115 Hz over 1F, median: {np.median(band):.2g}",
             bool(np.median(band) < 0.02)),
        said("Fig. 7", "k = 2: 1F predominant",
             f"{there}strongest at {100 * first:.0f} % of the speeds",
             bool(first > 0.5)),
    ]  # fmt: skip
