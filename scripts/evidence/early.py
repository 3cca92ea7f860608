"""Whether a case that ends early has the word of the same case integrated to its end.

    python scripts/evidence/early.py [FILE] [--count 150] [--seed 3] [--write]

Draws scenes of all features in turn (`KINDS`), each on one of three engines of 7 to 22
blades, with speed, gap, friction, force and pulse drawn and, for half of those without,
all terms of rotation, in `draft`, 0.4 s. Each is integrated in these ways, if rules
allow: as given (the certificate completes it in closed form), until "certain"
(as `--regimes-only` does), with plan "everything" (to the end, no certificate, no
fold), the same two plans with scheme `exact` (jumps), and until "decided", at most 1.6
s. What is integrated by `general` beside rotation, or has a layer, lasts a quarter, and
has no certificate: it is integrated as given and until "decided" only.

Laws: where the certificate ended a run, the whole run has the same contacts and last
contact, and the same word, or is still coming to rest and undecided; elsewhere every
word is the same; `exact` has no penetration in a jump and the same words in both plans;
a case decided late is, number for number, the case of that duration. Counted besides:
words other than undecided that the case has no more after four times as long. Rows go
to FILE (JSON lines, resumable; default a temporary file). Exits 1 where a law is
broken.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings, named_scene, preset_inputs
from hpcwhirl.scene.words import word_of

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import kept, parser_of, share, table, tell, working_folder
from cost.sizes import with_points
from evidence.preset_map import inputs_of

PAGE = Path(__file__).with_suffix(".md")
LASTS, LONGER = 0.4, 4  # s; times that
SLOW = "squeeze film", "plastic layer", "Archard's layer", "unlike supports"
FORM = "{0} of {1} ({3})"
ENGINES = ("four_motions", "mostly_damped", "rubbing")
Row = dict[str, Any]
Random = np.random.Generator
OVAL = "harmonic,amplitude,phase;{},{:.4g},{:.3g}"
FULL = {"rotation": "full"}


def _oval(random: Random, gap: float, most: float = 0.9) -> str:
    order, size = int(random.integers(2, 5)), random.uniform(0.2, most) * gap
    return OVAL.format(order, size, random.uniform(0.0, 6.0))


def _uneven(random: Random, blades: int) -> list[float]:
    return random.normal(0.0, 0.03, blades).tolist()


def _closing(random: Random, gap: float) -> Row:
    share = random.uniform(-1.0, 0.9)
    return {"gap_closure": share * gap, "gap_time": random.uniform(0.05, 0.5)}


# {feature: its inputs, drawn for a gap, m, and a number of blades}
KINDS: dict[str, Callable[[Random, float, int], Row]] = {
    "plain": lambda *_: {},
    "lobes": lambda r, *_: {"nodal_diameter": int(r.integers(2, 4))},
    "full rotation": lambda *_: FULL,
    "squeeze film": lambda r, *_: FULL | {
        "film_viscosity": 10 ** r.uniform(-3.0, -1.0), "film_clearance": 4e-4},
    "plastic layer": lambda *_: {"contact_law": "abradable"},
    "Archard's layer": lambda r, *_: {
        "contact_law": "archard", "wear_coefficient": 10 ** r.uniform(-13.0, -11.0)},
    "run-up or run-down": lambda r, *_: {
        "acceleration": r.uniform(-60.0, 60.0), "windows": 5},
    "closing gap": lambda r, gap, _: _closing(r, gap),
    "oval casing": lambda r, gap, _: {"profile": _oval(r, gap)},
    "oval that rises": lambda r, gap, _: {
        "profile": _oval(r, gap, 1.5), "profile_rise": r.uniform(0.02, 0.3)},
    "release": lambda r, gap, _: {
        "profile": _oval(r, gap), "profile_release": r.uniform(0.01, 0.3)},
    "oval that closes": lambda r, gap, _: _closing(r, 0.5 * gap) | {
        "profile": _oval(r, 0.5 * gap)},
    "eccentric rotor": lambda r, gap, _: {"offset": r.uniform(0.1, 0.9) * gap},
    "rigid casing": lambda r, gap, _: {
        "kind": "rigid", "profile": _oval(r, gap, 1.3), "profile_rise": 0.05},
    "rigid that grows": lambda r, gap, _: {
        "kind": "rigid", "amplitude": r.uniform(0.5, 1.3) * gap, "rise": 0.02},
    "mistuned": lambda r, _, n: {"mistuning": _uneven(r, n)},
    "mistuned, unbalanced": lambda r, _, n: FULL | {
        "mistuning": _uneven(r, n), "unbalance": 10 ** r.uniform(-4.0, -2.5)},
    "unbalanced": lambda r, *_: FULL | {"unbalance": 10 ** r.uniform(-4.0, -2.5)},
    "tilting disk": lambda r, *_: FULL | {
        "shaft": str(r.choice(["cantilever", "two bearings"])),
        "shaft_diameter": r.uniform(0.08, 0.15), "shaft_length": 0.6},
    "unlike supports": lambda r, *_: FULL | {
        "stiffness_difference": r.uniform(1e6, 1e7)},
    "cross-coupled": lambda r, *_: FULL | {"cross_coupling": r.uniform(-5e5, 5e5)},
    "Stribeck's friction": lambda *_: {"friction_law": "stribeck"},
    "energy at the start": lambda r, *_: {
        "force": 0.0, "start_energy": r.uniform(1.0, 20.0), "start_draw": 1.0},
    "three points a tip": lambda *_: {"points": 3},
    "shell": lambda *_: {"discretization": "shell", "casing.harmonics": 8},
}  # fmt: skip


def drawn(seed: int, index: int) -> Row:
    """Return a scene: its kind, engine and inputs."""
    random = np.random.default_rng([seed, index])
    kind = list(KINDS)[index % len(KINDS)]
    blades = int(random.integers(7, 23))
    gap = float(np.exp(random.uniform(np.log(8e-5), np.log(5e-4))))
    inputs: Row = {
        "blades": blades, "modes": 5 * blades, "gap": gap,
        "speed": random.uniform(40.0, 520.0), "friction": random.uniform(0.0, 0.2),
        "force": random.uniform(2e4, 1e5), "pulse": random.uniform(5e-4, 1e-3),
    }  # fmt: skip
    if random.random() < 0.5 and kind not in {"shell", "three points a tip"}:
        inputs |= FULL
    inputs |= KINDS[kind](random, gap, blades)
    if inputs.get("rotation") == "full":
        inputs["rotor.suspension_damping"] = 0.05
    if "shaft" in inputs:
        inputs["centre_stiffness"] = inputs_of_default("centre_stiffness")
    engine = ENGINES[int(random.integers(len(ENGINES)))]
    return {"seed": seed, "index": index, "kind": kind, "engine": engine,
            "inputs": inputs}  # fmt: skip


def inputs_of_default(name: str) -> float:
    """Return the default of an input of the rotor."""
    return float(getattr(Scene().engine.rotor, name))


def scene_of(row: Row, folder: Path) -> Scene:
    """Return the scene of a row, in `draft`."""
    own = dict(row["inputs"])
    points = own.pop("points", 0)
    draft = preset_inputs("draft") | {"truncation": 0.0, "traces": "orbit"}
    given = {**inputs_of(row["engine"]), **draft, "duration": LASTS, "interval": 1e-3}
    if row["kind"] in SLOW:
        given["duration"] = LASTS / 4
    scene = apply_settings(named_scene("table2"), given | own)
    return with_points(folder, scene, points) if points else scene


def tried(scene: Scene, **settings: Any) -> Row | None:
    """Return the row of a scene with settings; None: its rules do not allow them."""
    try:
        return dict(simulate(apply_settings(scene, settings)).row)
    except InputError:
        return None


def told(row: Row) -> str:
    """Return the word of a row of results."""
    return word_of("ok", str(row["outcome"]), str(row["regime"]))


def measured(row: Row, folder: Path) -> Row:
    """Return which laws are broken, and the words of all ways."""
    start = time.process_time()
    try:
        scene = scene_of(row, folder)
        given = dict(simulate(scene).row)
    except InputError as failed:
        return {"refused": str(failed)}
    longest = LONGER * scene.duration
    ways = {"given": given, "whole": given,
            "decided": tried(scene, until="decided", longest=longest)}  # fmt: skip
    if row["kind"] not in SLOW:
        ways["certain"] = tried(scene, until="certain", traces="summary")
        ways["whole"] = tried(scene, plan="everything")
        ways["exact"] = tried(scene, scheme="exact")
    if ways.get("exact"):
        ways["exact, whole"] = tried(scene, scheme="exact", plan="everything")
    found = {name: one for name, one in ways.items() if one is not None}
    broken = _broken(found)
    if "decided" in found:
        broken += _as_long(scene, found["decided"])
    late = given
    if told(given) != "undecided" and given["stop"] == "end":
        late = tried(scene, duration=longest) or given
    return {
        "words": {name: told(one) for name, one in found.items()},
        "stops": {name: one["stop"] for name, one in found.items()},
        "proved": given["certificate"], "contacts": given["contacts"],
        "late": told(late), "broken": broken,
        "seconds": time.process_time() - start,
    }  # fmt: skip


def _broken(found: dict[str, Row]) -> list[str]:
    """Return which laws two ways of a case break."""
    out, whole = [], found["whole"]
    for name, other in (("given", "whole"), ("certain", "whole"),
                        ("exact", "exact, whole")):  # fmt: skip
        if name not in found or other not in found:
            continue
        one, true = found[name], found[other]
        words = told(one), told(true)
        early = one["certificate"] >= 0.0
        resting = early and words == ("damped", "undecided")
        if words[0] != words[1] and not resting:
            out.append(f"{name}: {words[0]}, {other}: {words[1]}")
        if early and one["regime"] == "damped":
            out += [
                f"{name}: {number} {one[number]}, {true[number]}"
                for number in ("contacts", "last_contact")
                if not np.isclose(one[number], true[number], rtol=1e-9)
            ]
            if true["last_contact"] > one["certificate"]:
                out.append(f"{name}: proved at {one['certificate']}, touches again")
    out += [f"{name}: penetrates, gap error {one['gap_error']:.1e}"
            for name, one in found.items() if one["gap_error"] > 1e-9]  # fmt: skip
    numbers = {n for n, v in whole.items() if isinstance(v, float)}
    out += [f"{name}: {n} is not finite" for name, one in found.items()
            for n in numbers if not np.isfinite(one.get(n, 0.0))]  # fmt: skip
    return out


def _as_long(scene: Scene, row: Row) -> list[str]:
    """Return numbers in which a case decided late is not the case of that duration."""
    true = tried(scene, duration=row["duration"])
    if true is None:
        return [f"decided after {row['duration']} s, which is refused"]
    differ = [n for n in row if row[n] != true.get(n)]
    return [f"decided: other {', '.join(differ)}"] if differ else []


def tables(rows: list[Row]) -> str:
    """Return the tables of the page."""
    taken = [row for row in rows if "refused" not in row]
    lines = []
    for kind in KINDS:
        own = [row for row in taken if row["kind"] == kind]
        words = Counter(row["words"]["given"] for row in own)
        ended = sum(row["stops"].get("certain") == "certain" for row in own)
        later = sum(row["words"]["given"] == "undecided" for row in own)
        later -= sum(row["words"].get("decided", row["words"]["given"]) == "undecided"
                     for row in own)  # fmt: skip
        lines.append([
            kind, len(own), ", ".join(f"{n} {w}" for w, n in words.most_common()),
            ended, sum("exact" in row["words"] for row in own), later,
            sum(bool(row["broken"]) for row in own),
        ])  # fmt: skip
    held = [row for row in taken if row["words"]["given"] not in {"undecided"}]
    kept_word = sum(row["late"] == row["words"]["given"] for row in held)
    changed = Counter(f"{r['words']['given']} to {r['late']}" for r in held
                      if r["late"] != r["words"]["given"])  # fmt: skip
    early = [row for row in taken if row["stops"].get("certain") == "certain"]
    same = sum(r["words"]["certain"] == r["words"]["whole"] for r in early)
    told_changes = ", ".join(f"{n} {what}" for what, n in changed.items()) or "none"
    spent = sum(r["seconds"] for r in taken)
    proved = (
        f"- Of those that the certificate ended, {share(same, len(early), FORM)} have "
        "the word of the whole run; the others are undecided there, coming to rest."
    )
    lasting = (
        f"- Words other than undecided that hold {LONGER} times as long: "
        f"{share(kept_word, len(held), FORM)}; the others: {told_changes}."
    )
    head = ["feature", "scenes", "words", "ended early", "also by `exact`",
            "decided later", "laws broken"]  # fmt: skip
    refused = len(rows) - len(taken)
    return "\n".join([
        f"{len(taken)} scenes ({refused} refused), {spent:.0f} s of the processor.", "",
        proved, lasting, "", *table(head, lines), "",
        *(f"- BROKEN {r['kind']} (index {r['index']}): {'; '.join(r['broken'])}"
          for r in taken if r["broken"]),
    ])  # fmt: skip


def main() -> int:
    """Measure what is missing, print the tables, write the page if asked to."""
    parser = parser_of(__doc__, write=PAGE)
    parser.add_argument("file", nargs="?", type=Path)
    parser.add_argument("--count", type=int, default=150)
    parser.add_argument("--seed", type=int, default=3)
    args = parser.parse_args()
    with working_folder(None, "early") as folder:
        wanted = (drawn(args.seed, index) for index in range(args.count))
        rows = kept(args.file or folder / "early.jsonl", wanted,
                    lambda row: measured(row, folder), _said)  # fmt: skip
    tell(tables(rows), PAGE if args.write else None)
    return int(any(row.get("broken") for row in rows))


def _said(row: Row) -> None:
    print(row["index"], row["kind"], row.get("words", row.get("refused")),
          *row.get("broken", ()), file=sys.stderr, flush=True)  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
