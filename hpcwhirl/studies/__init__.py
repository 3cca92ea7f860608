"""Studies of motions and words: what needs only `simulate` and results.

`margins` lists safe ranges, `basins` and `attractors` which starts end on which motion,
`branches` where sweeps up and down change their words, `edge` and `edge_tracking`
follow the motion between two words, `shares` and `sensitivity` what drawn inputs do,
`comparison` puts two campaigns side by side. The evidence and words of one motion, on
which all of them rest, are made in `analysis`.
"""
