"""Clusters: job scripts of `hpcwhirl job`, and what `hpcwhirl doctor` finds there."""
