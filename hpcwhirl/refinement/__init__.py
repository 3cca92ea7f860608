"""Refinement: the further cases that a campaign needs, decided by words of cases only.

Refinement does not depend on files, ranks or time. It has a lattice of bisected inputs,
trees of cells over the lattice, and rules that only ever add cases, so that words may
arrive in any order (`tree`). Which cases a budget excludes follows from words, too
(`growth`).
"""
