"""The subcommands, and the program that has them."""

from importlib import import_module
from typing import Annotated

import typer

from .help import examples

#: where each of them is, in the order of the help
HOMES = {
    "new": "files.new",
    "check": "files.check",
    "solve": "solving.solve",
    "singularities": "solving.singularities",
    "error": "asking.error",
    "compensate": "asking.compensate",
    "forces": "forcing.forces",
    "sweep": "sweeping.sweep",
    "allow": "allowing.allow",
    "life": "living.life",
    "workspace": "reaching.workspace",
    "calibrate": "calibrating.calibrate",
    "plan": "calibrating.plan",
    "diagnose": "calibrating.diagnose",
    "verify": "calibrating.verify",
    "map": "mapping.map_",
    "compare": "comparing.compare",
    "assemble": "assembling.assemble",
    "allocate": "allocating.allocate",
    "design": "designing.design",
    "animate": "animating.animate",
    "report": "reporting.report",
    "studio": "serving.studio",
    "import": "exchanging.import_",
    "export": "exchanging.export",
    "schema": "files.schema",
}


def program(only: str | None = None) -> typer.Typer:
    """The program with all subcommands, or with one of them.

    Parameters
    ----------
    only : str, optional
        The subcommand that will run. The others are not made, which takes time: typer looks at every option of each.
    """
    app = typer.Typer(
        name="jointplay",
        help="How far off is the output of a mechanism with joint clearance, and which joint is to blame?",
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback(invoke_without_command=True)(_root)
    for name in [only] if only in HOMES else HOMES:
        module, _, function = HOMES[name].partition(".")
        command = getattr(import_module(f".{module}", __package__), function)
        app.command(name, epilog=examples(name))(command)
    return app


def _root(
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
