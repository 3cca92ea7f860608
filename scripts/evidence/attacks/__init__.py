"""Attacks on campaigns, family by family: see `attack.py`."""
