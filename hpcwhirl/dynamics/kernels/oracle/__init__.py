"""The time loop `bodies`, which takes both bodies one by one: the reference.

`body` has what a step does to a rotor or a casing, `bodies` the loop. It imports
nothing of the room `loop`.
"""
