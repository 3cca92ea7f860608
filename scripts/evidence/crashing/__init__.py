"""Every crash point of a campaign's directory, and every await between ranks."""
