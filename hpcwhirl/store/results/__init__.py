"""Writing `results.h5`: its contents, layout and gathering."""
