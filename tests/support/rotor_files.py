"""Engines' files: exported, read, and written from arrays."""

import h5py
from launch import words_of

from hpcwhirl.cli import main


def exported(path, settings, *scene):
    """Return the file of an engine, of the default scene or of another."""
    assert main(["export-model", str(path), *scene, *words_of(settings)]) == 0
    return path


def arrays_in(path, group="rotor"):
    """Return {name: array} of a group."""
    with h5py.File(path) as file:
        return {name: data[()] for name, data in file[group].items()}


def written(path, arrays, group="rotor"):
    """Write arrays of a group to an engine's file; None: leave that out."""
    with h5py.File(path, "a") as file:
        for name, array in arrays.items():
            if f"{group}/{name}" in file:
                del file[f"{group}/{name}"]
            if array is not None:
                file[f"{group}/{name}"] = array
    return path
