"""The cases of a campaign, the computations of each, and their predicted costs."""
