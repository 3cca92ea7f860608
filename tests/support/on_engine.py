"""Inputs as tests give them: tables of a campaign, words of a command."""

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


def words_of(settings):
    """Return the words by which a command is given inputs."""
    return [w for name, value in settings.items() for w in ("--set", f"{name}={value}")]
