"""Benchmarks: time of a step, and cost and error of solver settings."""
