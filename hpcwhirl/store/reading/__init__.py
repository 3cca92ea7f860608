"""Reading results: cases, words, conditions, neighbours."""
