"""The model that a scene requires."""

from __future__ import annotations

from hpcwhirl.case.truncation import with_truncation
from hpcwhirl.reduction.model import Model, whole_model_of
from hpcwhirl.scene import Scene


def model_of(scene: Scene) -> Model:
    """Return the model of a scene, of as many modes as its truncation asks.

    Raises
    ------
    InputError
        where the inputs do not lead to a model that double precision holds
    """
    return whole_model_of(with_truncation(scene))
