"""The subcommand that serves a page to play with a mechanism."""

import threading
from contextlib import ExitStack
from typing import Annotated

import typer

from . import DONE, completing


def studio(
    file: Annotated[
        str | None,
        typer.Argument(
            metavar="[FILE]", help="Mechanism file; a choice of examples if left out.", autocompletion=completing.files
        ),
    ] = None,
    port: Annotated[
        int,
        typer.Option("--port", metavar="N", help="Port to listen to. [default: any that is free]", show_default=False),
    ] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")] = True,
) -> int:
    """Play with a mechanism on a local page.

    Drag drives, clearances, tolerances and loads, and see the errors follow. The page is for this machine only. Ctrl-C
    stops it.
    """
    from jointplay.show.serving import leading_to, serve

    with ExitStack() as until_stopped:

        def said(address: str) -> None:
            typer.echo(f"{address}\nCtrl-C stops it.")
            if browser:
                import webbrowser

                page = until_stopped.enter_context(leading_to(address))
                # A browser in the terminal would keep the server from answering it.
                threading.Thread(target=webbrowser.open, args=(page,), daemon=True).start()

        serve(file, port, said)
    typer.echo("stopped")
    return DONE
