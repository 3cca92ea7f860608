"""Pictures of results: maps, figures, one HTML page. Matplotlib lives here alone.

Nothing is integrated: a figure whose traces a campaign did not keep is one line that
says which.
"""
