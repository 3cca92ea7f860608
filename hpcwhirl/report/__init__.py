"""Pictures of results: maps, figures, one HTML page. Matplotlib lives here alone.

Nothing is integrated: a figure that needs traces which a campaign did not keep is
refused in one line.
"""
