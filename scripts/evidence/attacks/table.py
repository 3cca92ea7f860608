"""All families, by their names, in the order of the page."""

from __future__ import annotations

from attacks import (
    damage,
    disk,
    engines,
    ground,
    kills,
    names,
    settings,
    signals,
    together,
    toml,
)
from attacks.family import Family

LOCKED = {"HDF5_USE_FILE_LOCKING": "TRUE"}
UNLOCKED = {"HDF5_USE_FILE_LOCKING": "FALSE"}
_ALL = (
    Family("kills", "kill -9 of a job, of a rank, of rank 0, in every mode", 300,
           kills.prepare, kills.attempt),
    Family("damage", "damaged campaign directories", 2000,
           damage.prepare, damage.attempt),
    Family("toml", "hostile campaign files", 2000, toml.prepare, toml.attempt),
    Family("set", "hostile `--set`", 2000, settings.prepare, settings.attempt),
    Family("engines", "hostile engine files", 400, engines.prepare, engines.attempt),
    Family("names", "hostile names", 200, names.prepare, names.attempt),
    Family("gathers", "overlapping gathers, HDF5's locks on", 200,
           together.prepare, together.gathers, LOCKED),
    Family("gathers-unlocked", "overlapping gathers, HDF5's locks off", 200,
           together.prepare, together.gathers, UNLOCKED),
    Family("together", "two commands in one directory, locks on", 100,
           together.prepare, together.mixed, LOCKED),
    Family("together-unlocked", "two commands in one directory, locks off", 100,
           together.prepare, together.mixed, UNLOCKED),
    Family("disk", "a full disk", 100, disk.prepare, disk.attempt),
    Family("signals", "signals from the first millisecond", 200,
           signals.prepare, signals.attempt),
    Family("ground", "another user, clocks, homes, caches, streams", len(ground.CHECKS),
           ground.prepare, ground.attempt),
)  # fmt: skip
FAMILIES = {family.name: family for family in _ALL}
