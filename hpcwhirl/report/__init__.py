"""Figures: regime maps, orbits, time traces. Matplotlib lives here alone."""
