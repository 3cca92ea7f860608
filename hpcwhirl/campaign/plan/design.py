"""The cases of a campaign: read from a TOML file, with all combinations of its inputs.

`Design` holds them without making each scene beforehand; the tables sweep, zip, cases,
sample, refine, twins and branch say which cases there are.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl import __version__
from hpcwhirl.campaign.plan.branching import BRANCH, HISTORY, axes_with_branches
from hpcwhirl.campaign.plan.refine import first_inputs, refined
from hpcwhirl.campaign.plan.sampling import (
    Sample,
    Twins,
    check_scenes,
    check_spread,
    sample_of,
    sampled_rows,
    twins_of,
)
from hpcwhirl.errors import CaseError, InputError, WhirlError, one_line, shown
from hpcwhirl.planner.kinds import at_boundary
from hpcwhirl.planner.planner import JobCode
from hpcwhirl.refinement.rule import Family, Rule
from hpcwhirl.scene import (
    DESIGN_TABLES,
    Scene,
    apply_settings,
    content_digest,
    flatten,
    load_document,
    preset_in,
    scene_of_document,
    title_of,
)
from hpcwhirl.scene.batch_validation import Many
from hpcwhirl.scene.campaign_tables import Campaign, Refine
from hpcwhirl.scene.case_digest import PHYSICS_VERSION, read_as
from hpcwhirl.scene.case_list import listed_cases
from hpcwhirl.scene.digests import CaseDigests, Digests, takes_real
from hpcwhirl.scene.documents import naming_lines
from hpcwhirl.scene.input_names import FILE, Value, full_name
from hpcwhirl.scene.plain_data import with_reals
from hpcwhirl.scene.quantities import WHOLE
from hpcwhirl.scene.swept import check_count, swept_values
from hpcwhirl.scene.table import Block, OfCases, Table, listed
from hpcwhirl.scene.table_model import anchored
from hpcwhirl.store.directory.manifest import (
    CONTENT,
    FINGERPRINT,
    MEASURE,
    PHYSICS,
    SAMPLE,
    Manifest,
)

if TYPE_CHECKING:
    from hpcwhirl.campaign.measure import Measure
    from hpcwhirl.case.resolve import Case

Settings = dict[str, Value]
MOST_KEPT = 64  # cached cases, each with a model of up to some MB
ALLOWED = "a Design, a TOML file, a mapping of its tables, or a Scene"
MOST_TOLD = 200  # largest number of characters of the inputs that two cases share


class Scenes(OfCases[Scene]):
    """Sequence of the scenes of all cases of a design, each made when accessed."""

    def __init__(self, base: Scene, settings: Sequence[Settings]) -> None:
        self.base, self.settings = base, settings

    def __len__(self) -> int:
        """Return the number of cases of the design."""
        return len(self.settings)

    def _of_case(self, case: int) -> Scene:
        """Return the scene of the case with number `case`."""
        return apply_settings(self.base, self.settings[case])


@dataclass(frozen=True)
class Design:
    """The cases of a campaign.

    Attributes
    ----------
    base : scene with the inputs that are not swept
    settings : {dotted input: value} of each case, in the order of the dimension `case`
    swept : dotted names of the swept inputs, in the order of the file
    rules : the table [campaign]; no result depends on it
    contents : {engine file: SHA-256} when the design was made; part of the digests
    begun : inputs in the plan that an existing directory stores; not sent to other
        ranks
    measure : a user's own function of a case; not sent to other ranks
    sample : how inputs were drawn; not sent to other ranks
    twins : the table [twins]; None: there is no such table
    rule : rule by which refined cases follow from regimes; None: no refinement. With a
        rule, `scenes`, `settings` and `digests` are those of the coarse cases (those of
        [sweep]), and the number of a refined case follows from its address, see
        `Family.number`
    """

    base: Scene
    settings: Table
    swept: tuple[str, ...]
    rules: Campaign = field(default_factory=Campaign)
    contents: dict[str, str] = field(default_factory=dict)
    measure: Measure | None = None
    sample: Sample | None = None
    twins: Twins | None = None
    rule: Rule | None = None
    begun: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Compute the digests of those engine files whose digest was not given."""
        own = self.base.engine.file
        files = listed(self.settings.column(FILE, own).values)
        for file in dict.fromkeys([*files, own]):
            if file not in self.contents:
                self.contents[file] = content_digest(file)

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to pickle the design for other ranks: only what they need."""
        make = partial(Design, contents=self.contents, twins=self.twins, rule=self.rule)
        return make, (self.base, self.settings, self.swept)

    @property
    def scenes(self) -> Scenes:
        """The scenes of all cases, each with all inputs."""
        return Scenes(self.base, self.settings)

    @cached_property
    def columns(self) -> Many:
        """The inputs of all cases as arrays over the cases, one for each input."""
        return Many(self.base, self.settings)

    @classmethod
    def of(
        cls,
        source: Design | Scene | Mapping[str, Any] | Path | str | None = None,
        settings: Mapping[str, Any] | None = None,
    ) -> Design:
        """Return the cases that a TOML file, a mapping of its tables or a scene gives.

        Parameters
        ----------
        source : a TOML file; or a mapping of its tables, such as {"scene": {"gap":
            1e-4}, "sweep": {"speed": numpy.linspace(100, 500, 41)}}; or a scene, which
            is one case; None: the default campaign
        settings : {input: value}, set on the scene, as `--set` does

        Raises
        ------
        InputError
            naming the input, its value and what is allowed
        """
        return _design_given(source, plain(settings or {}))

    @classmethod
    def one(cls, scene: Scene) -> Design:
        """Return the design of a campaign of one case, with its present engine file."""
        return cls(scene, Table.of([{}]), ())

    @cached_property
    def digests(self) -> CaseDigests:
        """Digest of each planned case: a text that identifies its inputs and engine.

        It is the same on any rank at any time.
        """
        reads = {file: read_as(content) for file, content in self.contents.items()}
        return CaseDigests(flatten(self.base), self.settings, reads, PHYSICS_VERSION)

    @property
    def grows(self) -> bool:
        """Whether the campaign is refined: words of cases may add further cases."""
        return self.rule is not None

    def check_shards(self, none: str) -> None:
        """Raise InputError if the parts of a campaign cannot be computed independently.

        none : text for the message that names the options refused, such as --shard
        """
        twins = self.twins
        late = f"[twins] of = {twins.of}" if twins and twins.is_late else ""
        needs = "[refine]" if self.grows else late
        if needs:
            msg = f"{needs} needs the words of all cases: "
            raise InputError(f"{msg}{none}; use one job with more ranks instead")
        if self.is_branched:
            msg = "[branch] begins each case where the preceding one ended: "
            raise InputError(f"{msg}{none}; use one job with more ranks instead")

    @property
    def is_branched(self) -> bool:
        """Whether cases begin with the last motion of others, by table [branch]."""
        return HISTORY in self.settings.names

    @cached_property
    def family(self) -> Family:
        """All cases that a refined campaign may have, see `Family`."""
        if self.rule is None:
            raise TypeError
        return Family(self.rule, self.settings, WHOLE)

    @property
    def most(self) -> int:
        """Largest number of cases that the campaign may have, with all refined ones."""
        return self.family.most if self.grows else len(self.settings)

    @property
    def code(self) -> JobCode:
        """The numbering of jobs, by which rank 0 sends them to other ranks."""
        cases = self.family.span if self.grows else len(self.settings)
        return JobCode(cases, self.twins.count if self.twins else 0)

    def name(self, case: int) -> str:
        """Return a case's name in messages: its number, or inputs if it is refined."""
        if self.rule is None or case < len(self.settings):
            return f"case {case}"
        own = self.settings_of(case)
        told = [f"{name} = {own[name]:.10g}" for name in self.rule.over]
        again = self.family.address(case).fidelity
        return f"case {', '.join([*told, *([self.rule.confirm] if again else [])])}"

    def settings_of(self, case: int) -> Settings:
        """Return {input: value} of the swept inputs of a case, by its number."""
        if case < len(self.settings):
            return self.settings[case]
        return self.family.settings(self.family.address(case))

    @cached_property
    def scene(self) -> Callable[[int], Scene]:
        """The function that returns the scene of a case by its number, cached."""
        real = all(map(takes_real, self.settings.names))

        def scene(case: int) -> Scene:
            own = self.settings_of(case)
            if real and case < len(self.settings):
                return with_reals(self.base, own)
            return apply_settings(self.base, own)

        return lru_cache(MOST_KEPT)(scene)

    @cached_property
    def _digests(self) -> Digests:
        return Digests(self.base, self.contents)

    def digest(self, case: int) -> str:
        """Return the digest of a case, planned or refined, by its number.

        It is the same on any rank at any time.
        """
        if case < len(self.settings):
            return self.digests[case]
        return self._digests.planned(self.settings_of(case))

    def check_engine(self, case: int) -> None:
        """Raise CaseError if the engine file of a case has changed meanwhile.

        case : number of the case

        Raises
        ------
        CaseError, MissingFileError
            naming the file
        """
        file = self.file(case)
        if file and content_digest(file) != self.contents[file]:
            msg = f"{FILE} {file} has changed since the campaign was begun: "
            how = "restore the file and --retry failed, or begin another campaign"
            raise CaseError(msg + how)

    def resolved(self, case: int) -> Case:
        """Return a case with its model, plan and time step; the last ones are cached.

        Cases with an engine file are not cached, since the file may change.
        """
        return self._resolved(case) if self.file(case) else self._kept(case)

    @cached_property
    def _kept(self) -> Callable[[int], Case]:
        return lru_cache(MOST_KEPT)(self._resolved)

    def _resolved(self, case: int) -> Case:
        from hpcwhirl.case.resolve import resolve  # imports SciPy, too slow for --help

        return resolve(self.scene(case))

    def file(self, case: int) -> str:
        """Return the engine file of a case, by its number; "" if it has none."""
        if FILE not in self.settings.names:
            return self.base.engine.file
        return str(self.settings_of(case).get(FILE, self.base.engine.file))

    def predicted(self, case: int) -> tuple[float, float]:
        """Return (predicted number of time steps, predicted kernel time, s) of a case.

        Both are 0 for a case that cannot be integrated and so fails at once.
        """
        try:
            resolved = self.resolved(case)
            known = resolved.steps, resolved.cost
        except WhirlError:  # this case will fail
            return 0.0, 0.0
        return known

    def mean_seconds(self, rule: Rule) -> tuple[float, float]:
        """Return the mean predicted kernel time of a coarse case (case of [sweep]), s.

        There are two: for its first computation (fidelity 0), and for the repetition
        with the preset `confirm` of the rule (fidelity 1); they are the same if `rule`
        has no such preset.
        """
        refined = replace(self, rule=rule)

        def mean(cases: Iterable[int]) -> float:
            found = [refined.predicted(case)[1] for case in cases]
            return sum(found) / len(found)

        first = mean(range(len(self.settings)))
        if not rule.confirm:
            return first, first
        family = refined.family
        again = [family.number(a._replace(fidelity=1)) for a in family.coarse]
        return first, mean(again)

    def manifest(self) -> Manifest:
        """Return the plan of the campaign, which its directory stores."""
        file = self.base.engine.file
        content: dict[str, Any] = {CONTENT: self.contents[file]} if file else {}
        content[PHYSICS] = PHYSICS_VERSION
        if self.measure:
            content[MEASURE] = self.measure.plan()
            content[FINGERPRINT] = self.measure.fingerprint
        if self.sample:
            content[SAMPLE] = self.sample.plan()
        return Manifest(
            engine=title_of(self.base.engine.name, self.base.engine.file),
            base=self.begun | flatten(self.base) | content,
            swept=list(self.swept),
            digests=self.digests,
            settings=self.settings,
            version=__version__,
            twins=self.twins.as_plan() if self.twins else {},
            refine=self.rule.plain() if self.rule else {},
        )


def _design_given(source: Any, settings: Mapping[str, Any]) -> Design:
    """Return the cases of a campaign from any source that `Design.of` accepts.

    Parameters
    ----------
    source : a `Design`, a TOML file, a mapping of its tables or a scene
    settings : {input: value}, set on the scene
    """
    if isinstance(source, Design):
        if settings:
            msg = f"a Design takes no further settings, got {shown(settings)}"
            raise InputError(msg)
        return source
    if isinstance(source, Scene):
        return Design.one(apply_settings(source, settings))
    if source is None or isinstance(source, Path | str):
        return load_design(Path(source) if source is not None else None, settings)
    if isinstance(source, Mapping):
        return design_of(plain(source), settings)
    raise InputError(f"design must be {ALLOWED}, got {shown(source)}")


def plain(value: Any) -> Any:
    """Return a value with NumPy arrays and numbers replaced by Python's own types.

    The result has only the types of parsed TOML; mappings and lists are converted
    inside.
    """
    if isinstance(value, Mapping):
        return {str(name): plain(one) for name, one in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple | range):
        return [plain(one) for one in value]
    return str(value) if isinstance(value, Path) else value


def load_design(path: Path | None, settings: Mapping[str, Value]) -> Design:
    """Return the cases of a campaign from a TOML file, or of the default campaign.

    Parameters
    ----------
    path : a file with the tables scene, engine, solver, output (one scene), sweep, zip,
        cases, sample, refine, twins, branch and campaign; None: the default
    settings : {input: value}, set on the scene; a swept input cannot be set
    """
    if path is None:
        text = resources.files("hpcwhirl.campaign").joinpath("default.toml").read_text()
        return design_of(tomllib.loads(text), settings)
    with naming_lines(path, settings):
        return design_of(load_document(path), settings, path.parent)


def design_of(
    document: Mapping[str, Any],
    settings: Mapping[str, Value] | None = None,
    folder: Path | str = "",
) -> Design:
    """Return the cases of a campaign from its parsed TOML.

    Parameters
    ----------
    document : the parsed TOML, see `load_design`
    settings : {input: value}, set on the scene; a swept input cannot be set
    folder : folder of the TOML file, at which relative paths in it start
    """
    table = document.get("refine")
    refine = None if table is None else Refine.read(table, "[refine]")
    first = first_inputs(document, refine, settings or {})
    own = {**first, **(settings or {})}
    base = scene_of_document(document, DESIGN_TABLES, folder, own)
    grid, zipped = swept_values(document, "sweep"), swept_values(document, "zip")
    explicit = listed_cases(document.get("cases", []), folder)
    axes = axes_with_branches(document, grid, zipped)
    product = [Block(axes)] if axes or not explicit else []
    rows = _anchored(Table([*product, *explicit.blocks]), folder)
    sample = sample_of(document)
    rows = sampled_rows(sample, rows, base)
    swept = tuple(name for name in rows.names if name != HISTORY)
    _check_unset(swept, map(full_name, settings or {}), "--set or --preset")
    _check_unset(swept, preset_in(document), "[solver] preset:")
    _check_unset(swept, first, "[refine] first:")
    check_count(len(rows), "got")
    twins = twins_of(document)
    if twins:
        _check_twins(twins, base, rows)
    check_scenes(base, rows, sample)
    rules = Campaign.read(document.get("campaign", {}), "[campaign]")
    design = Design(base, rows, swept, rules, sample=sample, twins=twins)
    _check_distinct(design.columns)
    if refine:
        branch = axes[-1].names[0] if BRANCH in document else ""
        return replace(design, rule=refined(design, refine, grid, explicit, branch))
    return design


def _anchored(rows: Table, folder: Path | str) -> Table:
    """Return the cases with absolute paths of their engine files.

    Parameters
    ----------
    rows : {input: value} of each case
    folder : folder at which relative paths start
    """
    if FILE not in rows.names:
        return rows
    return rows.mapped(
        FILE, lambda file: anchored(file, folder) if isinstance(file, str) else file
    )


def _check_twins(twins: Twins, base: Scene, rows: Table) -> None:
    """Raise InputError for twins equal to their case, or without a boundary to be at.

    Parameters
    ----------
    twins : table [twins]; `of = "boundary"` needs cases that differ in one number alone
    base : scene with the inputs that are not swept
    rows : {input: value} of each case
    """
    check_spread(twins, base, rows)
    if twins.of != "boundary":
        return
    if not at_boundary(rows, rows.names, np.arange(len(rows))).any():
        msg = "[twins] of = boundary: no two cases differ in one number alone, as cases"
        raise InputError(msg + " of a [sweep] over numbers do")


def _check_unset(swept: Iterable[str], names: Iterable[str], what: str) -> None:
    """Raise InputError if an input is both swept and set for all cases.

    Parameters
    ----------
    swept : names of the swept inputs
    names : names of the inputs set for all cases
    what : text for the message on where these are set
    """
    clash = set(swept) & set(names)
    if clash:
        raise InputError(f"{what} {min(clash)}: the campaign sweeps this input")


def _check_distinct(columns: Many) -> None:
    """Raise InputError if two cases of a design have the same inputs.

    columns : the inputs of all cases
    """
    found = columns.twice()
    if found:
        both = columns.table[found[0]].items()
        same = ", ".join(f"{name} = {shown(value)}" for name, value in both)
        msg = f"cases {found[0]} and {found[1]} have the same inputs: "
        raise InputError(msg + one_line(same, MOST_TOLD))
