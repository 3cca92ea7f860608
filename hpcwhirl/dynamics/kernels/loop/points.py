"""Time loop in the frame of the blades: rotor and casing as waves.

In the frame of the blades no coefficient depends on time: the waves of both bodies have
complex amplitudes that a step multiplies by z, gaps are sums of coefficients times
amplitudes, and contact forces change the amplitudes. The Delassus matrix W, of both
bodies, is constant.

How waves lie, and so each operation, depends on the type of the rows of coefficients,
see `point_verbs`: a row for each contact point (`wave_types.PointRows`, unequal
sectors), for each point of a tip by slot (`SectorRows`), or for each wave by slot, for
equal sectors with one point a tip (`SlotRows`; `FlowRows` in the exact flow). Contact
points replace blades in all arrays, if a tip has several.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import kernel
from hpcwhirl.dynamics.kernels.contact import (
    COMPLEMENTARITY,
    FLUSH_EVERY,
    NEXT_LOOK,
    PULSE,
    RUNNING,
    STEP,
    STOP,
    keep_state,
    pulse_of,
    watch,
)
from hpcwhirl.dynamics.kernels.loop import bounded, slot_flights, slot_steps
from hpcwhirl.dynamics.kernels.loop.cyclic import angle_of, flush
from hpcwhirl.dynamics.kernels.loop.point_verbs import (
    advance,
    conclude,
    farthest,
    flew,
    kick,
    sample,
    set_out,
    touch,
    work_of_kick,
)

IMPLEMENTED = (
    bounded,
    slot_flights,
    slot_steps,
)  # importing them registers the operations


@kernel
def march_points(
    steps, strides, limit, step, speed, mu, wall, loading, rotor, _, contact, state,
    tracks, space,
):  # fmt: skip
    """Integrate rotor and casing over `steps` steps, as waves in the rotating frame.

    Parameters
    ----------
    steps, strides, limit, step, speed, mu, wall, loading, tracks : as in
        `oracle.bodies.march_bodies`
    rotor, contact : coefficients of waves and of contact, in types of `wave_types`
    state, space : `kernel_types.CyclicState`; result of `bounded.points_space` or
        `slot_steps.slot_space`
    """
    rows, counter, ledger = rotor.rows, state.counter, state.ledger
    set_out(rows, state, space)
    goal = counter[STEP] + steps
    while counter[STEP] < goal and counter[STOP] == RUNNING:
        if not flew(
            rows, rotor, wall, strides, mu, step, speed, loading, state, space, tracks
        ):
            advance(rows, rotor, contact, wall, step, speed, state, space)
            thrust = pulse_of(counter[STEP] * step, loading.force, loading.pulse)
            counter[STEP] += 1
            angle, moved = 0.0, 0.0
            if thrust != 0.0:
                angle = angle_of(wall, speed, counter[STEP] * step)
                moved = kick(rows, rotor, thrust, angle, state, space)
            looks = counter[STEP] >= counter[NEXT_LOOK]
            every = thrust != 0.0 or counter[STEP] % strides.evidence == 0
            if looks:
                watch(farthest(rows, rotor, limit, state, space), limit, counter)
            active = touch(
                rows, rotor, contact, wall, mu, step, speed, thrust, angle, every,
                looks, state, space,
            )  # fmt: skip
            if active < 0:
                counter[STOP] = COMPLEMENTARITY
                break
            if thrust != 0.0:
                ledger[PULSE] += work_of_kick(
                    rows, rotor, thrust, angle, moved, state, space
                )
            if counter[STEP] % FLUSH_EVERY == 0:
                flush(state.rotor)
        elif counter[STEP] >= counter[NEXT_LOOK]:
            watch(farthest(rows, rotor, limit, state, space), limit, counter)
        keep = counter[STEP] % strides.traces == 0
        judge = counter[STEP] % strides.evidence == 0
        states = len(tracks.states) > 0 and counter[STEP] % strides.states == 0
        if keep or judge or states:
            sample(
                rows, rotor, wall, mu, step, speed, state, space, keep, judge, tracks
            )
        if states:
            keep_state(
                state.rotor, state.ring, counter, ledger, strides.states, tracks.states
            )
    conclude(rows, rotor, wall, step, speed, state, space)
