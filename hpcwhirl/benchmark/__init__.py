"""Benchmarks: time of a time step, and cost and error of solver settings.

`bench` and `sizes` are for `hpcwhirl bench`, `tradeoff` is for `hpcwhirl tradeoff`.
"""
