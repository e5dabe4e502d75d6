"""The subcommands that say how far off the output is, and correct the drives."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from . import answer, arguments
from .belonging import refuse_unheard
from .drawing import NO_FIGURE, Figure, with_figure
from .options import (
    Assumed,
    Certify,
    Correctable,
    File,
    LoadCase,
    Offset,
    Output,
    Parts,
    Point,
    Points,
    Question,
    Rare,
    Samples,
    Sampling,
    Scatter,
    Scheduler,
    Seed,
    Settings,
    Shares,
    Sized,
    Sizes,
    Target,
)
from .printing import prints

if TYPE_CHECKING:
    from jointplay.model import Mechanism
    from jointplay.result import Result


@prints()
@with_figure("panel", "configuration", "quantity")
def error(
    file: File,
    question: Annotated[
        list[Question] | None,
        typer.Option("--question", "-q", help="Which question; if left out: loaded, worst and random."),
    ] = None,
    offset: Offset = None,
    samples: Samples = 131_072,
    seed: Seed = 0,
    law: Scatter = None,
    sampling: Points = Sampling.sobol,
    contact: Assumed = None,
    indices: Shares = False,
    rare: Rare = False,
    certify: Certify = False,
    parts: Parts = 100,
    scheduler: Scheduler = None,
    sizes: Sizes = Sized.middle,
    output_point: Point = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: Output = None,
    plot: Figure = NO_FIGURE,
) -> int:
    """Say how far off the output is, and which joint is to blame.

    loaded: where the load pushes it. worst: the largest error that the clearances and tolerances allow. random: how it
    scatters from specimen to specimen. given: the error for given offsets (--offset), else for those of the largest
    position error; asked only where it is named, or with --offset.

    Exit code 1: some configuration is not ok, or a limit of the file is missed or not shown to hold (by random only
    where limits.probability asks for a yield).
    """
    from jointplay.analyses import given, loaded, random, worst
    from jointplay.analyses.nominal import within_another

    m = answer.mechanism(file, settings, output_point, load_case)
    put = answer.offsets(m, offset)
    asked = set(question or [Question.all])
    if Question.all in asked:
        asked |= {Question.worst, Question.random} | ({Question.loaded} if m.has_loads else set())
    if put:
        asked.add(Question.given)
    refuse_unheard([which.value for which in Question if which in asked])
    found: dict[str, Result] = {}

    def ask_worst(m: Mechanism, progress: Any) -> Result:
        found["worst"] = worst.compute(m, certify=certify, parts=parts, progress=progress)
        return found["worst"]

    def ask_random(m: Mechanism, progress: Any) -> Result:
        options = answer.scatter(samples, seed, law, sampling) | {
            "contact": contact and contact.value,
            "indices": indices,
            "rare": rare,
            "scheduler": scheduler,
        }
        return random.compute(m, **options, progress=progress)

    def ask_given(m: Mechanism, progress: Any) -> Result:
        if put:
            return given.compute(m, put, sizes=sizes.value)
        with within_another():
            worst_of_it = found.get("worst") or ask_worst(m, progress)
        return given.at_worst(m, worst_of_it)

    def ask_loaded(m: Mechanism) -> Result:
        return loaded.compute(m, sizes=sizes.value)

    asks: dict[Question, Callable[..., Result]] = {
        Question.loaded: ask_loaded,
        Question.worst: ask_worst,
        Question.random: ask_random,
        Question.given: ask_given,
    }
    return answer.answer({which.value: ask for which, ask in asks.items() if which in asked}, m, output, plot)


@prints()
@with_figure("panel", "quantity")
def compensate(
    file: File,
    question: Annotated[
        Correctable | None,
        typer.Option("--question", "-q", help="Which error is corrected. [default: given with --offset]"),
    ] = None,
    offset: Offset = None,
    weights: Annotated[
        str | None,
        typer.Option("--weights", metavar="P,R", help="Weights of position and of rotation; R is a length per radian."),
    ] = None,
    target: Target = None,
    output_point: Point = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: Output = None,
    plot: Figure = NO_FIGURE,
) -> int:
    """Correct the drives so that the output returns to its place.

    It comes as near as possible to its nominal pose; what no drive can remove is left. Exit code 1: some configuration
    is not ok, or what is left misses a limit of the file.
    """
    from jointplay.analyses.compensate import compute

    m = answer.mechanism(file, settings, output_point, load_case)
    put = answer.offsets(m, offset)
    which = (question or (Correctable.given if put else Correctable.loaded)).value
    pair: Any = None if weights is None else arguments.numbers(weights, "--weights", (2,), answer.reader(m))
    aim: Any = answer.target(m, target)

    def correct(m: Mechanism) -> Result:
        return compute(m, which, put or None, weights=pair, target=aim)

    return answer.answer({"compensate": correct}, m, output, plot)
