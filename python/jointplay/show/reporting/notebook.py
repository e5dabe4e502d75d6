"""The drawing of a mechanism in a notebook."""

from __future__ import annotations

from html import escape

from jointplay.analyses import loaded, region, worst
from jointplay.analyses.nominal import nominal
from jointplay.basics import pages
from jointplay.basics.typed import typed
from jointplay.errors import InputError, listed
from jointplay.model.mechanism import Mechanism
from jointplay.show import viewer

from .answers import Chapter
from .drawing import drawing, embedded, program

#: of the frame that a notebook gives the drawing
HEIGHT = 640
#: colours as the page around it, or the system, has them
STYLE = (
    ":root { color-scheme: light dark; } "
    "body { margin: 0.5rem; font: 15px/1.5 system-ui, sans-serif; color: CanvasText; background: Canvas; }"
)


class View:
    """A drawing to play with, shown by notebooks where it is the value of a cell."""

    def __init__(self, html: str, title: str) -> None:
        self.html = html
        self._title = title

    def _repr_html_(self) -> str:
        # A frame of its own keeps the styles of the notebook and of the drawing apart.
        style = f"width: 100%; height: {HEIGHT}px; border: 0"
        return (
            f'<iframe style="{style}" title="{escape(self._title)}" srcdoc="{escape(self.html, quote=True)}"></iframe>'
        )

    def __repr__(self) -> str:
        return f"<drawing of {self._title!r}; a notebook shows it>"


@typed
def view(m: Mechanism) -> View:
    """The mechanism as a drawing to play with, in a notebook (Jupyter, VS Code, marimo).

    Parameters
    ----------
    m : Mechanism
        With drive values or a path; of several outputs and load cases one is chosen first, by `m.only`.

    Returns
    -------
    View
        Notebooks show it where it is the last value of a cell; its `html` is a page without references to others. A
        slider goes through the configurations; errors under load and at the largest position error, and the region of
        the error, are magnified by a stated factor.

    Raises
    ------
    InputError
        When there are several outputs or load cases.

    Examples
    --------
    >>> import jointplay as jp
    >>> jp.view(jp.loads(jp.examples.text("four-bar")))
    <drawing of '4R four-bar linkage, rotary drive (Jaiswal et al.)'; a notebook shows it>
    """
    for key, names, argument in (("outputs", m.outputs, "output"), ("load_cases", m.load_cases, "load_case")):
        if names:
            problem = f"has several, of which one is drawn: m.only({argument}={names[0]!r}); there are {listed(names)}"
            raise InputError(problem, file=m.file, key=key)
    chapter = Chapter(m, "", nominal(m))
    at = chapter.at
    chapter.results |= {"worst": worst.compute(m, at=at), "region": region.compute(m, at=at)}
    if m.has_loads:
        chapter.results["loaded"] = loaded.compute(m, at=at)
    title = m.title or m.file
    text = f"{pages.head(title, STYLE + viewer.style())}<body>{embedded(drawing(chapter))}{program()}"
    return View(text, title)
