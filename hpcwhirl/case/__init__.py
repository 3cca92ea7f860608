"""Cases: scenes with model, time step and plan, resolved before integration.

`resolve` makes the case of a scene for later stages: the scene as given, the modes
(`truncation`) and the step (`limits`) that meet its error bounds, the model, the part
of it that is integrated (`plan`) and the predicted cost.

N equal blades and a load on k lobes are unchanged by a rotation of 2 pi / g, g = gcd(k,
N): only one of g sectors is integrated, without a centre. This is exact for the
equations, but a motion without the symmetry may grow from round-off, which grows from
touchdown to touchdown. So after 12 touchdowns of a blade, or contact for longer than
the rotor's slowest period, a case is started again with the whole model.
"""
