"""Bars whose impacts are known in closed form, as rotors and casings of the product.

A rotor of N straight bars, one a blade, each of rod elements with its free end where
the tip is, meets a rigid casing or a second bar in the casing's place. Nothing here
integrates: `March` does, with the schemes that engines are marched with.

With c = sqrt(E / rho), Z = rho c A and T = 2 L / c, d'Alembert's waves answer them all.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.case.resolve import Case
from hpcwhirl.dynamics.march import March
from hpcwhirl.reduction.mistuned import modes_of
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import ModalModel, modal_model
from hpcwhirl.scene import Scene, apply_settings, named_scene
from hpcwhirl.structure import CyclicStructure, FourierOperator
from hpcwhirl.structure.elements import Section, beam

Floats = NDArray[np.float64]
Answer = Callable[[Floats], Floats]
SLOW_RISE = 2000.0  # times the run: (1 - cos x) / 2 is x^2 / 4 to 2e-7
END_MASS = math.sqrt(3.0) / 6.0  # of rho A h: what the end of rod elements weighs


@dataclass(frozen=True)
class Bar:
    """A bar of rod elements; its figures are those of Doyen, Ern and Piperno."""

    length: float = 10.0  # m
    area: float = 1.0  # m^2
    young: float = 900.0  # Pa
    density: float = 1.0  # kg/m^3
    elements: int = 100
    clamped: bool = False  # at the far end

    @property
    def wave_speed(self) -> float:
        """Return c, m/s."""
        return math.sqrt(self.young / self.density)

    @property
    def impedance(self) -> float:
        """Return Z = rho c A, N s/m."""
        return self.density * self.wave_speed * self.area

    @property
    def passage(self) -> float:
        """Return T = 2 L / c, s: there and back."""
        return 2.0 * self.length / self.wave_speed

    @property
    def mass(self) -> float:
        """Return rho A L, kg."""
        return self.density * self.area * self.length

    @property
    def end_mass(self) -> float:
        """Return 1 / (M^-1)_00 of many elements, kg: what stops at a first touch."""
        return END_MASS * self.mass / self.elements

    def matrices(self) -> tuple[Floats, Floats]:
        """Return (M, K) of the nodes from the free end on, kg and N/m."""
        thick = (self.area, self.area)
        section = Section(1.0, thick, self.young, self.density)
        parts = beam(self.length / self.elements, section)
        rod, nodes = np.ix_([0, 3], [0, 3]), self.elements + 1
        mass, stiffness = np.zeros((nodes, nodes)), np.zeros((nodes, nodes))
        for e in range(self.elements):
            for whole, part in zip((mass, stiffness), parts, strict=True):
                whole[e : e + 2, e : e + 2] += part[rod]
        last = nodes - self.clamped
        return mass[:last, :last], stiffness[:last, :last]


@dataclass(frozen=True)
class Slider:
    """What hangs on a bar's end across it, and feels friction: a mass on a spring."""

    mass: float = 4.0  # kg
    omega: float = 5.0  # rad/s

    def beside(self, matrices: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        """Return (M, K) with the tangential coordinate in the second place."""
        wide = np.arange(len(matrices[0])) + 1
        wide[0] = 0
        out = []
        for matrix, own in zip(matrices, (1.0, self.omega**2), strict=True):
            whole = np.zeros((len(matrix) + 1, len(matrix) + 1))
            whole[np.ix_(wide, wide)] = matrix
            whole[1, 1] = self.mass * own
            out.append(whole)
        return out[0], out[1]


def rotor_of_bars(bar: Bar, blades: int, slider: Slider) -> ModalModel:
    """Return N bars that know nothing of each other, as a bladed disk of N sectors."""
    mass, stiffness = slider.beside(bar.matrices())
    size, every = len(mass), np.eye(blades)
    structure = CyclicStructure(
        np.kron(every, mass), np.kron(every, stiffness), blades, size, (0, 1)
    )
    return modal_model(structure, 0.0, eta=blades * (size - 2))


@dataclass(frozen=True, eq=False, kw_only=True)
class BarEnd(FourierOperator):
    """A bar's end, where a ring's breathing harmonic is; a body force for lobes."""

    share: Floats  # (n,), of the bar's mass in each coordinate

    def waves(self) -> Floats:
        """Return rows (1, 2, n): the end is harmonic 0."""
        out = np.zeros((1, 2, len(self.share)))
        out[0, 0, 0] = 1.0
        return out

    def lobes(self, k: int) -> Floats:
        """Return loads (n,) of a unit force that accelerates all of the bar alike."""
        del k
        return self.share


def casing_of_bar(bar: Bar, slider: Slider) -> tuple[ModalModel, BarEnd]:
    """Return a free bar in the casing's place, and how the blades read its end."""
    mass, stiffness = slider.beside(bar.matrices())
    omega, shapes = modes_of(mass, stiffness)
    none = np.zeros(len(omega), dtype=np.int64)
    rigid = np.ones(len(mass))
    rigid[1] = 0.0
    model = ModalModel(
        mass=mass, stiffness=stiffness, shapes=shapes, omega=omega, diameter=none,
        rank=np.arange(len(omega)), phase=none, centre_share=np.zeros(len(omega)),
        damping=0.0, kept=0,
    )  # fmt: skip
    return model, BarEnd(0, 1.0, share=mass @ rigid / bar.mass)


@dataclass(frozen=True)
class Rig:
    """Bars, what they meet, and the exact answer; times in s from the start.

    Attributes
    ----------
    bar : of each blade
    settings : of the scene
    duration : s, of the run
    touch, release : when contact begins and ends, s
    arrival : velocity of the two ends against each other at first touch, m/s
    rebound : the same of the bars' centres of mass after release, m/s
    end : time -> displacement of a blade's end, m, outward
    force : time -> contact force of a blade, N
    impulse : time -> its cumulative impulse, N s
    wall_speed : of a rigid wall, or of a second bar, after release, m/s, outward
    casing : the second bar; None for a rigid wall
    """

    bar: Bar
    settings: dict[str, Any]
    duration: float
    touch: float
    release: float
    arrival: float
    rebound: float
    end: Answer
    force: Answer
    impulse: Answer
    wall_speed: float = 0.0
    casing: Bar | None = None

    @property
    def end_mass(self) -> float:
        """Return what stops at a first touch, kg: of both bodies' ends."""
        if self.casing is None:
            return self.bar.end_mass
        return 1.0 / (1.0 / self.bar.end_mass + 1.0 / self.casing.end_mass)

    def dragged(self, slider: Slider, friction: float, time: Floats) -> Floats:
        """Return the slider's displacement (n,), m, along the rotation.

        m y'' + m w^2 y = -mu F, with F linear in time during contact (`drop`,
        `two_bars`).
        """
        lasts, w = self.release - self.touch, slider.omega
        near = np.array([self.touch + 1e-9 * lasts, self.release - 1e-9 * lasts])
        first, last = self.force(near)
        slope, scale = (last - first) / lasts, -friction / (slider.mass * w**2)
        s = np.clip(time - self.touch, 0.0, lasts)
        place = first * (1 - np.cos(w * s)) + slope * (s - np.sin(w * s) / w)
        speed = first * w * np.sin(w * s) + slope * (1 - np.cos(w * s))
        free = w * np.maximum(time - self.release, 0.0)
        return np.asarray(scale * (place * np.cos(free) + speed / w * np.sin(free)))


def drop(elements: int, height: float = 5.0, gravity: float = 10.0) -> Rig:
    """Return the bar dropped on a floor, in the falling frame.

    There the bar is at rest and the floor comes with g t^2 / 2. During contact the
    end has the floor's velocity V = v_0 + g s, s from first touch; afterwards what
    comes back from the free end, 2 V(s - T). Contact lasts T where v_0 > g T.
    """
    bar = Bar(elements=elements)
    back, start = bar.passage, math.sqrt(2.0 * height / gravity)
    arrival = gravity * start
    duration = start + 2.5 * back
    rise = SLOW_RISE * duration

    def travel(s: Floats) -> Floats:
        return arrival * s + 0.5 * gravity * s**2

    def end(time: Floats) -> Floats:
        s = np.maximum(time - start, 0.0)
        turns = np.floor(s / back)
        late = 2.0 * travel(s - turns * back)
        late += (2.0 * turns - 1.0) * travel(np.float64(back))
        return -np.where(turns < 1, travel(s), late)

    def force(time: Floats) -> Floats:
        s = time - start
        held = (s > 0.0) & (s < back)
        return np.where(held, bar.impedance * (arrival + gravity * s), 0.0)

    def impulse(time: Floats) -> Floats:
        return bar.impedance * travel(np.clip(time - start, 0.0, back))

    amplitude = 2.0 * gravity * (rise / math.pi) ** 2
    wall = {"kind": "rigid", "amplitude": amplitude, "rise": rise, "gap": height}
    return Rig(
        bar=bar, settings=wall, duration=duration, touch=start, release=start + back,
        arrival=arrival, rebound=arrival, end=end, force=force, impulse=impulse,
        wall_speed=-(arrival + gravity * back),
    )  # fmt: skip


def two_bars(elements: int, speed: float = 10.0) -> Rig:
    """Return equal bars, of which the casing's strikes the blades' at `speed`.

    Both ends go at v / 2 under Z v / 2 for T, then the struck bar goes at v as a whole
    and the striking one rests. One bar of N areas strikes the N bars of the rotor.
    """
    bar = Bar(elements=elements)
    back, pulse = bar.passage, 0.1
    gap = 1.5 * speed * pulse
    start = gap / speed + pulse / 2

    def end(time: Floats) -> Floats:
        s = np.maximum(time - start, 0.0)
        return -speed * np.where(s < back, s / 2, s - back / 2)

    def force(time: Floats) -> Floats:
        held = (time > start) & (time < start + back)
        return np.where(held, bar.impedance * speed / 2, 0.0)

    def impulse(time: Floats) -> Floats:
        return bar.impedance * speed / 2 * np.clip(time - start, 0.0, back)

    return Rig(
        bar=bar,
        settings={"gap": gap, "pulse": pulse, "direction": "squeeze"},
        duration=start + 1.5 * back,
        touch=start,
        release=start + back,
        arrival=speed,
        rebound=speed,
        end=end,
        force=force,
        impulse=impulse,
        casing=bar,
    )


def clamped(elements: int, travel: float = 1.0) -> Rig:
    """Return a clamped bar pressed by a wall that moves in by `travel` and stays.

    The wall's velocity V makes Z V at once, and again twice at each return of the
    wave: F = Z (V(t) + 2 sum_n V(t - n T)) >= 0, EA travel / L in the mean.
    """
    bar = Bar(elements=elements, clamped=True)
    back = bar.passage
    rise, duration = 1.3 * back, 6.0 * back

    def phases(time: Floats) -> list[Floats]:
        """Return the wall's phase 0 to pi as it was n T before, n = 0, 1, ..."""
        starts = back * np.arange(math.ceil(duration / back))
        return [np.pi * np.clip((time - start) / rise, 0.0, 1.0) for start in starts]

    def wall(time: Floats) -> Floats:
        return -0.5 * travel * (1.0 - np.cos(phases(time)[0]))

    def force(time: Floats) -> Floats:
        first, *others = map(np.sin, phases(time))
        top = 0.5 * bar.impedance * travel * np.pi / rise
        return np.asarray(top * (first + 2.0 * sum(others)))

    def impulse(time: Floats) -> Floats:
        first, *others = (1.0 - np.cos(phase) for phase in phases(time))
        return np.asarray(0.5 * bar.impedance * travel * (first + 2.0 * sum(others)))

    return Rig(
        bar=bar,
        settings={"kind": "rigid", "amplitude": travel, "rise": rise, "gap": 0.0},
        duration=duration,
        touch=0.0,
        release=duration,
        arrival=0.0,
        rebound=0.0,
        end=wall,
        force=force,
        impulse=impulse,
    )


RIGS: dict[str, Callable[[int], Rig]] = {
    "drop": drop,
    "two bars": two_bars,
    "clamped": clamped,
}


def scene_of(
    rig: Rig, step: float, scheme: str, blades: int, **settings: float
) -> Scene:
    """Return the scene of a rig: no pulse but that of a second bar, no damping."""
    fixed: dict[str, Any] = {
        "blades": blades, "radius": 10.0, "speed": 0.0, "nodal_diameter": 0,
        "friction": 0.0, "force": 0.0, "duration": rig.duration, "time_step": step,
        "interval": step, "scheme": scheme, "traces": "full", "amplitude_limit": 1e6,
    }  # fmt: skip
    if rig.casing is not None:
        momentum = blades * rig.bar.mass * rig.arrival
        fixed["force"] = math.pi * momentum / (2.0 * rig.settings["pulse"])
    return apply_settings(named_scene("table2"), fixed | rig.settings | settings)


def march_of(
    rig: Rig,
    step: float,
    scheme: str = "general",
    blades: int = 1,
    slider: Slider | None = None,
    **settings: float,
) -> March:
    """Return the march of a rig of `blades` bars, at its start."""
    slider = slider or Slider()
    scene = scene_of(rig, step, scheme, blades, **settings)
    rotor = rotor_of_bars(rig.bar, blades, slider)
    if rig.casing is None:
        return March(Case(scene, Model(rotor, None, None, blades)))
    whole = Bar(elements=rig.casing.elements, area=blades * rig.casing.area)
    casing, operator = casing_of_bar(whole, slider)
    return March(Case(scene, Model(rotor, casing, operator, blades)))
