"""All families, by their names, in the order of the page."""

from __future__ import annotations

from attacks import damage, kills, settings, toml
from attacks.family import Family

_ALL = (
    Family("kills", "kill -9 of a job, of a rank, of rank 0, in every mode", 300,
           kills.prepare, kills.attempt),
    Family("damage", "damaged campaign directories", 2000,
           damage.prepare, damage.attempt),
    Family("toml", "hostile campaign files", 2000, toml.prepare, toml.attempt),
    Family("set", "hostile `--set`", 2000, settings.prepare, settings.attempt),
)  # fmt: skip
FAMILIES = {family.name: family for family in _ALL}
