"""Both bodies by their modes or coordinates: what a scheme makes its arrays of.

`motion` is the state that all schemes can read and write; `timestep` has the
coefficients of a step of one mode, `turning` the terms of rotation and of standing
supports, `varying` those of a changing speed, `pulse` the load. `operators` makes the
constant arrays of the loop `kernels.oracle.bodies`.
"""
