"""Check of a machine for `hpcwhirl doctor`: what will break there, and the remedy."""
