"""Claims, each a module: what is claimed, how scenes are drawn, how one is judged."""
