"""Both bodies as waves of the rotating frame: constant arrays of the loop `points`.

- slots: equal sectors, one complex amplitude for each nodal diameter and row. `slots`
  finds the modes' places, `slot_waves` the waves' coefficients
- points: unequal sectors, several contact points a tip, supports of their own kind.
  `point_waves` finds waves, `point_arrays` the kernel's arrays; `point_sectors` packs
  those of nearly equal sectors, `point_supports` adds forces of supports at the centre
- `mode_waves`: a mode as one or two waves; `turning_waves`, `whole_waves`: waves of
  modes that rotation couples, by nodal diameter or of the whole rotor
- `casing`: the wall's clearance and shape, and the stored trace of its motion;
  `flights`: when the exact flow may jump
"""
