"""The map of a campaign: `data` has its content, `layout` its arrangement on paper.

`axes` and `colours` define positions and the meaning of colours; `drawing` draws a
panel of a grid or of scattered cases, `refined` one of a refined campaign, `critical`
the critical speeds over it; `captions` has title and legend, `probabilities` the shares
of regimes where inputs were drawn, and `maps` reads, draws and writes all of it.
"""
