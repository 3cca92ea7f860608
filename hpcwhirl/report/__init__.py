"""Pictures of results: maps, figures, one HTML page. Matplotlib lives here alone."""
