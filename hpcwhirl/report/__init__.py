"""Pictures of results: maps, figures, an HTML page. Only this package uses Matplotlib.

Nothing is integrated here: if a campaign did not keep the traces that a figure needs,
one line says so instead of the figure.
"""
