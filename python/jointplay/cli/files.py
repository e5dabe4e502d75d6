"""The subcommands for the file itself: an example to start from, what is in a file, and its schema."""

from pathlib import Path
from typing import Annotated

import typer

from . import DONE, NOT_OK, answer, arguments, completing
from .options import File, OutputPath, Settings, writes
from .printing import prints
from .streams import hold


def new(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME", help="Which example; lists them if left out.", autocompletion=completing.examples
        ),
    ] = None,
    settings: Settings = None,
    output: Annotated[Path | None, writes("Where to write it; NAME.toml if left out.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
) -> int:
    """Write a bundled example to start from, or list them."""
    import tomllib

    from jointplay import examples as bundled
    from jointplay.result.write import create

    if name is None:
        titles = {example: bundled.title(example) for example in bundled.names()}
        answer.list_names(titles, f"{len(titles)} examples; `jointplay new NAME` writes one as NAME.toml.")
        return DONE
    text, reached = bundled.changed_text(name, arguments.assignments(settings or (), "--set"))
    hold(reached)
    path = output or Path(f"{name}.toml")
    create(text, path, replace=force)
    typer.echo(f"wrote {path}: {tomllib.loads(text)['title']}")
    return DONE


@prints()
def check(file: File, settings: Settings = None, output: OutputPath = None) -> int:
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


def schema(
    output: Annotated[Path | None, writes("Write it there.")] = None,
) -> int:
    """Print the JSON Schema of the file, for editors.

    With it they complete and check mechanism files.
    """
    import json

    from jointplay.file.schema import json_schema
    from jointplay.result.write import create

    text = json.dumps(json_schema(), indent=2) + "\n"
    if output is None:
        typer.echo(text, nl=False)
    else:
        create(text, output, replace=True)
    return DONE
