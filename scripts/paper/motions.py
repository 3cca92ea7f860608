"""The paper's statements on regimes, whirl and modal contributions (Sec. 4.2)."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from paper.found import Found, Row
from paper.text import Statement, number, said

from hpcwhirl.analysis.rotation import critical_of
from hpcwhirl.case.resolve import resolve


def motion_statements(found: Found) -> list[Statement]:
    """Return the statements on Table 2, in the order of the paper."""
    parts = (_regimes, _speeds, _damped, _sustained, _divergent, _general)
    return [s for part in parts for s in part(found)]


def kinds(rows: list[Row]) -> list[str]:
    """Return regime and whirl of each row, as one text."""
    return [f"{row['regime']} {row['whirl']}" for row in rows]


def only_damped(where: str, claim: str, rows: list[Row]) -> Statement:
    """Judge "damped only": a divergent or sustained run contradicts it."""
    count = Counter(row["regime"] for row in rows)
    told = ", ".join(f"{n} {regime}" for regime, n in count.most_common())
    against = count["divergent"] + count["sustained"]
    agrees = False if against else (True if count["damped"] == len(rows) else None)
    return said(where, claim, told, agrees)


def _regimes(found: Found) -> list[Statement]:
    free = found.rows("table2", centre="free")
    both = Counter(kinds(free))
    regimes = Counter(row["regime"] for row in free)
    wanted = ("damped", "sustained", "divergent")
    out = [
        said("Sec. 4.2", "three regimes: damped, sustained, divergent",
             ", ".join(f"{n} {r}" for r, n in regimes.most_common()),
             all(regimes[r] for r in wanted))
    ]  # fmt: skip
    for regime in wanted:
        told = ", ".join(f"{n} {kind}" for kind, n in both.items() if regime in kind)
        found_both = both[f"{regime} forward"] and both[f"{regime} backward"]
        out.append(
            said(
                "Sec. 4.2",
                f"{regime}: forward and backward both occur",
                told or "no such motion",
                bool(found_both),
            )
        )
    clamped = found.rows("table2", centre="clamped")
    claim = "clamped centre: only damped motion"
    return [*out, only_damped("Sec. 4.2.3", claim, clamped)]


def _speeds(found: Found) -> list[Statement]:
    """Judge regime and whirl at the paper's speeds."""
    paper = {
        520.0: ("Fig. 9b", "damped", "forward"),
        410.0: ("Fig. 11b", "sustained", "forward"),
        270.0: ("Fig. 13a", "divergent", "backward"),
        420.0: ("Fig. 13b", "divergent", "forward"),
    }
    out = []
    for speed, (where, regime, whirl) in paper.items():
        row = found.at(speed)
        told = f"{row['regime']}, ln amplitude grows by {row['growth_rate']:.2g} 1/s"
        agrees = None if row["regime"] == "undecided" else row["regime"] == regime
        out.append(said(where, f"{speed:g} rad/s: {regime}", told, agrees))
        told = f"{row['whirl']}, (P+ − P−)/(P+ + P−) = {row['whirl_ratio']:.2g}, "
        told += f"strongest line {row['line_frequency']:.4g} rad/s, forward positive"
        out.append(
            said(
                where,
                f"{speed:g} rad/s: {whirl} (static frame)",
                told,
                row["whirl"] == whirl,
            )
        )
    return out


def _dominates(q: Any, k: int) -> tuple[bool, str]:
    """Return whether k has the largest of (12,), and the three largest."""
    order = np.argsort(q)[::-1][:3]
    told = ", ".join(f"k = {i}: {q[i]:.2g}" for i in order)
    return bool(order[0] == k), told + " m √kg"


def _damped(found: Found) -> list[Statement]:
    early, late = found.rms(520.0, "1F", 0, 0.5), found.rms(520.0, "1F", 0.5, -1)
    (zero, told0), (one, told1) = _dominates(early, 0), _dominates(late, 1)
    share = (found.rms(520.0, "1F", -0.9, -1) / found.rms(520.0, "1F", 0, -0.1)).max()
    return [
        said("Fig. 10a", "520 rad/s: k = 0 of 1F governs before 0.5 s", told0, zero),
        said("Fig. 10a", "520 rad/s: k = 1 of 1F predominant after 0.5 s", told1, one),
        said("Fig. 10", "520 rad/s: all contributions damp out (to a tenth)",
             f"last tenth over first, largest: {share:.2g}", share < 0.1),
    ]  # fmt: skip


def _sustained(found: Found) -> list[Statement]:
    row = found.at(410.0)
    radius = row["orbit_radius"] / row["gap"]
    settled = found.rms(410.0, "1F", 0.7, -0.6)[1] / found.rms(410.0, "1F", -0.6, -1)[1]
    late = found.rms(410.0, "1F", -0.6, -1)
    others = np.delete(late, 1).max() / late[1]
    zero, told = _dominates(found.rms(410.0, "1F", 0, 0.1), 0)
    steady = [
        r for r in found.rows("table2", centre="free") if r["regime"] == "sustained"
    ]
    ratios = [r["orbit_radius"] / r["gap"] for r in steady]
    range_ = f"{min(ratios):.2g} to {max(ratios):.2g}" if ratios else "no such motion"
    near = bool(ratios) and 0.5 <= float(np.median(ratios)) <= 2
    return [
        said("Fig. 11", "sustained orbits: radius about the gap (half to double)",
             f"radius over gap {range_}", near if ratios else None),
        said("Fig. 11b", "410 rad/s: radius about the gap (half to double)",
             f"radius over gap {radius:.3g}", 0.5 <= radius <= 2),
        said("Fig. 12", "410 rad/s: k = 1 of 1F stable after 0.7 s (20 %)",
             f"rms 0.7 s to 60 % over that of the last 40 %: {settled:.2g}",
             bool(abs(settled - 1) < 0.2)),
        said("Fig. 12", "410 rad/s: all other k damp out (to a tenth of k = 1)",
             f"largest other over k = 1: {others:.2g}", bool(others < 0.1)),
        said("Fig. 12", "410 rad/s: k = 0 dominant in the transient (0.1 s)", told,
             zero),
        said("Sec. 4.2.2", "410 rad/s: the casing moves by microns (up to 10)",
             f"late, in harmonics 2 and above: {1e6 * found.casing(410):.2g} µm",
             found.casing(410) < 1e-5),
        said("Sec. 4.2.2", "sustained motion lies near critical speeds",
             "super-harmonics up to 9 lie too close to tell", None),
    ]  # fmt: skip


def _divergent(found: Found) -> list[Statement]:
    cases = found.cases["table2"]
    speeds = {
        (s["nodal_diameter"], s["family"], s["order"]): float(s["speed"])
        for s in critical_of(resolve(cases.scene(0)), 9)
    }
    first, ninth = (speeds.get((1, "1F", n), np.nan) for n in (1, 9))
    slow, fast = found.at(270.0), found.at(420.0)
    ended = "amplitude" in {slow["stop"], fast["stop"]}
    ratio = fast["centre_peak"] / slow["centre_peak"]
    told = f"{ratio:.2g}" + (
        ", but a run ended at the amplitude limit" if ended else ""
    )
    one, text = _dominates(found.rms(420.0, "1F", -0.6, -1), 1)
    early, late = (
        found.rms(420.0, "suspension", *t)[1] for t in ((0, -0.3), (-0.6, -1))
    )
    return [
        number("Eq. 13", "critical speed of k = 1: 270 rad/s", 270, first, "rad/s",
               0.02),
        number("Sec. 4.2.3", "9th super-harmonic at 420 rad/s", 420, ninth, "rad/s",
               0.02),
        said("Fig. 13", "420 rad/s: about 4 times the amplitude of 270 (3 to 5)", told,
             None if ended and 3 <= ratio <= 5 else bool(3 <= ratio <= 5)),
        said("Fig. 14a", "420 rad/s: k = 1 of 1F dominant", text, one),
        said("Fig. 14c", "420 rad/s: suspension mainly in the divergent part",
             f"rms of the last 40 % over the first 30 %: {late / early:.2g}",
             bool(late > early)),
    ]  # fmt: skip


def _general(found: Found) -> list[Statement]:
    against = []
    for row in found.rows("motions"):
        speed = row["speed"]
        late = {f: found.rms(speed, f, -0.6, -1) for f in ("1F", "2F", "suspension")}
        other = max(
            np.delete(late["1F"], 1).max(), late["2F"].max(), late["suspension"].max()
        )
        if late["1F"][1] <= other:
            against.append(
                f"{speed:g} rad/s ({row['regime']}, "
                f"{late['1F'][1] / other:.2g} of the largest other)"
            )
    told = (
        f"but for {', '.join(against)}" if against else "at all speeds with full traces"
    )
    return [
        said("Sec. 4.2, 5", "k = 1 of 1F dominant in every regime's steady part", told,
             not against)
    ]  # fmt: skip
