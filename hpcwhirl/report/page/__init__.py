"""One HTML file of a campaign: its map, with every case to click on."""
