"""Time integration of both bodies and their contact, in slices."""
