"""Reading results: cases and their words, selection of cases, nearest cases."""
