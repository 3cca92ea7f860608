"""The time loop of waves, `points`, and what it does with each kind of rows.

- slots, of equal sectors: `slots` has the pass over all amplitudes, `slot_steps` the
  operations of a step, `slot_flights` the jumps of the exact flow; `skipped` decides
  when gaps need not be computed
- rows of points: `point_rows`, and `sectors` for nearly equal ones; `bounded` has the
  operations of a step, `whole` sums over rows
- `slot_slides`, `point_slides`: set-valued friction, for either kind of rows
- `transform`, `passes`: from spectra to gaps; `circulant`: the Delassus matrix of equal
  sectors; `flight`: how long a jump may be

It imports nothing of the room `oracle`, by which it is checked.
"""
