"""Refinement: which further cases a campaign needs, decided by words of cases only.

It is independent of files, ranks and time: a lattice of bisected inputs, trees of cells
over it, and the least fixed point of rules that only ever add cases, so that words may
arrive in any order (`tree`). The cases that a budget drops follow from words, too
(`growth`).
"""
