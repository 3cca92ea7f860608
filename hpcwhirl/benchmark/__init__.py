"""Measure the program: times of a step, and cost and error of solver settings."""
