"""Campaigns on a named engine, for tests that need the motions it has."""

from hpcwhirl.scene import engine_inputs


def on_engine(name, document):
    """Return a campaign's tables with the inputs of a named engine added to them."""
    out = {table: value.copy() for table, value in document.items()}
    for full, value in engine_inputs(name).items():
        *tables, last = ("scene." * ("." not in full) + full).split(".")
        place = out
        for table in tables:
            place = place.setdefault(table, {})
        place[last] = value
    return out
