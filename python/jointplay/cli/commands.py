"""The subcommands."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from . import DONE, NOT_OK, allocating, animating, answer, arguments, assembling, completing, reporting, serving
from .drawing import NO_FIGURE, Figure, with_figure
from .help import examples
from .options import (
    Allowed,
    Compared,
    Contact,
    Correctable,
    File,
    First,
    LoadCase,
    Mapped,
    Offset,
    Output,
    Point,
    Points,
    Question,
    Samples,
    Sampling,
    Scatter,
    Second,
    Seed,
    Settings,
    Shares,
    Sized,
    Sizes,
    Swept,
    Touching,
)
from .printing import prints

if TYPE_CHECKING:
    from jointplay.model import Mechanism
    from jointplay.result import Result

app = typer.Typer(
    name="jointplay",
    help="How far off is the output of a mechanism with joint clearance, and which joint is to blame?",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback(invoke_without_command=True)
def root(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the version.")] = False,
) -> None:
    """How far off is the output of a mechanism with joint clearance, and which joint is to blame?"""
    if version:
        from jointplay.result import version as installed

        typer.echo(f"jointplay {installed()}")
    elif context.invoked_subcommand is None:
        typer.echo(context.get_help())
    if version:
        raise typer.Exit


@app.command(epilog=examples("new"))
def new(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[NAME]", help="Which example; lists them if left out.", autocompletion=completing.examples
        ),
    ] = None,
    settings: Settings = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="PATH", help="Where to write it; NAME.toml if left out.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
) -> int:
    """Write a bundled example to start from, or list them."""
    import tomllib

    from jointplay import examples as bundled
    from jointplay.write import create

    if name is None:
        titles = {example: bundled.title(example) for example in bundled.names()}
        answer.list_names(titles, f"{len(titles)} examples; `jointplay new NAME` writes one as NAME.toml.")
        return DONE
    text, reached = bundled.changed_text(name, arguments.assignments(settings or (), "--set"))
    answer.say(reached)
    path = output or Path(f"{name}.toml")
    create(text, path, replace=force)
    typer.echo(f"wrote {path}: {tomllib.loads(text)['title']}")
    return DONE


@app.command(epilog=examples("check"))
@prints()
def check(file: File, settings: Settings = None, output: Output = None) -> int:
    """Check parts, motion, and whether it can be assembled."""
    from jointplay.analyses.check import compute

    answer.check_paths(output)
    m = answer.mechanism(file, settings)
    result = compute(m)
    if output is not None:
        answer.save({"check": result}, output)
    else:
        answer.show({"check": result})
    return DONE if result.attrs["assembled"] and result.attrs["decided"] else NOT_OK


@app.command(epilog=examples("solve"))
@prints()
@with_figure("panel", "configuration")
def solve(
    file: File, output_point: Point = None, settings: Settings = None, output: Output = None, plot: Figure = NO_FIGURE
) -> int:
    """Solve the nominal mechanism along its path.

    Says where the output is, which drives a path needs, and how near every configuration is to a singular one.
    """
    from jointplay.analyses.solve import compute

    return answer.answer({"solve": compute}, answer.mechanism(file, settings, output_point), output, plot)


@app.command(epilog=examples("singularities"))
@prints()
@with_figure("panel", "configuration")
def singularities(
    file: File,
    length: Annotated[
        float | None,
        typer.Option("--length", metavar="L", help="Length that counts as a radian. [default: size of the mechanism]"),
    ] = None,
    components: Annotated[
        str | None,
        typer.Option("--components", metavar="x,y,...", help="What of the output has to move; see the manual."),
    ] = None,
    path: Annotated[
        bool, typer.Option("--path/--no-path", help="Look for singularities between the configurations, too.")
    ] = True,
    output_point: Point = None,
    settings: Settings = None,
    output: Output = None,
    plot: Figure = NO_FIGURE,
) -> int:
    """Find how near to a singularity it is, and what moves there.

    Says of which kind the nearest one is, and how far away along the path.
    """
    from jointplay.analyses.singularities import compute

    counted = arguments.words(components)

    def ask(m: Mechanism, progress: Any) -> Result:
        return compute(m, length=length, components=counted, path=path, progress=progress)

    return answer.answer({"singularities": ask}, answer.mechanism(file, settings, output_point), output, plot)


@app.command(epilog=examples("error"))
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
    contact: Touching = Contact.scattered,
    indices: Shares = False,
    rare: Annotated[
        bool, typer.Option("--rare", help="random: search for specimens outside the limits where hardly any are.")
    ] = False,
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

    Exit code 1: some configuration is not ok, or a limit of the file is missed (by random only where
    limits.probability asks for a yield).
    """
    from jointplay.analyses import given, loaded, random, worst

    m = answer.mechanism(file, settings, output_point, load_case)
    put = answer.offsets(m, offset)
    asked = set(question or [Question.all])
    if Question.all in asked:
        asked |= {Question.worst, Question.random} | ({Question.loaded} if m.has_loads else set())
    if put:
        asked.add(Question.given)
    found: dict[str, Result] = {}

    def ask_worst(m: Mechanism, progress: Any) -> Result:
        found["worst"] = worst.compute(m, progress=progress)
        return found["worst"]

    def ask_random(m: Mechanism, progress: Any) -> Result:
        options = answer.scatter(samples, seed, law, sampling) | {
            "contact": contact.value,
            "indices": indices,
            "rare": rare,
        }
        return random.compute(m, **options, progress=progress)

    def ask_given(m: Mechanism, progress: Any) -> Result:
        if put:
            return given.compute(m, put, sizes=sizes.value)
        return given.at_worst(m, found.get("worst") or ask_worst(m, progress))

    def ask_loaded(m: Mechanism) -> Result:
        return loaded.compute(m, sizes=sizes.value)

    asks: dict[Question, Callable[..., Result]] = {
        Question.loaded: ask_loaded,
        Question.worst: ask_worst,
        Question.random: ask_random,
        Question.given: ask_given,
    }
    return answer.answer({which.value: ask for which, ask in asks.items() if which in asked}, m, output, plot)


@app.command(epilog=examples("compensate"))
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
    target: Annotated[
        str | None,
        typer.Option(
            "--target", metavar="X,Y[,ANGLE]", help="Error to reach, in place of zero; in space X,Y,Z[,RX,RY,RZ]."
        ),
    ] = None,
    output_point: Point = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: Output = None,
    plot: Figure = NO_FIGURE,
) -> int:
    """Correct the drives so that the output returns to its place.

    It comes as near as possible to its nominal pose; what no drive can remove is left.
    """
    from jointplay.analyses.compensate import compute

    m = answer.mechanism(file, settings, output_point, load_case)
    put = answer.offsets(m, offset)
    which = (question or (Correctable.given if put else Correctable.loaded)).value
    pair: Any = None if weights is None else arguments.numbers(weights, "--weights", (2,), answer.reader(m))
    aim: Any = None if target is None else arguments.numbers(target, "--target", (2, 3, 6), answer.reader(m))

    def correct(m: Mechanism) -> Result:
        return compute(m, which, put or None, weights=pair, target=aim)

    return answer.answer({"compensate": correct}, m, output, plot)


@app.command(epilog=examples("sweep"))
@prints()
@with_figure("panel", "quantity")
def sweep(
    file: File,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            "-s",
            metavar="KEY=A:B:N",
            help="What is swept: KEY=from:to:count or KEY=1,2,5; KEY=VALUE only sets.",
            autocompletion=completing.keys,
        ),
    ] = None,
    question: Annotated[Swept, typer.Option("--question", "-q", help="What is asked at every value.")] = Swept.worst,
    output_point: Point = None,
    load_case: LoadCase = None,
    offset: Offset = None,
    samples: Samples = 131_072,
    seed: Seed = 0,
    law: Scatter = None,
    sampling: Points = Sampling.sobol,
    contact: Touching = Contact.scattered,
    output: Output = None,
    plot: Figure = NO_FIGURE,
) -> int:
    """Compute the error for every value of something in the file."""
    from jointplay.analyses.sweep import compute

    pairs = arguments.assignments(settings or (), "--set")
    m = answer.mechanism(file, arguments.only_set(pairs), output_point, load_case)
    keys, values = arguments.swept(pairs, answer.reader(m))
    # What a swept key reaches is said once, not again for every value.
    answer.change(m, dict.fromkeys(keys, values[0]))
    options: dict[str, Any] = {}
    if question is Swept.random:
        options = answer.scatter(samples, seed, law, sampling) | {"contact": contact.value}
    if question is Swept.given:
        options = {"offsets": answer.offsets(m, offset)}

    def ask(m: Mechanism, progress: Any) -> Result:
        return compute(m, keys, values, question.value, progress=progress, **options)

    return answer.answer({"sweep": ask}, m, output, plot)


@app.command(epilog=examples("allow"))
@prints()
@with_figure("panel")
def allow(
    file: File,
    question: Annotated[
        Allowed, typer.Option("--question", "-q", help="In which question the limits have to hold.")
    ] = Allowed.worst,
    probability: Annotated[
        float | None,
        typer.Option(
            "--probability",
            metavar="P",
            help="random: share of the specimens that keeps to the limits. [default: that of the file, or 0.9973]",
        ),
    ] = None,
    tolerance: Annotated[
        float, typer.Option("--tolerance", metavar="T", help="Relative tolerance of the sizes.")
    ] = 1e-4,
    samples: Samples = 20_000,
    seed: Seed = 0,
    law: Scatter = None,
    sampling: Points = Sampling.sobol,
    contact: Touching = Contact.scattered,
    sizes: Sizes = Sized.middle,
    output_point: Point = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: Output = None,
    plot: Figure = NO_FIGURE,
) -> int:
    """Find how large every source may be, and the fits to order.

    The limits of the file hold with the largest size of every source, as it is for itself.
    """
    from jointplay.analyses.allow import compute, keeps

    options: dict[str, Any] = {}
    if question is Allowed.random:
        options = answer.scatter(samples, seed, law, sampling) | {"contact": contact.value}
    if question is Allowed.loaded:
        options = {"sizes": sizes.value}
    found: list[Result] = []

    def ask(m: Mechanism, progress: Any) -> Result:
        found.append(
            compute(m, question.value, probability=probability, tolerance=tolerance, progress=progress, **options)
        )
        return found[0]

    m = answer.mechanism(file, settings, output_point, load_case)
    code = answer.answer({"allow": ask}, m, output, plot)
    # What a source alone may be says nothing of the limits as they are.
    return code if not found else DONE if keeps(found[0]) else NOT_OK


@app.command("map", epilog=examples("map"))
@prints(csv=False)
@with_figure(draws="Draw it: .png, .svg, .pdf, or .html for an interactive page.")
def map_(
    file: File,
    grid: Annotated[
        list[str] | None,
        typer.Option(
            "--grid",
            "-g",
            metavar="NAME=A:B:N",
            help="Axis of the map, a drive or x, y, angle of the output; NAME=VALUE holds it. In place of the file's.",
        ),
    ] = None,
    question: Annotated[Mapped, typer.Option("--question", "-q", help="What is asked at every node.")] = Mapped.loaded,
    offset: Offset = None,
    first_order: Annotated[
        bool, typer.Option("--first-order", help="loaded: to first order only, several times faster.")
    ] = False,
    details: Annotated[
        bool,
        typer.Option(
            "--details/--no-details", help="loaded: reactions, offsets and shares of the sources at every node, too."
        ),
    ] = True,
    samples: Samples = 1_024,
    seed: Seed = 0,
    law: Scatter = None,
    sampling: Points = Sampling.sobol,
    contact: Touching = Contact.scattered,
    output_point: Point = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="PATH", help="Write it in chunks, to .zarr or .nc; run again, it continues."
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace something else at the path.")] = False,
    chunk: Annotated[
        int | None, typer.Option("--chunk", metavar="N", help="Nodes that are computed at a time.")
    ] = None,
    plot: Figure = NO_FIGURE,
    variable: Annotated[
        str | None,
        typer.Option("--variable", metavar="NAME", help="What is drawn: position, rotation, or such as undetermined.x"),
    ] = None,
) -> int:
    """Compute the error over a grid of drives or of positions."""
    from . import mapping

    m = answer.mechanism(file, settings, output_point, load_case)
    options: dict[str, Any] = {}
    if question is Mapped.loaded:
        options = {"exact": not first_order, "details": details}
    if question is Mapped.random:
        options = answer.scatter(samples, seed, law, sampling) | {"contact": contact.value}
    if question is Mapped.given:
        options = {"offsets": answer.offsets(m, offset)}
    ranges = arguments.gridded(arguments.assignments(grid, "--grid"), answer.reader(m)) if grid else None
    kept = mapping.Kept(output, overwrite, chunk)
    return mapping.answer(m, question.value, ranges, options, kept, plot, variable)


@app.command(epilog=examples("compare"))
@prints()
@with_figure("panel", "quantity")
def compare(
    first: First,
    second: Second,
    question: Annotated[Compared, typer.Option("--question", "-q", help="What both are asked.")] = Compared.worst,
    components: Annotated[
        str | None,
        typer.Option(
            "--components",
            metavar="x,y,angle",
            help="What B follows; if left out, the position, or all components if B has as many drives.",
        ),
    ] = None,
    samples: Samples = 131_072,
    seed: Seed = 0,
    law: Scatter = None,
    sampling: Points = Sampling.sobol,
    contact: Touching = Contact.scattered,
    output_point: Point = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: Output = None,
    plot: Figure = NO_FIGURE,
) -> int:
    """Compare two mechanisms on one path.

    The drives of B are solved so that its output follows that of A.
    """
    from jointplay.analyses.compare import compute

    a, b = (answer.mechanism(file, settings, output_point, load_case) for file in (first, second))
    options: dict[str, Any] = {}
    if question is Compared.random:
        options = answer.scatter(samples, seed, law, sampling) | {"contact": contact.value}
    followed = arguments.words(components)

    def ask(m: Mechanism) -> Result:
        return compute(m, b, question.value, components=followed, **options)

    return answer.answer({"compare": ask}, a, output, plot)


app.command(epilog=examples("assemble"))(prints()(assembling.assemble))
app.command(epilog=examples("allocate"))(prints()(allocating.allocate))
app.command(epilog=examples("animate"))(animating.animate)
app.command(epilog=examples("report"))(reporting.report)
app.command(epilog=examples("studio"))(serving.studio)


@app.command(epilog=examples("schema"))
def schema(
    output: Annotated[Path | None, typer.Option("--output", "-o", metavar="PATH", help="Write it there.")] = None,
) -> int:
    """Print the JSON Schema of the file, for editors.

    With it they complete and check mechanism files.
    """
    import json

    from jointplay.schema import json_schema
    from jointplay.write import create

    text = json.dumps(json_schema(), indent=2) + "\n"
    if output is None:
        typer.echo(text, nl=False)
    else:
        create(text, output, replace=True)
    return DONE
