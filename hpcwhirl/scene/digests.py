"""Digests of many cases that differ in a few inputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hpcwhirl.errors import InputError
from hpcwhirl.scene.files import (
    FILE,
    Value,
    apply_settings,
    content_digest,
    digest_of,
    flatten,
)
from hpcwhirl.scene.inputs import Scene


class Digests:
    """Digests of cases by what they set; each value is checked once for all of them.

    Parameters
    ----------
    base : what the cases share
    contents : {engine file: SHA-256} as planned; others are read
    """

    def __init__(self, base: Scene, contents: Mapping[str, str]) -> None:
        self.base, self.contents = base, dict(contents)
        self._flat = flatten(base)
        self._memory: dict[str, Any] = {}

    def __call__(self, settings: Mapping[str, Value]) -> str:
        """Return the digest of a case.

        Raises
        ------
        InputError
            where there is no such case
        """
        try:
            own = {name: self._value(name, raw) for name, raw in settings.items()}
            values = self._flat | own
        except InputError:  # allowed together with others alone
            values = flatten(apply_settings(self.base, settings))
        return self._digest(values)

    def planned(self, settings: Mapping[str, Value]) -> str:
        """Return the digest of a case, of one that will fail as a row, too."""
        try:
            return self(settings)
        except InputError:
            return self._digest(self._flat | dict(settings))

    def _digest(self, values: Mapping[str, Any]) -> str:
        file = str(values[FILE])
        if file not in self.contents:
            self.contents[file] = content_digest(file)
        return digest_of(values, self.contents[file])

    def _value(self, name: str, raw: Any) -> Any:
        """Return a value as a scene has it."""
        key = f"{name} {raw!r}"
        if key not in self._memory:
            self._memory[key] = flatten(apply_settings(self.base, {name: raw}))[name]
        return self._memory[key]
