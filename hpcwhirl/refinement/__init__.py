"""Refinement: which further cases a campaign wants, as a rule on words alone.

No file, no rank, no clock: a lattice of bisected inputs, trees of cells over it, and
the least fixed point of rules that only ever add cases, so that words may come in any
order (`tree`). What a budget leaves out follows from words, too (`growth`).
"""
