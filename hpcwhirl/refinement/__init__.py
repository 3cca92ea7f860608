"""Refinement: which further cases a map needs where the words of cases differ.

The further cases follow from the words of cases that have ended, never from files,
ranks or time. The inputs are bisected on a lattice (`lattice`); a cell of the lattice
is split where the words at its corners differ (`tree`). The rules only ever add cases,
so that words may arrive in any order. Which cases a budget excludes follows from words,
too (`growth`).
"""
