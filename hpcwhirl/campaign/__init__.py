"""Designs of many cases, one case, and their distribution over MPI ranks."""
