"""Write `results.h5`: its layout, its contents, and gathering them from journals."""
