"""The options of figures, the same for all commands that draw."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jointplay.errors import InputError, shown

from .options import Command, exchanged

if TYPE_CHECKING:
    from jointplay.model.mechanism import Mechanism
    from jointplay.plot import Drawn, Style
    from jointplay.result import Result

FigureSize = Annotated[
    str | None,
    typer.Option("--size", metavar="WxH", help="Figure: its size, such as 85x60mm or 85mm (mm, cm, in, pt)."),
]
Dots = Annotated[int | None, typer.Option("--dpi", metavar="N", help="Figure: dots per inch. [default: 160]")]
StyleName = Annotated[str | None, typer.Option("--style", metavar="NAME", help="Figure: light, dark or print.")]
PanelName = Annotated[str | None, typer.Option("--panel", metavar="NAME", help="Figure: only this panel.")]
ConfigurationNumber = Annotated[
    int | None,
    typer.Option("--configuration", "-c", metavar="N", help="Figure: of this configuration. [default: the worst one]"),
]
Quantity = Annotated[
    str | None,
    typer.Option("--quantity", metavar="NAME", help="Figure: only position, rotation or a component such as x."),
]
Font = Annotated[
    str | None, typer.Option("--font", metavar="NAME", help="Figure: its letters, such as 'DejaVu Serif'.")
]
NoTitle = Annotated[bool | None, typer.Option("--no-title", help="Figure: leave titles out.")]
LegendPlace = Annotated[
    str | None,
    typer.Option("--legend", metavar="PLACE", help="Figure: legends above, none, or in the axes ('upper right')."),
]
Against = Annotated[
    str | None,
    typer.Option(
        "--against",
        metavar="NAME",
        help="Figure: against a drive, length (of the path), time or configuration. [default: the only drive]",
    ),
]
ColourMap = Annotated[str | None, typer.Option("--colours", metavar="NAME", help="Figure: a colour map of matplotlib.")]
Scale = Annotated[str | None, typer.Option("--scale", metavar="LOW:HIGH", help="Figure: where colours begin and end.")]
Log = Annotated[bool | None, typer.Option("--log", help="Figure: colours on a logarithmic scale.")]
Levels = Annotated[
    str | None,
    typer.Option("--levels", metavar="N|A,B,...", help="Figure: colours in steps, lines between; how many, or where."),
]
#: every option by the name of its parameter
OPTIONS: dict[str, Any] = {
    "size": FigureSize,
    "dpi": Dots,
    "style": StyleName,
    "panel": PanelName,
    "configuration": ConfigurationNumber,
    "quantity": Quantity,
    "font": Font,
    "no_title": NoTitle,
    "legend": LegendPlace,
    "against": Against,
    "colours": ColourMap,
    "scale": Scale,
    "log": Log,
    "levels": Levels,
}
#: options that mean something for every figure
LOOK = ("size", "dpi", "style", "font", "no_title", "legend")
#: those of what has a scale of colours
COLOURED = ("colours", "scale", "log", "levels")
#: keys of a style by the option that gives them, where the names differ
OPTION_OF = {"width": "size", "height": "size", "colour_map": "colours"}


@dataclass(frozen=True)
class FigureFile:
    """Where a figure goes, and the options that were given."""

    path: Path | None = None
    options: dict[str, Any] | None = None

    @property
    def given(self) -> dict[str, Any]:
        """Options with a value."""
        return {name: value for name, value in (self.options or {}).items() if value is not None}

    def check(self, m: Mechanism, asked: Iterable[str]) -> None:
        """Refuse before the work what cannot be drawn or written."""
        self._require_path()
        if self.path is None:
            return
        from jointplay.plot import check_path

        check_path(self.path)
        choice = self.choice()
        try:
            choice.check(m, asked)
        except InputError as problem:
            raise InputError(problem.problem, key=f"--{problem.key}") from None

    def check_map(self) -> None:
        """The same for a figure of a map, which can be a page."""
        self._require_path()
        if self.path is not None:
            from jointplay.plot.map import check_path

            check_path(self.path)
            self.style()

    def _require_path(self) -> None:
        for name in self.given if self.path is None else ():
            problem = "says how a figure looks; --plot says where it goes"
            raise InputError(problem, key=f"--{name.replace('_', '-')}")

    def style(self) -> Style:
        """The style.

        Raises
        ------
        InputError
            Naming the option, and what would be valid.
        """
        from jointplay.plot import Style
        from jointplay.plot.style import size_of

        given = self.given
        try:
            width, height = size_of(given["size"]) if "size" in given else (None, None)
            names = {"theme": "style", "colour_map": "colours"} | {
                key: key for key in ("dpi", "font", "legend", "against", "log")
            }
            found: dict[str, Any] = {key: given[name] for key, name in names.items() if name in given}
            found["title"] = "no_title" not in given
            if "scale" in given:
                found["scale"] = _numbers(given["scale"], ":", "scale", "two numbers such as 0:0.5", 2)
            if "levels" in given:
                levels = _numbers(given["levels"], ",", "levels", "a number of levels, or values such as 0.1,0.2,0.5")
                is_count = len(levels) == 1 and levels[0].is_integer() and levels[0] >= 1.0
                found["levels"] = int(levels[0]) if is_count else levels
            return Style(width=width, height=height, **found)
        except InputError as problem:
            raise InputError(problem.problem, key=f"--{OPTION_OF.get(problem.key, problem.key)}") from None

    def choice(self) -> Drawn:
        """What of the result is drawn, and how."""
        from jointplay.plot import Drawn

        given = self.given
        return Drawn(given.get("panel"), given.get("configuration"), given.get("quantity"), self.style())

    def draw(self, m: Mechanism, results: dict[str, Result]) -> None:
        """Draw results, if a figure was asked for."""
        if self.path is not None:
            from jointplay.plot import draw

            draw(m, results, self.path, self.choice())


def _numbers(text: str, by: str, key: str, such: str, count: int | None = None) -> tuple[float, ...]:
    """Numbers of an option."""
    try:
        found = tuple(float(part) for part in text.split(by))
    except ValueError:
        found = ()
    if not found or count not in (None, len(found)):
        raise InputError(f"{shown(text)} is not {such}", key=key)
    return found


#: what commands are given that are called without the option
NO_FIGURE = FigureFile()


def with_figure(*names: str, draws: str = "Draw the result: .png, .svg or .pdf.") -> Callable[[Command], Command]:
    """Give a command `--plot` and the options of figures, which it gets as its parameter `plot`.

    Parameters
    ----------
    *names : str
        Which options besides those of the look.
    draws : str
        Help of `--plot`.
    """
    wanted = (*LOOK, *names)
    path = Annotated[Path | None, typer.Option("--plot", metavar="PATH", help=draws)]

    def extended(command: Command) -> Command:
        @functools.wraps(command)
        def run(**values: Any) -> int:
            options = {name: values.pop(name) for name in wanted}
            return command(**{**values, "plot": FigureFile(values["plot"], options)})

        added = {"plot": (path, None)} | {name: (OPTIONS[name], None) for name in wanted}
        return exchanged(run, command, {"plot": added})

    return extended
