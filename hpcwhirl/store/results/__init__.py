"""`results.h5`: what it will hold, and how it is written whole."""
