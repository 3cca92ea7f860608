"""Cases: what the time integration of a scene needs, its model, time step and plan.

`resolve` makes the case of a scene: the scene as given, the modes (`truncation`) and
the step (`limits`) that meet its error bounds, the model, the part of it that is
integrated (`plan`) and the predicted cost.

N equal blades and a load on k lobes are unchanged by a rotation of 2 pi / g, g = gcd(k,
N): only one of g sectors is integrated, without the shaft's centre, which stays at
rest. This is exact for the equations, but round-off grows from touchdown to touchdown
and may start a motion without the symmetry. So after 12 touchdowns of a blade, or
contact for longer than the rotor's slowest period, a case is started again with the
whole model.
"""
