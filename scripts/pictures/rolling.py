"""Draw how a rotor that rubs rolls in its casing, whips, and stops (Black's rotor).

    python scripts/pictures/rolling.py [--out .pictures/rolling.png] [--duration 2.4]

A rigid disk on a spring stands in a rigid ring on a stiffer spring; both have a mass. A
pulse moves the ring once, while the speed Omega rises and falls again. Friction follows
the slip of each tip.

The centre of the disk, relative to that of the ring, is e = gap exp(i phi) while they
touch, phi' = w. The ring pushes the disk by -(N + i T) exp(i phi), so that with the
receptances alpha of disk and ring

    (N + i T)(alpha_disk + alpha_ring) = -gap

A tip that sticks moves with the ring: w gap + Omega R = 0. So the disk rolls, backward,
with w = -Omega R / gap where N > 0 and |T| <= mu N, which holds between two frequencies
at which T = -mu N: above the lower one, near the frequency of the rotor alone, whirl
can persist; at the upper one, near that of both bodies together, Re(alpha_disk +
alpha_ring) = 0, it whips (Black, 1968): the tips slide, and w depends on Omega no more.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from scipy.optimize import brentq

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, working_folder

from hpcwhirl.arrays import Floats
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.history import History
from hpcwhirl.dynamics.march import March
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import in_defaults, new_figure, save
from hpcwhirl.scene import Scene, apply_settings, named_scene

TIPS, RADIUS, GAP, FRICTION = 60, 0.5, 1e-4, 0.3  # -, m, m, -
MASS = {"disk": 100.0, "ring": 30.0}  # kg
OWN = {"disk": 583.0, "ring": 583.0 * (4.0 * 100.0 / 30.0) ** 0.5}  # rad/s
DAMPING = {"disk": 0.02, "ring": 0.05}
ROLLING = (0.0, 700.0), (1.0 / 3.0, 1300.0), (1.0, 500.0)  # share of the run; Omega R/g
SHOWN = -650.0, -800.0, -900.0, -1000.0, -1200.0  # rad/s, of rolling, printed
SPAN = 4e-3  # s, over which a frequency is a mean
SCENE: dict[str, Any] = {
    "blades": TIPS, "radius": RADIUS, "discretization": "file", "gap": GAP,
    "friction": FRICTION, "nodal_diameter": 1, "force": 2e5, "pulse": 1e-3,
    "speed": ROLLING[0][1] * GAP / RADIUS, "time_step": 2e-6, "interval": 2e-4,
    "traces": "orbit", "scheme": "modal", "plan": "everything", "slip": "set-valued",
}  # fmt: skip


def write_bodies(path: Path) -> Path:
    """Write disk and ring to a file of an engine, each by its two translations."""
    angle = 2 * np.pi * np.arange(TIPS) / TIPS
    radial = np.column_stack([np.cos(angle), np.sin(angle)])
    along = np.column_stack([-np.sin(angle), np.cos(angle)])
    disk, ring = (MASS[body] ** -0.5 for body in ("disk", "ring"))
    with h5py.File(path, "w") as file:
        file["rotor/omega"] = [OWN["disk"]] * 2
        file["rotor/damping_ratio"] = [DAMPING["disk"]] * 2
        file["rotor/modal_tip_radial"] = radial * disk
        file["rotor/modal_tip_tangential"] = along * disk
        file["rotor/modal_centre"] = np.eye(2) * disk
        # harmonic 0 must be there; it is too heavy to breathe
        file["casing/modal_harmonic"] = [0, 1]
        file["casing/modal_omega"] = [OWN["ring"]] * 2
        file["casing/modal_damping_ratio"] = [DAMPING["ring"]] * 2
        file["casing/modal_radial"] = [1e-6, ring]
        file["casing/modal_tangential"] = [0.0, -ring]
    return path


def scene_of(folder: Path, duration: float, **more: Any) -> Scene:
    """Return the scene in which the speed rises and falls, with further settings."""
    rows = (f"{share * duration},{w * GAP / RADIUS}" for share, w in ROLLING)
    given = SCENE | {
        "duration": duration,
        "speed_table": ";".join(["time,speed", *rows]),
    }
    given["file"] = str(write_bodies(folder / "disk_in_ring.h5"))
    return apply_settings(named_scene("table2"), given | more)


def receptance(body: str, w: float) -> complex:
    """Return how far a unit force that rotates at w, rad/s, moves a body, m/N."""
    own, damping = OWN[body], 2j * DAMPING[body] * OWN[body] * w
    return 1.0 / (MASS[body] * (own**2 - w**2 + damping))


def forces(w: float) -> complex:
    """Return N + i T, N, of a whirl in contact at w, rad/s."""
    return -GAP / (receptance("disk", w) + receptance("ring", w))


def limits(friction: float = FRICTION) -> tuple[float, float]:
    """Return the frequencies between which the disk can roll, rad/s, both positive."""

    def spare(w: float) -> float:
        push = forces(-w)
        return friction * push.real - abs(push.imag)

    springs = sum(MASS[body] * OWN[body] ** 2 for body in MASS)
    together = (springs / sum(MASS.values())) ** 0.5
    scan = np.linspace(0.9 * OWN["disk"], together, 2000)
    rolls = np.flatnonzero([spare(w) > 0.0 for w in scan])
    first, last = int(rolls[0]), int(rolls[-1])
    return (
        brentq(spare, scan[first - 1], scan[first]),
        brentq(spare, scan[last], scan[last + 1]),
    )


def rolling(time: Floats, duration: float) -> Floats:
    """Return -Omega R / gap at times, rad/s."""
    shares, frequencies = np.transpose(ROLLING)
    return -np.interp(time / duration, shares, frequencies)


def whirl_of(history: History) -> tuple[Floats, Floats]:
    """Return times, s, and the centre's frequency, rad/s, where tips touch.

    It is that in the rotating frame, less than 0.3 rad/s off.
    """
    time, centre = history.time, history.centre
    angle = np.unwrap(np.arctan2(centre[:, 1], centre[:, 0]))
    n = max(round(SPAN / (time[1] - time[0])), 1)
    touches = history.impulse[n:] > history.impulse[:-n]
    rate = (angle[n:] - angle[:-n]) / (time[n:] - time[:-n])
    return 0.5 * (time[n:] + time[:-n])[touches], rate[touches]


def marched(duration: float, **more: Any) -> History:
    """Return the history of the run-up and run-down, with further settings."""
    with working_folder(None, "rolling") as folder:
        return March(resolve(scene_of(folder, duration, **more))).run()


def near(history: History, frequency: float, duration: float) -> float:
    """Return the mean whirl in contact where rolling is near a frequency, rad/s."""
    time, whirl = whirl_of(history)
    return float(whirl[np.abs(rolling(time, duration) - frequency) < 5.0].mean())


def ending(history: History, duration: float) -> float:
    """Return the frequency of rolling at the last contact, rad/s."""
    return float(rolling(np.array([history.last_contact]), duration)[0])


@in_defaults
def draw(history: History, duration: float, path: Path) -> Path:
    """Draw the whirl beside the closed forms; return the path."""
    figure, axes = new_figure((8, 4.5))
    time = np.linspace(0.0, duration, 500)
    axes.plot(*whirl_of(history), ".", c=palette.BLUE, ms=2, label="in contact")
    axes.plot(time, rolling(time, duration), "--", c=palette.INK, lw=1,
              label="rolling, $-\\Omega R$/gap")  # fmt: skip
    for w, told in zip(limits(), ("whirl ends", "whip"), strict=True):
        axes.axhline(-w, c=palette.TOUCH, lw=1, ls=":")
        label = f"{told} (Black), {-w:.0f} rad/s"
        axes.annotate(label, (0.01 * duration, -w), xytext=(0, 3), fontsize=8,
                      textcoords="offset points")  # fmt: skip
    axes.set(xlabel="time, s", ylabel="frequency of the centre, rad/s",
             ylim=(-1350.0, -450.0))  # fmt: skip
    axes.legend(fontsize=8, loc="lower right")
    return save(figure, path)


def main() -> None:
    """Draw the figure."""
    parser = parser_of(__doc__)
    parser.add_argument("--out", type=Path, default=Path(".pictures/rolling.png"))
    parser.add_argument("--duration", type=float, default=2.4)
    given = parser.parse_args()
    history = marched(given.duration)
    least, whip = limits()
    for w in SHOWN:
        print(
            f"rolling at {w:.0f}, whirl at {near(history, w, given.duration):.1f} rad/s"
        )
    print(f"whip at {-whip:.1f} rad/s (Black)")
    end = ending(history, given.duration)
    print(f"last contact at {end:.1f} rad/s, whirl ends at {-least:.1f} (Black)")
    print(draw(history, given.duration, given.out))


if __name__ == "__main__":
    main()
