"""One HTML file of a campaign: its map, and every case a click away."""
