"""Reading what a campaign holds: cases, words, conditions, neighbours."""
