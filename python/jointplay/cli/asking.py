"""The subcommands that say how far off the output is, and correct the drives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jointplay.questions import QUESTIONS, asked_by

from . import answer, arguments
from .belonging import NO_OPTIONS, GivenOptions, asks
from .drawing import NO_FIGURE, FigureFile, with_figure
from .options import File, LoadCase, Offset, OutputPath, PointName, Settings, Target
from .printing import prints

if TYPE_CHECKING:
    from jointplay.model.mechanism import Mechanism
    from jointplay.result import Result

#: all questions that need nothing more than the file
ALL = "all"


@prints()
@with_figure("panel", "configuration", "quantity", "against")
@asks(
    "error",
    "Which question; if left out: loaded, worst, random, and structural where there is a target.",
    None,
    *(
        "offset",
        "samples",
        "seed",
        "law",
        "sampling",
        "contact",
        "indices",
        "rare",
        "keep",
        "keep_outside",
        "certify",
        "parts",
    ),
    *("scheduler", "sizes", "approach"),
    own=(ALL,),
    several=True,
)
def error(
    file: File,
    question: Sequence[str] = (),
    options: GivenOptions = NO_OPTIONS,
    output_point: PointName = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: OutputPath = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Say how far off the output is, and which joint is to blame.

    loaded: where the load pushes it. worst: the largest error that the clearances and tolerances allow. random: how it
    scatters from specimen to specimen. given: the error for given offsets (--offset), else for those of the largest
    position error; asked only where it is named, or with --offset. structural: how far it is without play from what
    the [target] of the file asks. Where the file limits forces, `forces` is asked as well.

    Exit code 1: some configuration is not ok, or a limit of the file is missed or not shown to hold (by random only
    where limits.probability asks for a yield).
    """
    from jointplay.analyses import forces
    from jointplay.analyses.given import at_worst
    from jointplay.analyses.nominal import within_another
    from jointplay.analyses.questions import computation

    m = answer.mechanism(file, settings, output_point, load_case)
    known = {name: options.of(m, name) for name in asked_by("error")}
    put = {name for name, own in known.items() if own.get("offsets")}
    named = {*(question or [ALL]), *put}

    def is_asked(name: str) -> bool:
        usual = "offsets" not in known[name] and (m.has_loads or not QUESTIONS[name].needs_loads)
        usual &= m.has_target or not QUESTIONS[name].needs_target
        return name in named or (ALL in named and usual)

    asked = [name for name in known if is_asked(name)]
    options.refuse_unheard(*asked)
    asks: dict[str, Callable[..., Result]] = {
        name: partial(computation(name, "error"), **own) for name, own in known.items()
    }
    known_worst = asks["worst"]
    worst: list[Result] = []

    def ask_worst(m: Mechanism, progress: Any) -> Result:
        worst[:] = worst or [known_worst(m, progress=progress)]
        return worst[0]

    def ask_at_worst(m: Mechanism, progress: Any) -> Result:
        with within_another():
            of_worst = ask_worst(m, progress)
        return at_worst(m, of_worst)

    asks["worst"] = ask_worst
    asks |= {name: ask_at_worst for name, own in known.items() if "offsets" in own and name not in put}
    if ALL in named and forces.is_judged(m):
        asks["forces"] = forces.compute
        asked.append("forces")
    return answer.answer({name: asks[name] for name in asked}, m, output, plot)


@prints()
@with_figure("panel", "quantity", "against")
@asks("compensate", "Which error is corrected. [default: given with --offset]", None)
def compensate(
    file: File,
    question: str | None = None,
    offset: Offset = None,
    weights: Annotated[
        str | None,
        typer.Option("--weights", metavar="P,R", help="Weights of position and of rotation; R is a length per radian."),
    ] = None,
    target: Target = None,
    one_table: Annotated[
        bool,
        typer.Option(
            "--one-table", help="loaded: the same drive values in all load cases; the largest error is made least."
        ),
    ] = False,
    output_point: PointName = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: OutputPath = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Correct the drives so that the output returns to its place.

    It comes as near as possible to its nominal pose; what no drive can remove is left. worst: the largest error that
    the clearances and tolerances allow is made least. Exit code 1: some configuration
    is not ok, or what is left misses a limit of the file.
    """
    from jointplay.analyses.compensate import compute

    m = answer.mechanism(file, settings, output_point, load_case)
    put = answer.offsets(m, offset)
    which = question or ("given" if put else "loaded")
    pair: Any = None if weights is None else arguments.numbers(weights, "--weights", (2,), answer.reader(m))
    aim: Any = answer.target(m, target)
    correct = partial(compute, question=which, offsets=put or None, weights=pair, target=aim, one_table=one_table)
    return answer.answer({"compensate": correct}, m, output, plot)
