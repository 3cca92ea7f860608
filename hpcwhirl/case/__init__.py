"""What a scene requires of its model: a case, resolved before anything is marched.

`resolve` makes the case of a scene, which all that follows takes: what was given, what
it asks for by errors (`truncation` chooses modes by the motion that they would add,
`limits` a step), the model, what of it is marched (`plan`) and what that will cost.

N equal blades and a load on k lobes look the same after a turn by 2 pi / g, g = gcd(k,
N): one of g sectors is marched, without a centre. That is exact for the equations, but
a motion without the symmetry may grow out of round-off, which grows from touchdown to
touchdown: after 12 touchdowns of a blade, or contact for longer than the rotor's
slowest period, a case begins anew with the whole model.
"""
