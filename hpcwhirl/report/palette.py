"""Colour maps of numbers; looks of words are of `scene.words`."""

SEQUENTIAL = "cividis"  # of numbers: perceptual, and the same to the colour-blind
DIVERGING = "PuOr"  # of numbers about zero
