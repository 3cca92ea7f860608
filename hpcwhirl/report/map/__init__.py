"""The map of a campaign: `data` makes its content, `layout` arranges it on paper.

`axes` and `colours` define positions and the meaning of colours; `drawing` draws a
panel of a grid or of scattered cases, `refined` one of a refined campaign, `critical`
adds critical speeds; `captions` makes title and legend, `probabilities` draws shares of
regimes where inputs were drawn at random; `maps` reads, draws and writes whole maps.
"""
