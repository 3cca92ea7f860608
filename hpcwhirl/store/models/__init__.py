"""Read files of engines and wheels into checked arrays; mechanics is elsewhere."""
