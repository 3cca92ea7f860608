"""The bounds by which parts of a case are left out, and what its run made of them.

Each part that is left out is so by a bound on a number: `allowed` is its largest value,
`reached` what the case has. Estimates, of modes, of waves of the ring, of the terms
of rotation and of films at the stations of a shaft, are known before a run; the others
are checked after it, by its results.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from hpcwhirl.case.limits import (
    IN_FILM,
    PER_PERIOD,
    USUAL_OF_FILM,
    beat_of,
    film_error,
)
from hpcwhirl.case.profile import room_of
from hpcwhirl.case.resolve import Case
from hpcwhirl.case.rotation_choice import choice_of
from hpcwhirl.case.truncation import TO_ROTOR, left_out
from hpcwhirl.reduction.model import has_families

TOUCHDOWNS = 12  # touchdowns of a blade beyond which all sectors are integrated
ROUND_OFF = 1e-9  # of a share: a step may be chosen so that it is 1
MOST = 1e6  # largest share that is told: an estimate may be infinite
Row = Mapping[str, Any]


class Bound(NamedTuple):
    """The bound of a part that is left out.

    Attributes
    ----------
    part : what is left out: modes, waves, sectors, rotation, film (at the centre),
        films (at stations), samples, certificate
    of : the number that is bounded, and its unit
    allowed, reached : its largest value; that of the case, None if only a run tells it
    """

    part: str
    of: str
    allowed: float
    reached: float | None

    @property
    def share(self) -> float:
        """Reached over allowed; 0 if only a run tells it."""
        if not self.reached:
            return 0.0
        far = self.reached / self.allowed if self.allowed > 0.0 else MOST
        return 1.0 if abs(far - 1.0) < ROUND_OFF else min(far, MOST)

    @property
    def told(self) -> str:
        """The bound as a text."""
        known = "known after a run" if self.reached is None else f"{self.reached:.3g}"
        return f"{self.part}: {self.of}: {known}, at most {self.allowed:.3g}"


def bounds_of(case: Case, row: Row | None = None) -> list[Bound]:
    """Return the bounds of all parts that are left out of a case.

    row : results of the case; None: before its run
    """
    found = [*_modes(case), *_rotation(case), *_sectors(case, row)]
    found += [*_certificate(case, row), *_film(case, row), *_samples(case, row)]
    return found


def lean_checked(case: Case, row: Row) -> float:
    """Return the largest share that a case's run reached of its bounds; 0: none.

    row : results of the case
    """
    return max((bound.share for bound in bounds_of(case, row)), default=0.0)


def told_beyond(case: Case, row: Row) -> list[str]:
    """Return remarks on the bounds that a run exceeded, each with its part's name.

    The one on a squeeze film, with a remedy, is `limits.told_of_film`.

    row : results of the case
    """
    beyond = [b for b in bounds_of(case, row) if b.share > 1.0 and b.part != "film"]
    return [f"beyond the bound by which it was left out, {b.told}" for b in beyond]


def _modes(case: Case) -> Iterator[Bound]:
    """Yield the bounds of modes of the rotor and of waves of the ring."""
    scene = case.reduced
    asked = case.given.solver.truncation
    if asked == 0.0 or not has_families(scene):
        return
    missed = left_out(scene)
    of = "estimated relative error of motions"
    yield Bound("modes", f"{of}, of the rotor", TO_ROTOR * asked, missed.rotor)
    if scene.engine.casing.kind == "ring":
        yield Bound("waves", f"{of}, with those of the ring", asked, missed.error)


def _rotation(case: Case) -> Iterator[Bound]:
    """Yield the bound of the terms of rotation, if `auto` leaves them out."""
    if case.given.engine.rotation != "auto":
        return
    choice = choice_of(case.given)
    if choice.rotation == "none" and choice.change is not None:
        change = choice.change
        of = f"relative change of the free wave {change.wave} at this speed"
        yield Bound("rotation", of, choice.limit, change.share)


def _sectors(case: Case, row: Row | None) -> Iterator[Bound]:
    """Yield the bound of sectors that move alike, unless all were integrated."""
    if case.plan.folds == 1 or (row and row["folds"] == 1):
        return
    times = None if row is None else float(row["contacts"]) / case.model.blades
    yield Bound("sectors", "touchdowns of a blade", TOUCHDOWNS, times)


def _certificate(case: Case, row: Row | None) -> Iterator[Bound]:
    """Yield the bound of steps after a certificate, if it was or may be found."""
    if not case.plan.settles or (row and row["certificate"] < 0.0):
        return
    reach = None if row is None else float(row["certificate_reach"])
    of = "largest later displacement of tips and casing, m"
    yield Bound("certificate", of, room_of(case.scene), reach)


def _film(case: Case, row: Row | None) -> Iterator[Bound]:
    """Yield the bound of a squeeze film's error in time, at its eccentricity.

    A run does not tell the eccentricities of films at stations: theirs is `IN_FILM`.
    """
    rotor, solver = case.scene.engine.rotor, case.scene.solver
    asked = case.given.solver.accuracy or USUAL_OF_FILM
    if rotor.film_viscosity == 0.0:
        if late := film_error(case.model, solver.time_step, IN_FILM):
            of = f"estimated error in time / motion, at {IN_FILM:g} of the clearance"
            yield Bound("films", of, asked, late)
        return
    error = None
    if row is not None:
        far = float(row["centre_peak"]) / rotor.film_clearance
        error = film_error(case.model, solver.time_step, far)
    yield Bound("film", "error in time / the centre's motion", asked, error)


def _samples(case: Case, row: Row | None) -> Iterator[Bound]:
    """Yield the bound of time steps without a row of evidence, by the orbit's line."""
    beat = beat_of(case.model, case.scene)
    if beat == 1:
        return
    most = 2.0 * math.pi / (PER_PERIOD * beat * case.scene.solver.time_step)
    share = None
    if row is not None:
        line = abs(float(row["line_frequency"])) if row["whirl"] != "none" else 0.0
        share = line / most
    told = "strongest line of the centre / the highest that rows resolve"
    yield Bound("samples", told, 1.0, share)
