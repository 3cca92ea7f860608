"""The looks of words, one table for every figure and page.

Lightness falls from `missing` to `failed` in steps of at least 11 (CIE L*), so that
print in grey keeps the words apart, and no two colours come close to the colour-blind;
`tests/test_palette.py` measures both. A letter says the same without colour.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Look:
    """How a word is shown.

    Attributes
    ----------
    colour : fill, sRGB
    ink : of a letter or marker on that fill
    letter : that stands for the word
    marker : of a point, as Matplotlib names it
    told : the word in a legend
    line : colour of thin lines and dots on white, where the fill is too light for them
    """

    colour: str
    ink: str
    letter: str
    marker: str
    told: str
    line: str = ""

    @property
    def stroke(self) -> str:
        """Colour of thin lines and dots on white."""
        return self.line or self.colour


WORDS = {
    "damped": Look("#7DB8DF", "#000000", "d", "o", "damped", "#3F86B5"),
    "sustained": Look("#F2DC3A", "#000000", "S", "s", "sustained", "#A88F00"),
    "divergent": Look("#C63D0F", "#FFFFFF", "X", "^", "divergent"),
    "undecided": Look("#8D8D8D", "#000000", "?", "D", "undecided"),
    "unstable": Look("#57267A", "#FFFFFF", "U", "P", "unstable"),
    "failed": Look("#0C0C0C", "#FFFFFF", "!", "X", "failed"),
    "missing": Look("#FFFFFF", "#000000", "·", ".", "not computed", "#BBBBBB"),
}
WHIRLS: dict[str, str | None] = {
    "forward": "^", "backward": "v", "mixed": "o", "none": None,
}  # fmt: skip
WHIRL_LOOKS = {  # where the colour tells the whirl
    "forward": Look("#2F6DB3", "#FFFFFF", "F", "^", "forward"),
    "mixed": Look("#4BA386", "#000000", "M", "o", "mixed"),
    "backward": Look("#F0AE45", "#000000", "B", "v", "backward"),
    "none": Look("#DBD9DD", "#000000", "–", ".", "no whirl"),
}
SEQUENTIAL = "cividis"  # of numbers: perceptual, and the same to the colour-blind
DIVERGING = "PuOr"  # of numbers about zero


def word_of(status: str, outcome: str, regime: str) -> str:
    """Return the word of `WORDS` that a case is shown by."""
    if status != "ok":
        return "missing" if status == "missing" else "failed"
    return "unstable" if outcome == "unstable" or regime == "none" else regime


def words_of(
    status: NDArray[np.str_], outcome: NDArray[np.str_], regime: NDArray[np.str_]
) -> NDArray[np.str_]:
    """Return `word_of` of many cases, (cases,)."""
    named = np.where((outcome == "unstable") | (regime == "none"), "unstable", regime)
    without = np.where(status == "missing", "missing", "failed")
    return np.where(status == "ok", named, without)


def as_records() -> dict[str, dict[str, Any]]:
    """Return the table as plain data, {word: {colour, ink, letter, marker, told}}."""
    return {word: asdict(look) for word, look in WORDS.items()}
