"""Families of attacks on hpcwhirl; `scripts/evidence/attack.py` runs them."""
