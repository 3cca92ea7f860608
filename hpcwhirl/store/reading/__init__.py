"""Read results.h5: cases and their words, selection of cases, grids of cases."""
