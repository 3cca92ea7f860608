"""Laws of bearings whose coefficients depend on the frequency of the whirl.

Beside them stands the dynamic stiffness H(s) that a table is made of, which is solved
frequency by frequency, without branches.
"""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
import pytest
from shafts import SECTIONS_AND_DISK

from hpcwhirl.analysis.shaft_response import dynamic_stiffness, forces_of
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.shaft_whirl import held_by, whirl_matrices, whirls
from hpcwhirl.scene.documents import scene_of_document
from hpcwhirl.scene.shaft_tables import shaft_text, text_of
from hpcwhirl.scene.whirl_fit import WhirlFit, fitted
from hpcwhirl.structure.shaft import NODE, ShaftLine, line_of, row_between

FREQUENCIES = np.linspace(20.0, 1500.0, 20)  # rad/s
ANY = np.r_[np.geomspace(1e-2, 1e6, 400), FREQUENCIES]
PLANE = np.array([[1.0, 1.0], [-1j, 1j]])  # x, y of Y, X in Y e^{st} + conj(X e^{st})
ELLIPSE = np.array([[1.0, 1j], [1.0, -1j]]) / 2  # and back


def relaxing(stiff: float, more: float, rate: float, c: float = 2e3) -> Any:
    """Return H(s) of a spring and a damper beside a spring in series with a damper."""
    return lambda s: stiff + more * s / (s + rate) + c * s


def of_controller(s: Any) -> Any:
    """Return H(s) of a magnetic bearing whose controller differentiates."""
    return 4e7 * (1 + s * 3e-3) / (1 + s / 800.0) / (1 + s / 3e3) - 1e7


def seal(s: Any) -> Any:
    return 3e7 + 4e7 * s / (s + 300.0) + 8.0 * s**2 + 1e4 * s


def crossed(s: Any) -> Any:
    return 4e6 + 6e6 * 200.0 / (s + 200.0)


def none(s: Any) -> Any:
    return 0.0 * s


LAWS = {  # H_xx, H_xy = -H_yx, H_yy
    "relaxing": (relaxing(3e7, 5e7, 400.0), none, relaxing(3e7, 5e7, 400.0)),
    "seal": (seal, none, seal),
    "magnetic": (of_controller, none, of_controller),
    "crossed": (seal, crossed, seal),
    "apart": (relaxing(3e7, 5e7, 400.0), none, relaxing(6e7, 2e7, 900.0, 5e3)),
}


def matrix(law: str, s: complex) -> np.ndarray:
    """Return the dynamic stiffness, (2, 2), in x and y, of a law."""
    xx, xy, yy = (part(s) for part in LAWS[law])
    return np.array([[xx, xy], [-xy, yy]])


def columns(law: str, w: np.ndarray = FREQUENCIES) -> dict[str, list[float]]:
    """Return the table of a law, as a user writes it."""
    out = {"whirl_frequency": w.tolist()}
    each = np.array([matrix(law, 1j * one) for one in w])
    for i, a in enumerate("xy"):
        for j, b in enumerate("xy"):
            out[f"k{a}{b}"] = each[:, i, j].real.tolist()
            out[f"c{a}{b}"] = (each[:, i, j].imag / w).tolist()
    return out


def rows(law: str) -> list[tuple[float, ...]]:
    table = columns(law)
    order = ["xx", "xy", "yx", "yy"]
    names = [
        "whirl_frequency",
        *(f"k{ab}" for ab in order),
        *(f"c{ab}" for ab in order),
    ]
    return list(zip(*(table[name] for name in names), strict=True))


def stiffness(fit: WhirlFit, s: complex) -> np.ndarray:
    """Return the dynamic stiffness of a fit, (2, 2): its branches eliminated."""
    k, c = np.reshape(fit.rest, (2, 2, 2))
    out = k + s * c + s**2 * fit.mass * np.eye(2)
    for w_0, zeta, kappa, *coupling in fit.branches:
        a = np.reshape(coupling, (2, 2))
        below = kappa * (s**2 / w_0**2 + 2 * zeta * s / w_0 + 1)
        out = out + a - a @ a / below
    return out


@pytest.mark.parametrize("law", LAWS)
def test_a_fit_is_as_far_from_its_table_as_it_says_and_not_farther_than_asked(law):
    fit = fitted(rows(law), 0.0, 0.01)
    off = []
    for s in 1j * np.r_[FREQUENCIES, -FREQUENCIES]:
        wanted, forward = matrix(law, s), np.array([1.0, -1.0j])  # x, y of e^{s t}
        miss = stiffness(fit, s) - wanted
        if law == "apart":
            off += [np.abs(np.diag(miss) / np.diag(wanted)).max()]
        else:
            off += [np.linalg.norm(miss @ forward) / np.linalg.norm(wanted)]
    assert max(off) == pytest.approx(fit.error, rel=1e-6)
    assert fit.error <= 0.01
    assert 0 < len(fit.branches) <= 4


@pytest.mark.parametrize("law", ["relaxing", "seal", "apart"])
def test_a_fit_of_a_table_without_negative_damping_never_gives_energy(law):
    """In every whirl, at any frequency, also beyond the table; masses included."""
    fit = fitted(rows(law), 0.0, 0.01)
    assert fit.mass >= 0.0
    for w in ANY:
        given = stiffness(fit, 1j * w)
        lost = (given - given.conj().T) / 2j
        assert np.linalg.eigvalsh(lost).min() >= -1e-12 * abs(given).max()


def table(law: str, **changes: Any) -> dict[str, Any]:
    """Return a shaft on two bearings, and one over the whirl's frequency."""
    usual = {
        **SECTIONS_AND_DISK,
        "bearings": [
            {"station": 0, "kxx": 4e7, "cxx": 2e3},
            {"station": 1, **columns(law)},
            {"station": 3, "kxx": 3e7},
        ],
    }
    return usual | changes


AT = 1  # number of that bearing


@cache
def fitted_line(law: str) -> ShaftLine:
    return line_of(text_of(table(law), "line"))


@cache
def bare() -> ShaftLine:
    """Return the line without its bearing over the whirl's frequency."""
    held = table("seal")["bearings"]
    return line_of(text_of(table("seal", bearings=[held[0], held[2]]), "line"))


def direct(law: str, line: ShaftLine, s: complex, speed: float) -> np.ndarray:
    """Return the matrix of (Y, X), (2 n, 2 n), with H(s) itself at the bearing.

    Y and X are those of Z = Y e^{s t} + conj(X e^{s t}).
    """
    own = bare()
    held = whirl_matrices(own, held_by(own), speed)
    out = s**2 * held.mass + s * held.damping + held.stiffness
    each = ELLIPSE @ matrix(law, s) @ PLANE
    row = row_between(line.supports[AT].at, -1, own.size)
    return out + np.kron(each, np.outer(row, row))


@pytest.mark.parametrize("speed", [0.0, 400.0])
@pytest.mark.parametrize("law", LAWS)
def test_free_whirl_is_that_of_the_dynamic_stiffness_solved_by_iteration(law, speed):
    """Roots s of det(...) = 0, by Newton's iteration from those of the fit."""
    line = fitted_line(law)
    (fit,) = line.over_whirl
    asked = [w for w in whirls(line, held_by(line), speed)
             if 60.0 < w.frequency < 1400.0
             and abs(w.growth) < 0.3 * w.frequency]  # fmt: skip
    assert len(asked) >= 2
    for whirl in asked:
        s = whirl.root
        for _ in range(40):
            now = direct(law, line, s, speed)
            slope = (direct(law, line, s * (1 + 1e-6), speed) - now) / (1e-6 * s)
            step = -1 / np.trace(np.linalg.solve(now, slope))
            s = s + step
            if abs(step) < 1e-11 * abs(s):
                break
        assert abs(s - whirl.root) <= max(fit.error, 1e-9) * abs(s)


@pytest.mark.parametrize("law", LAWS)
def test_response_and_force_are_those_of_the_dynamic_stiffness(law):
    line = fitted_line(law)
    (fit,) = line.over_whirl
    n = bare().size
    own = [*range(n), *(line.size + np.arange(n))]
    for speed in FREQUENCIES[1::3]:
        load = np.zeros(2 * n)
        load[NODE * line.stations[2]] = speed**2
        held = held_by(line)
        whole, more = dynamic_stiffness(line, speed, held), np.zeros(2 * line.size)
        more[own] = load
        moved = np.linalg.solve(whole, more)
        exact = np.linalg.solve(direct(law, line, 1j * speed, speed), load)
        at = line.supports[AT].at
        whirl = exact[[at, n + at]]
        # a change of stiffness by e H moves by e H Z what a unit force there moves by 1
        unit = np.linalg.solve(direct(law, line, 1j * speed, speed),
                               np.eye(2 * n)[:, [at, n + at]])  # fmt: skip
        force = np.linalg.norm(matrix(law, 1j * speed)) * np.linalg.norm(whirl)
        allowed = 1.1 * fit.error * force * np.linalg.norm(unit, axis=1)
        assert (abs(moved[own] - exact) <= allowed + 1e-12 * abs(exact).max()).all()
        pair = np.stack([moved[: line.size], moved[line.size :].conj()])
        forces = forces_of(held, pair, speed)
        assert len(forces) == len(line.supports[:3]) + 1
        pushed = np.array(forces[AT])
        wanted = ELLIPSE @ matrix(law, 1j * speed) @ PLANE @ whirl
        assert np.linalg.norm(pushed - [wanted[0], wanted[1].conj()]) <= (
            1.2 * fit.error * force
            + np.linalg.norm(matrix(law, 1j * speed))
            * 1.5
            * np.linalg.norm(moved[own][[at, n + at]] - whirl)
        )


def saved_by_ross_3(bearing: dict[str, Any]) -> dict[str, Any]:
    """Return a rotor of ROSS 3 with a bearing, at node 0, and one of ROSS besides."""
    steel = {"name": "Steel", "rho": 7810.0, "E": 2.11e11, "G_s": 8.12e10}
    own = {"L": 0.25, "idl": 0.0, "odl": 0.05, "material": steel}
    usual = {"interpolation": "pchip", "radial_clearance": None, "speed": None}
    return {
        "ross_version": "3.1.0",
        "ShaftElement_a": own | {"n": 0, "tag": "a"},
        "BearingElement_s": usual | {"n": 0, "tag": "s"} | bearing,
        "BearingElement_b": usual | {"n": 1, "tag": "b", "kxx": [1e7], "cxx": [1e3]},
    }


def of_ross(law: str) -> dict[str, Any]:
    own = columns(law)
    own["frequency"] = own.pop("whirl_frequency")
    return own


def test_a_table_is_the_same_in_rows_in_a_file_and_as_ross_3_saves_it(tmp_path):
    own = columns("crossed")
    head = ["whirl_frequency [Hz]", *list(own)[1:]]
    first = (np.array(own.pop("whirl_frequency")) / 2 / np.pi).tolist()
    lines = [",".join(map(repr, row)) for row in zip(first, *own.values(), strict=True)]
    (tmp_path / "seal.csv").write_text("\n".join([",".join(head), *lines]))
    held = table("crossed")["bearings"]
    held[AT] = {"station": 1, "table": "seal.csv"}
    shaft = table("crossed", bearings=held)
    document = {"engine": {"rotation": "full", "shaft": shaft}}
    found = scene_of_document(document, folder=tmp_path).engine.rotor.shaft
    (fit,) = line_of(found).over_whirl
    expected = fitted_line("crossed").over_whirl[0]
    assert fit.error == pytest.approx(expected.error, rel=1e-3)
    assert (fit.support, fit.branches) == (expected.support, expected.branches)
    assert shaft_text(found) == found
    path = tmp_path / "rotor.json"
    path.write_text(json.dumps(saved_by_ross_3(of_ross("crossed"))))
    (other,) = line_of(shaft_text(str(path))).over_whirl
    assert (other.support, other.error) == (0, pytest.approx(fit.error, rel=1e-3))
    old = saved_by_ross_3(of_ross("crossed")) | {"ross_version": "2.3.0"}
    path.write_text(json.dumps(old))  # of ROSS 2, whose frequency is the speed
    assert line_of(shaft_text(str(path))).over_whirl == ()


NOISE = [1.0, 1.4, 0.9, 1.1, 0.8] * 4


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        (
            {
                "kxx": [
                    a * b for a, b in zip(columns("seal")["kxx"], NOISE, strict=True)
                ]
            },
            r"by 0\.\d+ of its dynamic stiffness, .*: at most whirl_tolerance = 0.01",
        ),
        ({"speed": FREQUENCIES.tolist()}, "has speed and whirl_frequency"),
        (
            {"kyx": NOISE},
            "its kxy, kyx, cxy, cyx must be constant over whirl_frequency",
        ),
        ({"cyy": [-9.0] * 20}, "its cxx, cyy must be >= 0 over whirl_frequency"),
        (
            {"whirl_frequency": FREQUENCIES[::-1].tolist()},
            "its whirl_frequency must be >= 0 rad/s and ascend",
        ),
        ({"whirl_tolerance": 0.0}, "whirl_tolerance must be > 0 and < 1, got 0"),
        ({"table": "none.csv"}, "bearing 1: none.csv: "),
    ],
)
def test_a_table_that_is_not_modelled_is_refused_in_one_line(tmp_path, changes, told):
    shaft = {key: changes[key] for key in ("whirl_tolerance",) if key in changes}
    own = {key: value for key, value in changes.items() if key not in shaft}
    held = [{"station": 0, **columns("seal"), **own}, {"station": 3, "kxx": 3e7}]
    document = {"engine": {"rotation": "full",
                           "shaft": table("seal", bearings=held, **shaft)}}  # fmt: skip
    with pytest.raises(InputError, match=told) as caught:
        scene_of_document(document, folder=tmp_path)
    assert len(str(caught.value).splitlines()) == 1
