"""States between two motions of one scene, and the distance of two motions.

Apart from bookkeeping, the state of a march is linear in the motion: with a and b two
states at the same step of marches of one scene, a + s (b - a) is the state of the
motion in between. Only the multipliers need care: those of the last step are pending in
the state (`lam` of `CyclicState`) if its counters say that it had contact, and count as
zero in a state without contact. The forces of an unbalance and the gap are the same in
a and b, and therefore in between, since the weights add up to one.
"""

from __future__ import annotations

import math
from typing import Any

from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.march import March

MOTION = ("rotor", "ring", "gaps", "q_b", "d_b", "q_c", "d_c", "older")
WAITING = "lam"  # multipliers of a pending step


def copy_of(march: March) -> Any:
    """Return a copy of the state of a march, whose type depends on its kernel."""
    state = march.state
    return type(state)._make(array.copy() for array in state)


def put_between(march: March, a: Any, b: Any, share: float) -> None:
    """Set a march's state to a + share (b - a); steps, contacts, works are those of a.

    The change of energy is entered in the ledger as work of the loading, so that the
    ledger closes as well as that of a.

    Parameters
    ----------
    march : march of the same scene with the same number of sectors; tracks do not
        change
    a, b : states at the same step, see `copy_of`
    share : 0 gives a, 1 gives b; any number is allowed

    Raises
    ------
    ValueError
        if the states have different steps or shapes, or a run has ended
    """
    _check(march, a, b)
    march.put(a)
    left = _residual(march)
    march.put(_mixed(a, b, 1.0 - share, share))
    march.state.ledger[contact.PULSE] += _residual(march) - left


def distance(march: March, a: Any, b: Any) -> float:
    """Return sqrt(E), E in J, of the difference of two motions of a march's scene.

    E is the kinetic and strain energy of b - a of both bodies, all sectors. With terms
    of rotation the energy in the ledger is Jacobi's, T - Omega^2 x^T M x / 2 + U, with
    the kinetic energy T in the rotating frame and the strain energy U of x, which may
    be negative: 1/2 Omega^2 x^T M x of the rotor is added to it, which leaves the
    kinetic energy of the motion in the rotating frame and the strain energy, both
    positive.

    Raises
    ------
    ValueError
        as for `put_between`
    """
    _check(march, a, b)
    apart = march.scheme.balance(_mixed(a, b, -1.0, 1.0)).energy
    energy = march.lean.model.folds * float(apart)
    rotor = march.model.rotor
    if rotor.spin is not None:
        step = int(a.counter[contact.STEP])
        places = [march.scheme.motion(each, step).rotor for each in (a, b)]
        x = places[1] - places[0]
        energy += 0.5 * march.scene.speed**2 * float(x @ (rotor.mass @ x))
    return math.sqrt(max(energy, 0.0))


def _mixed(a: Any, b: Any, of_a: float, of_b: float) -> Any:
    """Return the state of_a a + of_b b, with the contacts and works of a.

    It has no certificate; of_a, of_b : factors of the states a and b
    """
    parts = {name: array.copy() for name, array in a._asdict().items()}
    for name in MOTION:
        if name in parts:
            parts[name] = of_a * getattr(a, name) + of_b * getattr(b, name)
    waits = [_waits(state) for state in (a, b)]
    if WAITING in parts:
        parts[WAITING] = of_a * waits[0] * a.lam + of_b * waits[1] * b.lam
    counter = parts["counter"]
    counter[contact.CERTIFIED] = -1
    counter[contact.NEXT_LOOK] = counter[contact.STEP]
    if any(waits):
        counter[contact.LAST] = counter[contact.STEP]
        counter[contact.ENDED] = -1
    return type(a)._make(parts.values())


def _waits(state: Any) -> bool:
    """Return whether a state may hold multipliers that no step has applied yet."""
    return bool(state.counter[contact.LAST] == state.counter[contact.STEP])


def _residual(march: March) -> float:
    """Return the error of the energy balance, J, summed over integrated sectors."""
    now, entries = march.scheme.balance(march.state), march.state.ledger
    given = entries[[contact.PULSE, contact.FRICTION, contact.ROTATION]].sum()
    lost = now.energy + now.damping + entries[contact.IMPACT] + now.impact
    return float(lost - given - now.friction - now.rotation)


def _check(march: March, a: Any, b: Any) -> None:
    shapes = [[array.shape for array in state] for state in (march.state, a, b)]
    if not shapes[0] == shapes[1] == shapes[2]:
        msg = "states must be of one scene and of the same number of sectors"
        raise ValueError(msg)
    one, other = (int(state.counter[contact.STEP]) for state in (a, b))
    if one != other:
        msg = f"states must be at the same step, got {one} and {other}"
        raise ValueError(msg)
    if any(state.counter[contact.STOP] != contact.RUNNING for state in (a, b)):
        msg = "states must be those of runs that have not ended"
        raise ValueError(msg)
