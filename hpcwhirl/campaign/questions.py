"""Whom rank 0 answers when: at once, and of the last units only who has none left."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hpcwhirl.campaign.agenda import Agenda

Answers = list[tuple[int, list[int]]]


class Questions:
    """Open questions of the workers; no messages, no clock.

    A worker asks ahead and is answered at once, but for the last units, one a rank:
    those wait for whoever has nothing left to do, else a rank would keep one behind
    the long case that it is at, while others idle.

    Parameters
    ----------
    agenda : units to hand out
    ranks : that share the work, rank 0 included
    """

    def __init__(self, agenda: Agenda, ranks: int) -> None:
        self.agenda, self.ranks = agenda, ranks
        self.open: dict[int, None] = {}  # ranks in the order of their questions

    def ask(self, rank: int) -> Answers:
        """Return the answers due now that a rank has asked ahead."""
        self.open[rank] = None
        return self._answer(rank) if len(self.agenda) > self.ranks else self.rest()

    def hungry(self, rank: int) -> Answers:
        """Return the answers due now that a rank has nothing left to do.

        It may have been answered meanwhile: then nothing is due to it.
        """
        return (self._answer(rank) if rank in self.open else []) + self.rest()

    def rest(self) -> Answers:
        """Return the answers due because nothing is left to be handed out."""
        if self.agenda:
            return []
        waiting, self.open = list(self.open), {}
        return [(rank, []) for rank in waiting]

    def _answer(self, rank: int) -> Answers:
        del self.open[rank]
        return [(rank, self.agenda.bundle())]
