"""Which cases a campaign has: grids, zips and lists of any scene input, in TOML."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl import __version__
from hpcwhirl.campaign.plan.sampling import (
    Sample,
    check_scenes,
    sample_of,
    sampled_rows,
)
from hpcwhirl.campaign.plan.swept import (
    axes_of,
    check_count,
    listed_cases,
    swept_values,
)
from hpcwhirl.campaign.plan.twins import Twins, check_spread, twins_of
from hpcwhirl.errors import CaseError, InputError, as_table, one_line, shown
from hpcwhirl.scene import (
    DESIGN_TABLES,
    Scene,
    apply_settings,
    content_digest,
    flatten,
    load_document,
    preset_in,
    scene_of_document,
)
from hpcwhirl.scene.anchor import anchored
from hpcwhirl.scene.digests import CaseDigests
from hpcwhirl.scene.files import (
    FILE,
    PHYSICS_VERSION,
    Value,
    full_name,
    read_as,
)
from hpcwhirl.scene.many import Many
from hpcwhirl.scene.table import Block, OfCases, Table, listed
from hpcwhirl.store.directory.manifest import (
    CONTENT,
    MARK,
    MEASURE,
    PHYSICS,
    SAMPLE,
    Manifest,
)
from hpcwhirl.store.directory.neighbours import at_boundary

if TYPE_CHECKING:
    from hpcwhirl.campaign.measure import Measure
    from hpcwhirl.case.resolve import Case

Settings = dict[str, Value]
MOST_KEPT = 64  # cases, each with a model of up to some MB where gaps are swept
MOST_TOLD = 200  # letters of what two cases share


class Scenes(OfCases[Scene]):
    """The scenes of a design, each made when it is asked for."""

    def __init__(self, base: Scene, settings: Sequence[Settings]) -> None:
        self.base, self.settings = base, settings

    def __len__(self) -> int:
        """Return the number of cases."""
        return len(self.settings)

    def _of_case(self, case: int) -> Scene:
        """Return the scene of a case."""
        return apply_settings(self.base, self.settings[case])


@dataclass(frozen=True)
class Design:
    """The cases of a campaign.

    Attributes
    ----------
    base : what all cases share but for what is swept
    settings : {dotted input: value} of each case, in the order of the dimension `case`
    swept : dotted names of the swept inputs, in the order of the file
    rules : of the table [campaign]; no result depends on them, see `policy`
    contents : {engine file: SHA-256} as the design was made; cases are known by it
    measure : a user's own function of a case; not sent to others
    sample : how inputs were drawn; not sent to others
    twins : of the table [twins], None for none
    """

    base: Scene
    settings: Table
    swept: tuple[str, ...]
    rules: dict[str, Any] = field(default_factory=dict)
    contents: dict[str, str] = field(default_factory=dict)
    measure: Measure | None = None
    sample: Sample | None = None
    twins: Twins | None = None

    def __post_init__(self) -> None:
        """Read the engines' files that nobody has told the contents of."""
        own = self.base.engine.file
        files = listed(self.settings.column(FILE, own).values)
        for file in dict.fromkeys([*files, own]):
            if file not in self.contents:
                self.contents[file] = content_digest(file)

    def __reduce__(self) -> tuple[Any, ...]:
        """Send what others need of it."""
        sent = self.base, self.settings, self.swept, self.contents, self.twins
        return _sent, sent

    @property
    def scenes(self) -> Scenes:
        """The scene of each case."""
        return Scenes(self.base, self.settings)

    @cached_property
    def columns(self) -> Many:
        """The cases as columns of their inputs."""
        return Many(self.base, self.settings)

    @classmethod
    def of(
        cls,
        source: Design | Scene | Mapping[str, Any] | Path | str | None = None,
        settings: Mapping[str, Any] | None = None,
    ) -> Design:
        """Return the design of a file, a mapping of its tables, or a scene.

        Parameters
        ----------
        source : a TOML file; or what one would hold, such as {"scene": {"gap": 1e-4},
            "sweep": {"speed": numpy.linspace(100, 500, 41)}}; or a scene, which is one
            case; None: the campaign that runs where no file is given
        settings : {input: value}, set on the scene, as `--set` does

        Raises
        ------
        InputError
            naming what is wrong, what was got and what is allowed
        """
        from hpcwhirl.campaign.plan.given import design_given

        return design_given(source, settings)

    @classmethod
    def one(cls, scene: Scene) -> Design:
        """Return the design of one case."""
        return cls(scene, Table.of([{}]), ())

    @cached_property
    def digests(self) -> CaseDigests:
        """Digest of each case, that of the plan on any rank at any time."""
        reads = {file: read_as(content) for file, content in self.contents.items()}
        return CaseDigests(flatten(self.base), self.settings, reads, PHYSICS_VERSION)

    @property
    def beside(self) -> str:
        """What else there is than cases, and nobody counts before words are there."""
        return ""

    @property
    def grows(self) -> bool:
        """Whether further cases follow from words."""
        return False

    @property
    def most(self) -> int:
        """Cases that there may be in the end."""
        return len(self.settings)

    def name(self, case: int) -> str:
        """Return what a case is called in messages."""
        return f"case {case}"

    def scene(self, case: int) -> Scene:
        """Return the scene of a case, one of the last as it was."""
        return self._last_scenes(case)

    @cached_property
    def _last_scenes(self) -> Callable[[int], Scene]:
        return lru_cache(MOST_KEPT)(self._scene)

    def _scene(self, case: int) -> Scene:
        return self.scenes[case]

    def digest(self, case: int) -> str:
        """Return the digest of a case, that of the manifest on any rank at any time."""
        return self.digests[case]

    def check_engine(self, case: int) -> None:
        """Raise where the engine's file of a case is not what was planned.

        Raises
        ------
        CaseError, MissingFileError
            naming the file
        """
        file = self.file(case)
        if file and content_digest(file) != self.contents[file]:
            msg = f"{FILE} {file} has changed since the campaign was begun: put it "
            raise CaseError(msg + "back for --retry failed, or begin another campaign")

    def resolved(self, case: int) -> Case:
        """Return a case, one of the last as it was; of an engine's file always anew.

        That file may have changed meanwhile.
        """
        return self._resolved(case) if self.file(case) else self._kept(case)

    @cached_property
    def _kept(self) -> Callable[[int], Case]:
        return lru_cache(MOST_KEPT)(self._resolved)

    def _resolved(self, case: int) -> Case:
        from hpcwhirl.case.resolve import resolve  # SciPy, for which help waits not

        return resolve(self.scene(case))

    def file(self, case: int) -> str:
        """Return the file of a case's engine, "" where it has none."""
        if FILE not in self.settings.names:
            return self.base.engine.file
        return str(self.settings[case].get(FILE, self.base.engine.file))

    def manifest(self) -> Manifest:
        """Return the manifest that the campaign's directory keeps."""
        file = self.base.engine.file
        content: dict[str, Any] = {CONTENT: self.contents[file]} if file else {}
        content[PHYSICS] = PHYSICS_VERSION
        if self.measure:
            content[MEASURE] = self.measure.plan()
            content[MARK] = self.measure.mark
        if self.sample:
            content[SAMPLE] = self.sample.plan()
        return Manifest(
            engine=self.base.engine.name,
            base=flatten(self.base) | content,
            swept=list(self.swept),
            digests=self.digests,
            settings=self.settings,
            version=__version__,
            twins=self.twins.as_plan() if self.twins else {},
        )


def _sent(
    base: Scene,
    settings: Table,
    swept: tuple[str, ...],
    contents: dict[str, str],
    twins: Twins | None,
) -> Design:
    return Design(base, settings, swept, contents=contents, twins=twins)


def load_design(path: Path | None, settings: Mapping[str, Value]) -> Design:
    """Return the design of a TOML file, or of the embedded default.

    Parameters
    ----------
    path : tables scene, engine, solver, output (one scene), sweep, zip, cases, sample,
        refine, twins and campaign
    settings : {input: value}, set on the scene; a swept input cannot be set
    """
    if path is None:
        text = resources.files("hpcwhirl.campaign").joinpath("default.toml").read_text()
        return design_of(tomllib.loads(text), settings)
    return design_of(load_document(path), settings, path.parent)


def design_of(
    document: Mapping[str, Any],
    settings: Mapping[str, Value] | None = None,
    folder: Path | str = "",
) -> Design:
    """Return the design of a parsed document in `folder`; see `load_design`."""
    from hpcwhirl.campaign.plan.refine import first_inputs, refined  # made of designs

    first = first_inputs(document, settings or {})
    own = {**first, **(settings or {})}
    base = scene_of_document(document, DESIGN_TABLES, folder, own)
    grid, zipped = swept_values(document, "sweep"), swept_values(document, "zip")
    explicit = listed_cases(document.get("cases", []))
    product = [Block(axes_of(grid, zipped))] if grid or zipped or not explicit else []
    rows = _anchored(Table([*product, *Table.of(explicit).blocks]), folder)
    sample = sample_of(document)
    rows = sampled_rows(sample, rows, base)
    swept = rows.names
    _check_unset(swept, map(full_name, settings or {}), "--set or --preset")
    _check_unset(swept, preset_in(document), "[solver] preset:")
    _check_unset(swept, first, "[refine] first:")
    check_count(len(rows), "got")
    twins = twins_of(document, base)
    if twins:
        _check_twins(twins, base, rows)
    check_scenes(base, rows, sample)
    rules = rules_of(document)
    design = Design(base, rows, swept, rules, sample=sample, twins=twins)
    _check_distinct(design.columns)
    if "refine" in document:
        return refined(design, document["refine"], grid, explicit)
    return design


def _anchored(rows: Table, folder: Path | str) -> Table:
    """Return settings whose engines' files are named from a folder."""
    if FILE not in rows.names:
        return rows
    return rows.mapped(
        FILE, lambda file: anchored(file, folder) if isinstance(file, str) else file
    )


def _check_twins(twins: Twins, base: Scene, rows: Table) -> None:
    """Refuse twins that are their case, and boundaries where none are neighbours."""
    check_spread(twins, base, rows)
    if twins.of != "boundary":
        return
    if not at_boundary(rows, rows.names, np.arange(len(rows))).any():
        msg = "[twins] of = boundary: no two cases differ in one number alone, as those"
        raise InputError(msg + " of a [sweep] over numbers do")


def _check_unset(swept: Iterable[str], names: Iterable[str], what: str) -> None:
    """Refuse to set for all cases what they differ in."""
    clash = set(swept) & set(names)
    if clash:
        msg = f"{what} {min(clash)}: the campaign sweeps this input"
        raise InputError(msg)


def rules_of(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table [campaign] of a document; `policy` checks what it holds."""
    return dict(as_table("[campaign]", document.get("campaign", {})))


def _check_distinct(columns: Many) -> None:
    """Refuse two cases of the same inputs; a product of distinct values has none."""
    found = columns.twice()
    if found:
        both = columns.table[found[0]].items()
        same = ", ".join(f"{name} = {shown(value)}" for name, value in both)
        msg = f"cases {found[0]} and {found[1]} have the same inputs: "
        raise InputError(msg + one_line(same, MOST_TOLD))
