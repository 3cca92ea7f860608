"""The paper's statements, each judged from stored results; nothing is decided by hand."""

from __future__ import annotations

from collections import Counter
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from paper_text import Number, Statement, judged, table
from scipy.stats import spearmanr

from hpcwhirl.analysis.cascade import after_revolutions
from hpcwhirl.analysis.closure import growth_of_diameter
from hpcwhirl.analysis.critical import critical_speeds
from hpcwhirl.analysis.participation import family_amplitudes
from hpcwhirl.analysis.spectrum import amplitude_spectrum, strongest
from hpcwhirl.reduction.families import first_family, modal_table
from hpcwhirl.reduction.model import model_of, rotor_model
from hpcwhirl.report.shapes import frequencies, full_rotor
from hpcwhirl.report.sweeps import frequency_spectra, rotating
from hpcwhirl.store.cases import Cases
from hpcwhirl.structure import blade_stiffness

PAPER_SPEEDS = (270.0, 410.0, 420.0, 520.0)  # rad/s, Figs. 9 to 14
BANDS = {"1F": (30, 60), "suspension": (85, 125), "2F": (220, 270)}  # Hz
EARLY = 0.02  # s: before contact makes neighbours part
Row = dict[str, Any]


class Found:
    """The campaigns by name, and what several statements read from them."""

    def __init__(self, cases: dict[str, Cases]) -> None:
        self.cases = cases
        self.amplitudes = lru_cache(maxsize=8)(self._amplitudes)

    def line(self, name: str, **inputs: Any) -> list[int]:
        """Return the finished cases of a campaign with such inputs, by speed."""
        cases = self.cases[name]
        same = [
            i for i, row in enumerate(cases.rows)
            if row["status"] == "ok"
            and all(cases.value(i, n) == v for n, v in inputs.items())
        ]  # fmt: skip
        return sorted(same, key=lambda i: float(cases.rows[i]["speed"]))

    def rows(self, name: str, **inputs: Any) -> list[Row]:
        """Return the rows of `line`."""
        return [self.cases[name].rows[i] for i in self.line(name, **inputs)]

    def at(self, speed: float) -> Row:
        """Return the row of a speed of the paper's figures."""
        return self.rows("motions", speed=speed)[0]

    def _amplitudes(self, speed: float) -> tuple[Any, dict[str, Any]]:
        """Return (time (n,), {family: |q_k| (n, 12)}) of a speed."""
        cases, (case,) = self.cases["motions"], self.line("motions", speed=speed)
        traces, row = cases.traces(case), cases.rows[case]
        centre = rotating(traces, row["speed"])
        model = model_of(cases.scene(case))
        q = family_amplitudes(traces["tips"], centre, row["sample_interval"], model)
        return traces["time"], q

    def rms(self, speed: float, family: str, start: float, end: float) -> Any:
        """Return rms of |q_k| between two times (s, or shares of a run < 0), (12,)."""
        time, q = self.amplitudes(speed)
        start, end = (-t * time[-1] if t < 0 else t for t in (start, end))
        part = (time > start) & (time <= end)
        return np.sqrt(np.mean(q[family][part] ** 2, axis=0)) if part.any() else q[family][0]

    def convergence(self, name: str, speed: float) -> list[Row]:
        """Return rows from coarse to finest with `value`, `early` and `late`.

        early : rms difference of the static orbit from the finest over the first 20 ms,
        relative; late : relative difference of the orbit's radius in the window
        """
        cases, key = self.cases[name], {"steps": "time_step", "modes": "modes"}[name]
        line = self.line(name, speed=speed)
        line.sort(key=lambda i: cases.rows[i][key], reverse=name == "steps")
        finest = cases.traces(line[-1])
        first = finest["time"] <= EARLY
        scale = np.sqrt(np.mean(finest["centre"][first] ** 2))
        out = []
        for i in line:
            row, own = cases.rows[i], cases.traces(i)["centre"][: first.sum()]
            early = np.sqrt(np.mean((own - finest["centre"][first]) ** 2)) / scale
            last = cases.rows[line[-1]]["orbit_radius"]
            late = abs(row["orbit_radius"] / last - 1) if last else 0.0
            out.append(row | {"value": row[key], "early": early, "late": late})
        return out

    @cached_property
    def spectra(self) -> dict[int, dict[str, Any]]:
        """Spectra of tip and centre of Table 1, by lobes."""
        cases = self.cases["table1"]
        lines = {k: self.line("table1", nodal_diameter=k) for k in (1, 2)}
        return {k: frequency_spectra(cases, line) for k, line in lines.items()}

    def level(self, k: int, place: str, low: float, high: float) -> Any:
        """Return the strongest amplitude of a band (Hz) at each speed of Table 1, m."""
        return np.array([strongest(*s, low, high)[1] for s in self.spectra[k][place]])

    def peak(self, k: int, place: str, low: float, high: float) -> float:
        """Return the median place of the strongest line of a band, Hz."""
        found = [strongest(*s, low, high)[0] for s in self.spectra[k][place]]
        return float(np.nanmedian(found))


def statements(found: Found) -> list[Statement]:
    """Return every statement, in the order of the paper."""
    return [
        *_modes(found), *_centre(found), *_convergence(found),
        *_table1(found), *_lines(found), *_two_lobes(found), *_regimes(found),
        *_speeds(found), *_damped(found), *_sustained(found), *_divergent(found),
        *_general(found),
    ]  # fmt: skip


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
            240.0, float(np.mean([own[k, "2F"] for k in range(12) if k != 1])), 0.02),
        "2F, k = 1, read off spectra": (250.0, own[1, "2F"], 0.02),
    }  # fmt: skip
    out = [
        Number("Fig. 4, 5, 6", name, paper, "Hz", tolerance).beside(here)
        for name, (paper, here, tolerance) in numbers.items()
    ]
    stiffness = Number("Sec. 2.1", "k_blade = 6.8e4 N/m", 6.8e4, "N/m", 0.01)
    return [*out, stiffness.beside(blade_stiffness(rotor))]


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
        Statement("Eq. 11", "the centre belongs to k = 1 alone",
                  f"centre of all other modes ≤ {leak:.1g} of the largest",
                  judged(leak < 1e-9)),
        Statement("Fig. 5", "a clamped centre changes the k = 1 frequencies alone",
                  f"1F–12F: others by ≤ {others:.1g}, k = 1 by ≥ {ones:.2g}, relative",
                  judged(others < 1e-9 < 1e-6 < ones)),
        Statement("Fig. 5a", "12 families up to 10 kHz",
                  f"12F reaches {twelfth:.3g} kHz", judged(twelfth <= 10.0)),
        Statement("Sec. 3.3", f"first five families within 0.75 % at η = {eta}",
                  f"largest difference {100 * off[0]:.2g} %, {off[1]}",
                  judged(off[0] <= 0.0075)),
    ]  # fmt: skip


def _family_error(full: dict[Any, float], reduced: dict[Any, float]) -> tuple[float, str]:
    """Return the largest relative difference of 1F to 5F, and where."""
    wanted = [key for key in full if key[1] in {f"{n}F" for n in range(1, 6)}]
    off = {key: abs(reduced[key] / full[key] - 1) for key in wanted}
    k, family = max(off, key=lambda key: off[key])
    return off[k, family], f"{family} k = {k}"


def _kinds(rows: list[Row]) -> list[str]:
    return [f"{row['regime']} {row['whirl']}" for row in rows]


def _convergence(found: Found) -> list[Statement]:
    out = []
    for name, text, value in (("steps", "Δt", 1e-6), ("modes", "η", 110)):
        tables = {s: found.convergence(name, s) for s in PAPER_SPEEDS}
        part = {s: [r for r in t if _finer(name, r["value"], value)] for s, t in tables.items()}
        if min(len(p) for p in part.values()) < 2:
            claim = f"converged at {text} = {value:g}"
            out.append(Statement("Sec. 3.3", claim, "too coarse a campaign", judged(None)))
            continue
        same = sum(len({*_kinds(p)}) == 1 for p in part.values())
        early = max(r["early"] for p in part.values() for r in p)
        late = max(r["late"] for p in part.values() for r in p)
        told = f"{same} of {len(part)} speeds keep one kind of motion"
        numbers = f"from the finest: first 20 ms {early:.2g}, late radius {late:.2g}"
        out.append(Statement("Sec. 3.3", f"kind of motion converged at {text} = {value:g}",
                             told, judged(same == len(part))))
        agrees = early < 0.01 if name == "steps" else max(early, late) > 0.01
        claim = "" if name == "steps" else "not perfectly "
        out.append(Statement("Sec. 3.3", f"displacements {claim}converged at {text} = "
                             f"{value:g} (1 %)", numbers, judged(agrees)))
    return out


def _finer(name: str, here: float, value: float) -> bool:
    return here <= 1.01 * value if name == "steps" else here >= value


def _only_damped(where: str, claim: str, rows: list[Row]) -> Statement:
    """Judge "damped only": a divergent or sustained run contradicts it."""
    count = Counter(row["regime"] for row in rows)
    told = ", ".join(f"{n} {regime}" for regime, n in count.most_common())
    against = count["divergent"] + count["sustained"]
    agrees = False if against else (True if count["damped"] == len(rows) else None)
    return Statement(where, claim, told, judged(agrees))


def _table1(found: Found) -> list[Statement]:
    return [
        _only_damped("Table 1", f"k = {k}: only damped motion",
                     found.rows("table1", nodal_diameter=k))
        for k in (1, 2)
    ]  # fmt: skip


def _lines(found: Found) -> list[Statement]:
    """Judge the lines of Fig. 6, k = 1."""
    tip, hub = ({n: found.level(1, p, *b) for n, b in BANDS.items()} for p in ("tip", "centre"))
    overall = {p: found.level(1, p, 5, 900) for p in ("tip", "centre")}
    high = np.median(found.level(1, "tip", 300, 900) / overall["tip"])
    ratio = np.median(overall["centre"] / overall["tip"])
    own = np.mean(hub["suspension"] >= 0.99 * overall["centre"])
    first = np.mean(tip["1F"] >= 0.99 * overall["tip"])
    floor = found.level(1, "centre", 230, 245)
    split = np.median(floor / found.level(1, "centre", 246, 265))
    return [
        Number("Fig. 6a", "tip: line of 1F at 45 Hz", 45, "Hz", 0.1).beside(
            found.peak(1, "tip", *BANDS["1F"])),
        Number("Fig. 6b", "centre: line of the suspension at 105 Hz", 105, "Hz", 0.05)
        .beside(found.peak(1, "centre", *BANDS["suspension"])),
        Number("Fig. 6b", "centre: line of 2F at 250 Hz", 250, "Hz", 0.03).beside(
            found.peak(1, "centre", *BANDS["2F"])),
        Statement("Fig. 6a", "the tip's strongest line is 1F",
                  f"at {100 * first:.0f} % of the speeds", judged(bool(first > 0.5))),
        Statement("Fig. 6b", "the centre's strongest line is the suspension",
                  f"at {100 * own:.0f} % of the speeds", judged(bool(own > 0.5))),
        Statement("Fig. 6", "the centre moves far less than the tips (a fifth)",
                  f"ratio of the strongest lines, median: {ratio:.2g}", judged(ratio < 0.2)),
        Statement("Fig. 6a", "no significant line above 300 Hz (a fiftieth)",
                  f"of the strongest, median: {high:.2g}", judged(high < 0.02)),
        Statement("Fig. 6b", "the centre has no line at 240 Hz",
                  f"230–245 Hz over 246–265 Hz, median: {split:.2g}", judged(split < 1)),
    ]  # fmt: skip


def _two_lobes(found: Found) -> list[Statement]:
    cases, line = found.cases["table1"], found.line("table1", nodal_diameter=2)
    rest = max(cases.rows[i]["centre_peak"] for i in line)
    apart, band = 0.0, np.array([])
    for case in line:
        traces, row = cases.traces(case), cases.rows[case]
        turns = traces["time"][-1] * abs(row["speed"]) / (2 * np.pi)
        late = after_revolutions(traces["time"], row["speed"], max(turns - 5, 0.0))
        tips = traces["tips"][late, :, 1]
        half = tips.shape[1] // 2
        apart = max(apart, float(np.abs(tips[:, 0] - tips[:, half]).max() / np.abs(tips).max()))
        hertz = amplitude_spectrum(tips[:, 0], row["sample_interval"])
        hub = strongest(*hertz, 95, 115)[1] / strongest(*hertz, 30, 60)[1]
        band = np.append(band, hub)
    first = np.mean(found.level(2, "tip", *BANDS["1F"]) >= 0.99 * found.level(2, "tip", 5, 900))
    return [
        Statement("Fig. 7", "k = 2: the centre stays at rest",
                  f"peak ≤ {rest:.1g} m", judged(rest < 1e-9)),
        Statement("Fig. 8", "k = 2: opposed blades show the same response",
                  f"difference ≤ {apart:.1g} of the largest", judged(apart < 1e-6)),
        Statement("Fig. 7", "k = 2: no response at 105 Hz",
                  f"95–115 Hz over 1F, median: {np.median(band):.2g}",
                  judged(bool(np.median(band) < 0.02))),
        Statement("Fig. 7", "k = 2: 1F predominant",
                  f"strongest at {100 * first:.0f} % of the speeds", judged(bool(first > 0.5))),
    ]  # fmt: skip


def _regimes(found: Found) -> list[Statement]:
    free = found.rows("table2", centre="free")
    kinds = Counter(_kinds(free))
    regimes = Counter(row["regime"] for row in free)
    wanted = ("damped", "sustained", "divergent")
    out = [Statement("Sec. 4.2", "three regimes: damped, sustained, divergent",
                     ", ".join(f"{n} {r}" for r, n in regimes.most_common()),
                     judged(all(regimes[r] for r in wanted)))]
    for regime in wanted:
        told = ", ".join(f"{n} {kind}" for kind, n in kinds.items() if regime in kind)
        both = kinds[f"{regime} forward"] and kinds[f"{regime} backward"]
        out.append(Statement("Sec. 4.2", f"{regime}: forward and backward both occur",
                             told or "no such motion", judged(bool(both))))
    clamped = found.rows("table2", centre="clamped")
    claim = "clamped centre: only damped motion"
    return [*out, _only_damped("Sec. 4.2.3", claim, clamped)]  # fmt: skip


def _speeds(found: Found) -> list[Statement]:
    """Judge regime and whirl at the paper's speeds."""
    paper = {
        520.0: ("Fig. 9b", "damped", "forward"), 410.0: ("Fig. 11b", "sustained", "forward"),
        270.0: ("Fig. 13a", "divergent", "backward"), 420.0: ("Fig. 13b", "divergent", "forward"),
    }  # fmt: skip
    out = []
    for speed, (where, regime, whirl) in paper.items():
        row = found.at(speed)
        told = f"{row['regime']}, ln amplitude grows by {row['growth_rate']:.2g} 1/s"
        agrees = None if row["regime"] == "undecided" else row["regime"] == regime
        out.append(Statement(where, f"{speed:g} rad/s: {regime}", told, judged(agrees)))
        told = f"{row['whirl']}, (P+ − P−)/(P+ + P−) = {row['whirl_ratio']:.2g}, strongest "
        told += f"line at {row['line_frequency']:.4g} rad/s, forward positive"
        out.append(Statement(where, f"{speed:g} rad/s: {whirl} (static frame)", told,
                             judged(row["whirl"] == whirl)))
    return out  # fmt: skip


def _dominates(q: Any, k: int) -> tuple[bool, str]:
    """Return whether nodal diameter k has the largest of (12,), and the three largest."""
    order = np.argsort(q)[::-1][:3]
    told = ", ".join(f"k = {i}: {q[i]:.2g}" for i in order)
    return bool(order[0] == k), told + " m √kg"


def _damped(found: Found) -> list[Statement]:
    early, late = found.rms(520.0, "1F", 0, 0.5), found.rms(520.0, "1F", 0.5, -1)
    (zero, told0), (one, told1) = _dominates(early, 0), _dominates(late, 1)
    share = (found.rms(520.0, "1F", -0.9, -1) / found.rms(520.0, "1F", 0, -0.1)).max()
    return [
        Statement("Fig. 10a", "520 rad/s: k = 0 of 1F governs before 0.5 s", told0, judged(zero)),
        Statement("Fig. 10a", "520 rad/s: k = 1 of 1F predominant after 0.5 s", told1, judged(one)),
        Statement("Fig. 10", "520 rad/s: all contributions damp out (to a tenth)",
                  f"last tenth over first, largest: {share:.2g}", judged(share < 0.1)),
    ]  # fmt: skip


def _sustained(found: Found) -> list[Statement]:
    row = found.at(410.0)
    radius = row["orbit_radius"] / row["gap"]
    settled = found.rms(410.0, "1F", 0.7, -0.6)[1] / found.rms(410.0, "1F", -0.6, -1)[1]
    late = found.rms(410.0, "1F", -0.6, -1)
    others = np.delete(late, 1).max() / late[1]
    zero, told = _dominates(found.rms(410.0, "1F", 0, 0.1), 0)
    steady = [r for r in found.rows("table2", centre="free") if r["regime"] == "sustained"]
    ratios = [r["orbit_radius"] / r["gap"] for r in steady]
    range_ = f"{min(ratios):.2g} to {max(ratios):.2g}" if ratios else "no such motion"
    near = bool(ratios) and 0.5 <= float(np.median(ratios)) <= 2
    return [
        Statement("Fig. 11", "sustained orbits: radius about the gap (half to double)",
                  f"radius over gap {range_}", judged(near if ratios else None)),
        Statement("Fig. 11b", "410 rad/s: radius about the gap (half to double)",
                  f"radius over gap {radius:.3g}", judged(0.5 <= radius <= 2)),
        Statement("Fig. 12", "410 rad/s: k = 1 of 1F stable after 0.7 s (20 %)",
                  f"rms 0.7 s to 60 % over that of the last 40 %: {settled:.2g}",
                  judged(bool(abs(settled - 1) < 0.2))),
        Statement("Fig. 12", "410 rad/s: all other k damp out (to a tenth of k = 1)",
                  f"largest other over k = 1: {others:.2g}", judged(bool(others < 0.1))),
        Statement("Fig. 12", "410 rad/s: k = 0 dominant in the transient (0.1 s)", told,
                  judged(zero)),
        Statement("Sec. 4.2.2", "the casing moves by microns", "the casing is not kept",
                  judged(None)),
        Statement("Sec. 4.2.2", "sustained motion lies near critical speeds",
                  "super-harmonics up to 9 lie too close to tell", judged(None)),
    ]  # fmt: skip


def _divergent(found: Found) -> list[Statement]:
    cases = found.cases["table2"]
    parts = modal_table(model_of(cases.scene(0)))
    speeds = critical_speeds(first_family(parts, "rotor"), first_family(parts, "casing"), 9)
    first, ninth = (
        float(next(s["speed"] for s in speeds if (s["nodal_diameter"], s["order"]) == (1, n)))
        for n in (1, 9)
    )
    slow, fast = found.at(270.0), found.at(420.0)
    ended = "amplitude" in {slow["stop"], fast["stop"]}
    ratio = fast["centre_peak"] / slow["centre_peak"]
    told = f"{ratio:.2g}" + (", but a run ended at the amplitude limit" if ended else "")
    one, text = _dominates(found.rms(420.0, "1F", -0.6, -1), 1)
    early, late = (found.rms(420.0, "suspension", *t)[1] for t in ((0, -0.3), (-0.6, -1)))
    return [
        Number("Eq. 13", "critical speed of k = 1: 270 rad/s", 270, "rad/s", 0.02).beside(first),
        Number("Sec. 4.2.3", "9th super-harmonic at 420 rad/s", 420, "rad/s", 0.02).beside(ninth),
        Statement("Fig. 13", "420 rad/s: about 4 times the amplitude of 270 (3 to 5)", told,
                  judged(None if ended and 3 <= ratio <= 5 else bool(3 <= ratio <= 5))),
        Statement("Fig. 14a", "420 rad/s: k = 1 of 1F dominant", text, judged(one)),
        Statement("Fig. 14c", "420 rad/s: suspension mainly in the divergent part",
                  f"rms of the last 40 % over the first 30 %: {late / early:.2g}",
                  judged(bool(late > early))),
    ]  # fmt: skip


def _general(found: Found) -> list[Statement]:
    against = []
    for row in found.rows("motions"):
        speed = row["speed"]
        late = {f: found.rms(speed, f, -0.6, -1) for f in ("1F", "2F", "suspension")}
        other = max(np.delete(late["1F"], 1).max(), late["2F"].max(), late["suspension"].max())
        if late["1F"][1] <= other:
            against.append(f"{speed:g} rad/s ({row['regime']}, "
                           f"{late['1F'][1] / other:.2g} of the largest other)")  # fmt: skip
    told = f"but for {', '.join(against)}" if against else "at all speeds with full traces"
    return [Statement("Sec. 4.2, 5", "k = 1 of 1F dominant in every regime's steady part",
                      told, judged(not against))]  # fmt: skip


def why(found: Found) -> list[str]:
    """Return the section on what feeds divergence, measured and by linear theory."""
    cases, line = found.cases["table2"], found.line("table2", centre="free")
    rows = []
    for case in line:
        scene, row = cases.scene(case), cases.rows[case]
        linear = growth_of_diameter(model_of(scene), 1, scene.speed, scene.friction)
        rows.append(row | linear)
    growing = [r for r in rows if r["regime"] == "divergent"]
    head = ("Ω, rad/s", "fed by friction, J", "by transport over the ring, J",
            "lost, J", "measured growth, 1/s", "all closed, 1/s", "all closed, below 150 Hz, 1/s",
            "at rad/s, static frame", "measured line")  # fmt: skip
    body = [
        (f"{r['speed']:g}", *(f"{r[n]:.3g}" for n in (
            "late_friction", "late_rotation", "late_lost", "growth_rate", "closed", "slow")),
         f"{r['slow_line'] + r['speed']:.0f}", f"{r['line_frequency']:.0f}")
        for r in growing
    ]  # fmt: skip
    return ["## Why it diverges", "", *table(head, body), "", *_verdict(rows, growing)]


def _verdict(rows: list[Row], growing: list[Row]) -> list[str]:
    """Say what feeds divergence, and what the linear check is worth, in numbers."""
    if not growing:
        return ["No case of Table 2 diverged."]
    shares = [r["late_friction"] / r["late_fed"] for r in growing]
    rest = [r for r in rows if r["regime"] in {"damped", "sustained"}]
    false = sum(r["slow"] > 0 for r in rest)
    missed = sum(r["slow"] <= 0 for r in growing)
    out = [
        f"Of what contact feeds into {len(growing)} divergent cases in their last 40 %, "
        f"friction is {100 * min(shares):.0f} to {100 * max(shares):.0f} %; the rest is the "
        "transport of contacts over the deformed ring.",
        "",
        "Linear check: all 22 tips held on the ring, sliding, nodal diameter 1. It predicts "
        f"growth for {len(growing) - missed} of {len(growing)} divergent cases and also for "
        f"{false} of {len(rest)} that are damped or sustained, at "
        f"{min(r['closed'] for r in rows):.0f} to {max(r['closed'] for r in rows):.0f} 1/s "
        "in its fastest root.",
    ]
    if len(growing) > 2:
        rank = spearmanr([r["slow"] for r in growing], [r["growth_rate"] for r in growing])
        ratio = np.median([r["slow"] / r["growth_rate"] for r in growing])
        out.append(
            f"Among the divergent, its rates below 150 Hz are {ratio:.2g} times the measured "
            f"(median) and follow them with rank correlation {rank.statistic:.2f}."
        )
    useful = false == 0 and missed == 0
    out.append(
        "It tells divergent from other cases." if useful else
        "It does not tell divergent from other cases."
    )  # fmt: skip
    return out
