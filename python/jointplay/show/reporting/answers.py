"""What a report is made of: the answers to all questions that the file allows, and why others were not asked."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses import (
    allow,
    assemble,
    check,
    compensate,
    forces,
    life,
    loaded,
    pressed,
    random,
    region,
    singularities,
    structural,
    worst,
)
from jointplay.analyses import map as maps
from jointplay.analyses.displaced import Displaced, shifts
from jointplay.analyses.nominal import Nominal, Progress, carried, nominal
from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.compile import LENGTHS
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism
from jointplay.model.sizing import sizings, times
from jointplay.result import Result, Variable, blame, parts, size, stack
from jointplay.result.verdict import is_good

#: questions with a verdict, in the order in which they are told
JUDGED = ("worst", "loaded", "random", "structural", "forces")
#: specimens per configuration, and of an over-constrained mechanism, of which each takes ten times as long
SAMPLES, STRAINED = 32_768, 8192
#: factors of all clearances and tolerances against which the error is drawn
FACTORS = (0.0, 0.5, 1.0, 1.5, 2.0)
#: the same of an over-constrained mechanism, of which each takes ten times as long, and from how many starts
STRAINED_FACTORS, STRAINED_STARTS = (0.0, 1.0, 2.0), 6
#: specimens that are drawn as points
CLOUD = 300
#: configurations between which the slider of the page moves
MOST_SHOWN = 121
#: directions in which the region is looked for: enough for a drawing
IN_PLANE, IN_SPACE = 36, 66
#: the same for an over-constrained mechanism
STRAINED_IN_PLANE, STRAINED_IN_SPACE = 24, 42
#: sizes that are tried for all outputs of a page to find how large they may be; none of another source after that
LOOKS_IN_PLANE, LOOKS_IN_SPACE = 30, 24
#: nodes of a map that a reader waits for, and the most where each of them is a search
MOST_NODES, MOST_SEARCHED = 1500, 200
#: part of the largest error to which errors of the same offsets agree
SAME = 1e-6


@dataclass
class Chapter:
    """The answers about one output."""

    #: with this output only
    m: Mechanism
    #: its name; empty where the file has one output
    output: str
    at: Nominal
    #: by question
    results: dict[str, Result] = field(default_factory=dict)
    #: by question why it was not asked
    reasons: dict[str, str] = field(default_factory=dict)
    #: errors of some specimens, shape (configuration, specimen, axis), in units of the file
    cloud: Floats | None = None
    #: pictures that all chapters of a page have in common, by what they are of
    shared: dict[object, str] = field(default_factory=dict)

    def parts(self, question: str) -> list[tuple[str, Result]]:
        """The answer to a question, load case by load case, each with what it is called."""
        return parts(self.results[question]) if question in self.results else []


@dataclass
class Answers:
    """The answers about a mechanism."""

    m: Mechanism
    samples: int
    seed: int
    check: Result
    chapters: list[Chapter]
    assembly: Result | None = None
    map: Result | None = None

    @property
    def is_good(self) -> bool:
        """Whether all configurations are ok and no limit is missed."""
        judged = [c.results[name] for c in self.chapters for name in JUDGED if name in c.results]
        has_forces = all("forces" in chapter.results for chapter in self.chapters)
        return all(map(is_good, judged)) and (has_forces or not self.m.limits.forces)


def ask(m: Mechanism, samples: int | None, seed: int, progress: Progress | None = None) -> Answers:
    """Ask all questions that the file allows; without a number of `samples` of as many as `usual` says.

    Raises
    ------
    InputError
        When there is no configuration to ask about.
    """
    samples = usual(m) if samples is None else samples
    at = nominal(m.first)
    if not np.isfinite(at.poses).all(axis=(1, 2)).any():
        raise InputError("no configuration can be assembled; `jointplay solve` says where it stays open", file=m.file)
    chapters = []
    shared: dict[object, str] = {}
    for name in m.outputs or ("",):
        own = m.only(name or None, None)
        first = own.first
        place = at if first.of == m.first.of else carried(at, m.first, first)
        chapters.append(Chapter(own, name, place, shared=shared))
    asked = [_questions(chapter, samples, seed, 1.0 / len(chapters)) for chapter in chapters]
    steps = sum(map(len, asked)) + 2
    done = 0

    def step() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, steps)

    for chapter, questions in zip(chapters, asked, strict=True):
        _ask(chapter, questions, seed, step)
    answers = Answers(m, samples, seed, check.compute(m), chapters)
    if m.assembly is not None:
        answers.assembly = assemble.compute(m.first)
    step()
    if m.data.grid is not None:
        try:
            answers.map = _map(m)
        except InputError as problem:
            chapters[0].reasons["map"] = str(problem.problem)
    step()
    return answers


def _questions(chapter: Chapter, samples: int, seed: int, share: float) -> Mapping[str, Callable[[], Result]]:
    """What is asked about an output, which has a share of what a reader waits for."""
    m, first = chapter.m, chapter.m.first
    wears = any(joint.wears is not None for joint in m.data.joints.values())
    return {
        "worst": lambda: worst.compute(m),
        "loaded": lambda: loaded.compute(m),
        "random": lambda: random.compute(m, samples, seed, few=pressed.FEWER),
        "compensate": lambda: compensate.compute(m),
        "region": lambda: region.compute(first, directions=directions(first), at=chapter.at),
        "sizes": lambda: _sizes(first, chapter.results.get("worst")),
        "singularities": lambda: singularities.compute(first),
        "allow": lambda: _allowed(first, chapter.results.get("worst"), share),
        **({"life": lambda: life.compute(m)} if wears else {}),
        **({"forces": lambda: forces.compute(m)} if m.limits.forces else {}),
        **({"structural": lambda: structural.compute(m)} if m.has_target else {}),
    }


def usual(m: Mechanism) -> int:
    """Specimens per configuration: fewer where each takes long, unless a yield is required, which they have to show."""
    return SAMPLES if m.first.core.isostatic or np.isfinite(m.limits.probability) else STRAINED


def directions(m: Mechanism) -> int:
    """In how many directions the region of the error is looked for."""
    in_plane, in_space = (IN_PLANE, IN_SPACE) if m.core.isostatic else (STRAINED_IN_PLANE, STRAINED_IN_SPACE)
    return in_plane if m.pose_size != poses.SPATIAL else in_space


def _ask(chapter: Chapter, questions: Mapping[str, Callable[[], Result]], seed: int, step: Callable[[], None]) -> None:
    for name, question in questions.items():
        try:
            chapter.results[name] = question()
        except InputError as problem:
            chapter.reasons[name] = str(problem.problem)
        step()
    if "random" in chapter.results:
        chapter.cloud = specimens(chapter.m.first, chapter.at, seed)


def _allowed(m: Mechanism, known: Result | None, share: float) -> Result:
    """The largest sizes, those of the sources first that make most of the largest error, until enough were tried."""
    names: list[str] = []
    if known is not None:
        found = blame(parts(known)[0][1])
        shares = np.nanmax([np.abs(found.position), np.abs(found.rotation)], axis=(0, 1), initial=0.0)
        names = [found.causes[k] for k in np.argsort(-shares, kind="stable")]
    looks = LOOKS_IN_PLANE if m.pose_size != poses.SPATIAL else LOOKS_IN_SPACE
    return allow.compute(m, looks=max(1, round(share * looks)), first=names)


def _sizes(m: Mechanism, known: Result | None) -> Result:
    """The worst error with all sizes of the file times a factor; with the sizes as they are it may be known."""
    base, sources = sizings(m)
    if not times(sources, 0.5):
        raise InputError("the file has no clearance and no tolerance whose size could be changed")

    def at(factor: float) -> Result:
        if factor == 1.0 and known is not None:
            return known
        return worst.compute(base.with_(times(sources, factor)), starts=starts)

    is_quick = m.core.isostatic
    factors, starts = (FACTORS, worst.STARTS) if is_quick else (STRAINED_FACTORS, STRAINED_STARTS)
    found = [*map(at, factors)]
    along = Variable(("factor",), np.array(factors), "", "factor of all sizes")
    return stack(found, along, {**found[-1].attrs, "sweep": "factor"})


def _map(m: Mechanism) -> Result:
    """The error over the grid of the file, on so many of its nodes as a reader waits for.

    It is the error under load; without loads the largest one.
    """
    is_quick = m.has_loads and m.first.core.isostatic
    grid = thinned(m, MOST_NODES if is_quick else MOST_SEARCHED)
    found = maps.compute(m, "loaded", grid, details=False) if m.has_loads else maps.compute(m, "worst", grid)
    assert found is not None
    return found


def thinned(m: Mechanism, most: int) -> dict[str, Any]:
    """The grid of the file with evenly chosen nodes of every axis, so that there are not more than so many."""
    assert m.data.grid is not None
    nodes = {name: np.array(along.nodes) for name, along in m.data.grid.items()}
    axes = sorted((name for name in nodes if len(nodes[name]) > 1), key=lambda name: len(nodes[name]))
    grid: dict[str, Any] = {name: float(values[0]) for name, values in nodes.items() if len(values) == 1}
    chosen, left = {}, float(most)
    for k, name in enumerate(axes):
        # What a short axis does not need is left to the others.
        count = min(len(nodes[name]), max(2, math.floor(left ** (1.0 / (len(axes) - k)))))
        picks = np.unique(np.linspace(0, len(nodes[name]) - 1, count).round().astype(int))
        chosen[name] = nodes[name][picks].tolist()
        left /= count
    return {name: grid.get(name, chosen.get(name)) for name in nodes}


def specimens(m: Mechanism, at: Nominal, seed: int = 0) -> Floats | None:
    """Position errors of some specimens, the same ones in every configuration, in units of the file."""
    if not m.core.isostatic:
        return None
    axes = sum(name in LENGTHS for name in m.components)
    drawn = m.core.specimens(CLOUD, seed)
    found = np.full((len(at), CLOUD, axes), np.nan)
    for k, (drives, placed) in enumerate(zip(at.drives, at.poses, strict=True)):
        if np.isfinite(placed).all():
            every = np.tile(placed, (CLOUD, 1, 1))
            errors = m.core.given(np.tile(drives, (CLOUD, 1)), every, drawn)["error"]
            found[k] = errors[:, :axes] / m.units.length
    return found


def reproduces(m: Mechanism, at: Nominal, result: Result, moved: Displaced) -> bool:
    """Whether a displaced mechanism has the errors of a result: `error`, or those of `worst`."""
    own = shifts(m, at, moved)
    wanted = size(result, "error", "position") if "error" in result.data else result.get("worst_position")
    both = np.isfinite(own) & np.isfinite(wanted)
    # What is elastic gives way under a load, which offsets alone do not tell.
    return bool(both.any() and np.allclose(own[both], wanted[both], rtol=SAME, atol=SAME * float(wanted[both].max())))


def shown(count: int) -> NDArray[np.intp]:
    """Which configurations the slider of the page has: all, or evenly chosen ones."""
    return np.unique(np.linspace(0, count - 1, min(count, MOST_SHOWN)).round().astype(np.intp))
