"""The design of a refined campaign: coarse cases, and those that words may ask for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from hpcwhirl.campaign.plan.design import Design, Settings
from hpcwhirl.campaign.plan.stages import Job
from hpcwhirl.campaign.plan.twins import Twins
from hpcwhirl.refinement.rule import Family, Rule
from hpcwhirl.scene import Scene, apply_settings, digest
from hpcwhirl.scene.digests import Digests
from hpcwhirl.scene.files import FILE
from hpcwhirl.scene.quantities import WHOLE
from hpcwhirl.scene.table import Table
from hpcwhirl.store.directory.manifest import Manifest


@dataclass(frozen=True)
class RefinedDesign(Design):
    """A design whose further cases follow from words.

    `scenes`, `settings` and `digests` are those of the coarse level; a case beyond it
    has the number of its address, see `Family.number`. So have twins: their number,
    times the span of all those, is added to that of their case.

    Attributes
    ----------
    rule : of the cases beyond the coarse level
    kin : twins, each handed out by itself when words ask for it
    """

    rule: Rule | None = None
    kin: Twins | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Send what the scenes are made from instead of the scenes."""
        own = self.rule, self.kin
        return _sent, (self.base, self.settings, self.swept, self.contents, own)

    @property
    def refinement(self) -> Rule:
        """The rule."""
        if self.rule is None:
            raise TypeError
        return self.rule

    @cached_property
    def family(self) -> Family:
        """All cases that there may be."""
        return Family(self.refinement, self.settings, WHOLE)

    @cached_property
    def _digests(self) -> Digests:
        return Digests(self.base, self.contents)

    @property
    def grows(self) -> bool:
        """Whether further cases follow from words."""
        return True

    @property
    def most(self) -> int:
        """Cases that there may be in the end."""
        return self.family.most

    def name(self, case: int) -> str:
        """Return what a case is called in messages: those beyond have no row yet."""
        if case < len(self.settings):
            return super().name(case)
        address, rule = self.family.address(case), self.refinement
        own = self.family.settings(address)
        told = [f"{name} = {own[name]:.10g}" for name in rule.over]
        preset = [rule.confirm] if address.fidelity else []
        return f"case {', '.join([*told, *preset])}"

    @property
    def beside(self) -> str:
        """What else there is than cases, and nobody counts before words are there."""
        if self.kin is None:
            return ""
        where = {"boundary": " at a boundary", "speckle": " in speckle"}
        of = f"of each case{where.get(self.kin.of, '')}"
        return f", and {self.kin.count} twins {of}, not counted here"

    def split(self, number: int) -> tuple[int, int]:
        """Return the case and the twin, 0 for the case itself, of a number."""
        twin, case = divmod(number, self.family.span)
        return case, twin

    def twins_of(self, case: int) -> range:
        """Return the numbers of a case's twins."""
        count = self.kin.count if self.kin else 0
        return range(case, case + (1 + count) * self.family.span, self.family.span)[1:]

    def twin(self, number: int) -> Job:
        """Return the computation of a twin by its number."""
        case, twin = self.split(number)
        if self.kin is None:
            raise TypeError
        scene = self.scene(case)
        content = self.contents[scene.engine.file]
        scene = self.kin.scene(scene, content, twin)
        facts = {"of": self.digest(case), "twin": twin}
        return Job(case, scene, digest(scene, content), facts=facts)

    def settings_of(self, case: int) -> Settings:
        """Return what a case sets."""
        if case < len(self.settings):
            return self.settings[case]
        return self.family.settings(self.family.address(case))

    def _scene(self, case: int) -> Scene:
        return apply_settings(self.base, self.settings_of(case))

    def digest(self, case: int) -> str:
        """Return the digest of a case, of one that will fail, too."""
        return self._digests.planned(self.settings_of(case))

    def file(self, case: int) -> str:
        """Return the file of a case's engine, "" where it has none."""
        return str(self.settings_of(case).get(FILE, self.base.engine.file))

    def manifest(self) -> Manifest:
        """Return the manifest of the campaign's directory: coarse cases, and rule."""
        kin = self.kin.as_plan() if self.kin else {}
        return replace(super().manifest(), refine=self.refinement.plain(), twins=kin)


def of_rule(coarse: Design, rule: Rule) -> RefinedDesign:
    """Return the design that refines a coarse one by a rule."""
    return RefinedDesign(
        coarse.base, coarse.settings, coarse.swept, coarse.rules,
        coarse.contents, coarse.measure, rule=rule, kin=coarse.twins,
    )  # fmt: skip


def _sent(
    base: Scene,
    settings: Table,
    swept: tuple[str, ...],
    contents: dict[str, str],
    own: tuple[Rule, Twins | None],
) -> RefinedDesign:
    rule, kin = own
    return RefinedDesign(base, settings, swept, contents=contents, rule=rule, kin=kin)


def mean_seconds(design: RefinedDesign) -> tuple[float, float]:
    """Return the mean predicted seconds of coarse cases, by each fidelity."""
    from hpcwhirl.campaign.plan.cost import predicted

    def mean(cases: Iterable[int]) -> float:
        found = [predicted(design, case)[1] for case in cases]
        return sum(found) / len(found)

    first = mean(range(len(design.settings)))
    if not design.refinement.confirm:
        return first, first
    family = design.family
    again = [family.number(a._replace(fidelity=1)) for a in family.coarse]
    return first, mean(again)
