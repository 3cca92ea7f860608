"""The map of a campaign: `data` is what it shows, `layout` how it stands on paper.

`axes` and `colours` say what lies where and what a colour means; `drawing` draws a
panel of a grid or of scattered cases, `refined` one of a refined campaign, `critical`
the critical speeds over it; `captions` has title and legend, `probabilities` the shares
of regimes where inputs were drawn, and `maps` reads, draws and writes all of it.
"""
