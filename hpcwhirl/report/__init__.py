"""Pictures of results: maps, figures, an HTML page. Only this package uses Matplotlib.

Nothing is integrated here: a figure that needs traces which a campaign did not keep is
refused with one line.
"""
