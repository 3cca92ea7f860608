"""The time loop `bodies`, which takes both bodies one by one: the reference.

A body is a matrix (`dense`), modes (`modes`), or modes that rotation couples
(`coupled`). It imports nothing of the room `loop`.
"""
