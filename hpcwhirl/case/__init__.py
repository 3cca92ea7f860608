"""Cases: scenes with model, time step and plan, resolved before integration.

`resolve` makes the case of a scene, which later stages take: the scene as given, the
modes (`truncation`) and the step (`limits`) that meet its error bounds, the model, the
part of it that is integrated (`plan`) and the predicted cost.

N equal blades and a load on k lobes look the same after a turn by 2 pi / g, g = gcd(k,
N): one of g sectors is marched, without a centre. That is exact for the equations, but
a motion without the symmetry may grow out of round-off, which grows from touchdown to
touchdown: after 12 touchdowns of a blade, or contact for longer than the rotor's
slowest period, a case is started again with the whole model.
"""
