"""One sheet for what a command was asked, panel by panel."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from jointplay.basics.typed import typed
from jointplay.errors import InputError, listed, not_known
from jointplay.model.mechanism import Mechanism
from jointplay.result import SIZES, Result, parts

from .assembly import assembly
from .layout import Panel, lay_out
from .panels import Kind, Sheet, kind_of
from .put import check_path, put
from .style import AGAINST, USUAL_STYLE, Style, using
from .words import headline


@dataclass(frozen=True)
class Drawn:
    """What of a result is drawn.

    Parameters
    ----------
    panel : str, optional
        One panel of the sheet alone.
    configuration : int, optional
        At which mechanism and histogram are drawn; the worst one if left out.
    quantity : str, optional
        ``position``, ``rotation`` or a component; position and rotation if left out.
    style : Style
    """

    panel: str | None = None
    configuration: int | None = None
    quantity: str | None = None
    style: Style = USUAL_STYLE

    def check(self, m: Mechanism, asked: Iterable[str]) -> None:
        """Refuse before the work what cannot be drawn.

        Raises
        ------
        InputError
            Naming what would be valid.
        """
        asked = list(asked)
        kind = kind_of(asked)
        known = (*SIZES, *(m.components if kind.has_components else ()))
        if self.quantity is not None and self.quantity not in known:
            raise InputError(not_known(self.quantity, "a quantity", known), key="quantity")
        against = (*m.drives, *AGAINST)
        if self.style.against and self.style.against not in against:
            raise InputError(
                not_known(self.style.against, "what configurations are drawn against", against), key="against"
            )
        names = panel_names(m, asked)
        if self.panel is not None and names and self.panel not in names:
            raise InputError(not_known(self.panel, "a panel", names), key="panel")
        values = m.targets if m.drive_values is None else m.drive_values
        if self.configuration is not None and values is not None and not 0 <= self.configuration < len(values):
            problem = f"there is no configuration {self.configuration}; they go from 0 to {len(values) - 1}"
            raise InputError(problem, file=m.file, key="configuration")


def panel_names(m: Mechanism, asked: list[str]) -> tuple[str, ...]:
    """The panels of a sheet; none where they have the names of what is found, such as steps."""
    names = [entry.of(Sheet(m, asked, {}, Drawn())) for entry in kind_of(asked).entries]
    return tuple(name for some in names for name in some or ()) if None not in names else ()


@typed
def draw(m: Mechanism, results: Mapping[str, Result], path: Path, choice: Drawn | None = None) -> None:
    """Draw results of one mechanism on a sheet and write it.

    Parameters
    ----------
    m : Mechanism
    results : mapping
        By the name of what was asked.
    path : Path
        Ending in `.png`, `.svg` or `.pdf`.
    choice : Drawn, optional
    """
    check_path(path)
    choice = choice or Drawn()
    with using(choice.style):
        put(sheet(m, results, choice), path, next(iter(results.values())))


def sheet(m: Mechanism, results: Mapping[str, Result], choice: Drawn | None = None) -> Figure:
    """The figure of `draw`."""
    choice = choice or Drawn()
    with using(choice.style):
        several = [parts(result) for result in results.values()]
        if any(heading for part in several for heading, _ in part):
            return _first_of_several(m, results, max(several, key=len), choice)
        first = next(iter(results.values()))
        if "assemble" in results:
            return assembly(m, first, step=choice.panel)
        kind = _kind(results)
        panels = _panels(m, results, choice)
        if choice.panel is not None:
            if choice.panel not in panels:
                raise InputError(not_known(choice.panel, "a panel of this sheet", panels), key="panel")
            return lay_out([panels[choice.panel]])
        figure = lay_out(list(panels.values()), kind.row if len(panels) == kind.row else kind.columns)
        if "mechanism" not in panels:
            headline(figure, str(first.attrs["title"]))
    return figure


def separate(m: Mechanism, results: Mapping[str, Result]) -> list[Figure]:
    """The panels of the sheet of one output and load case, each as a figure of its own, which is laid out sooner."""
    with using(USUAL_STYLE):
        return [lay_out([panel]) for panel in _panels(m, results, Drawn()).values()]


def _kind(results: Mapping[str, Result]) -> Kind:
    """The sort of sheet that the results are drawn on."""
    return kind_of(["sweep"] if "sweep" in next(iter(results.values())).attrs else results)


def _panels(m: Mechanism, results: Mapping[str, Result], choice: Drawn) -> dict[str, Panel]:
    """The panels that the results have something for, by name."""
    own = Sheet(m, [*results], results, choice)
    made = {name: entry.make(own, name) for entry in _kind(results).entries for name in entry.of(own) or ()}
    return {name: panel for name, panel in made.items() if panel is not None}


def _first_of_several(
    m: Mechanism, results: Mapping[str, Result], found: list[tuple[str, Result]], choice: Drawn
) -> Figure:
    """The sheet of the first output and load case, with a line that says what else there is."""
    own = {name: parts(result)[0][1] for name, result in results.items()}
    figure = sheet(m.only(*(next(iter(names), None) for names in (m.outputs, m.load_cases))), own, choice)
    if choice.panel is not None:
        return figure
    # What does not depend on the loads has no load case.
    cases = m.load_cases[1:] if any("load_case" in result.sizes for result in results.values()) else ()
    others = [("outputs", m.outputs[1:], "--output-point"), ("load cases", cases, "--load-case")]
    also = "; ".join(f"other {word} ({option}): {listed(names)}" for word, names, option in others if names)
    heading = found[0][0]
    small = choice.style.font_size_used - 2.0
    figure.supxlabel("; ".join(filter(None, (heading, also))), x=0.01, ha="left", fontsize=small)
    return figure
