"""Clusters: job scripts (`hpcwhirl job`), checks of a cluster (`hpcwhirl doctor`)."""
