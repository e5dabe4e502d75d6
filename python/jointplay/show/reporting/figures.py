"""Figures of a page as HTML, each with its numbers to take along."""

import base64
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from html import escape
from typing import Any

from matplotlib.backends.backend_mixed import MixedModeRenderer
from matplotlib.backends.backend_svg import FigureCanvasSVG, RendererSVG
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.offsetbox import OffsetBox
from matplotlib.textpath import TextToPath
from matplotlib.ticker import Formatter

from jointplay.plot import style, ticks
from jointplay.plot.style import USUAL_STYLE, LayoutEngine, StyledFigure, as_far_as_it_goes, escape_texts, texts_of
from jointplay.result import Result
from jointplay.result.write import to_csv

from . import decimals

#: rows of a file of numbers that is within the page
MOST_NUMBERS = 20_000
#: texts whose size and letters are kept from one figure to the next
MOST_TEXTS = 4096


@contextmanager
def settings() -> Iterator[None]:
    """Draw as figures of a page are drawn."""
    with style.settings(USUAL_STYLE.rc), ticks.once():
        yield


def blank(width: float, height: float) -> Figure:
    """A figure of a page, inches."""
    return Figure(figsize=(width, height), layout=LayoutEngine())


def svg(figure: Figure) -> str:
    """A figure as the source of a picture."""
    if isinstance(figure, StyledFigure) and figure.is_laid_out:
        figure.set_layout_engine("none")
    with_sign(figure)
    escape_texts(figure)
    # Letters as outlines: a reader's machine need not have the font, and nothing shifts.
    with style.settings({**USUAL_STYLE.rc, "svg.fonttype": "path"}), as_far_as_it_goes():
        content = _PageCanvas(figure).written()
    return "data:image/svg+xml;base64," + base64.b64encode(content.encode()).decode()


def with_sign(figure: Figure) -> None:
    """Write the ticks, legends and labels of a figure with the decimal sign in use; titles may be those of a file."""
    if decimals.current() == ".":
        return
    titles = set()
    for axes in figure.axes:
        titles |= {axes.title, getattr(axes, "_left_title", None), getattr(axes, "_right_title", None)}
        for axis in (getattr(axes, name) for name in ("xaxis", "yaxis", "zaxis") if hasattr(axes, name)):
            axis.set_major_formatter(_OfTicks(axis.get_major_formatter()))
    for text in texts_of(figure):
        if text not in titles:
            text.set_text(decimals.in_text(text.get_text()))


class _OfTicks(Formatter):
    """Ticks as another formatter writes them, with the decimal sign in use."""

    def __init__(self, own: Formatter) -> None:
        self._own = own

    def __call__(self, x: float, pos: int | None = None) -> str:
        return decimals.in_text(self._own(x, pos))

    def format_ticks(self, values: list[float]) -> list[str]:
        """The texts of all ticks."""
        return [*map(decimals.in_text, self._own.format_ticks(values))]

    def get_offset(self) -> str:
        """What stands at the end of the axis."""
        return decimals.in_text(self._own.get_offset())

    def set_axis(self, axis: Any) -> None:
        """Of which axis the ticks are."""
        super().set_axis(axis)
        self._own.set_axis(axis)


class _PageCanvas(FigureCanvasSVG):
    """Draws a figure once, where saving it draws it twice, with one renderer, which measures every text once."""

    def __init__(self, figure: Figure) -> None:
        super().__init__(figure)
        self._content = io.StringIO()
        dpi, figure.dpi = figure.dpi, self.fixed_dpi
        width, height = figure.get_size_inches()
        size = width * self.fixed_dpi, height * self.fixed_dpi
        vectors = RendererSVG(*size, self._content, image_dpi=dpi, metadata={"Date": None})  # type: ignore[no-untyped-call]
        vectors._text2path = _Texts()
        vectors._get_font_height_metrics = self._font_height  # type: ignore[attr-defined]
        self._renderer: Any = MixedModeRenderer(figure, width, height, dpi, vectors)  # type: ignore[no-untyped-call]

    def _font_height(self, font: FontProperties) -> tuple[float, ...]:
        """Ascent, descent and gap between lines of a font, pixels, which matplotlib reads from its file every time."""
        size = font.get_size_in_points() * self.figure.dpi / 72.0
        up, down, gap = _line(findfont(font))
        return size * up, -size * down, size * gap

    def get_renderer(self) -> Any:
        """What layouts measure with."""
        return self._renderer

    def written(self) -> str:
        """The figure as SVG."""
        for box in self.figure.findobj(OffsetBox):
            # Parts of a legend are measured by each box around them, each time that one of these is.
            for measure in ("get_bbox", "_get_bbox_and_child_offsets"):
                setattr(box, measure, lru_cache(None)(getattr(box, measure)))
        self.figure.draw(self._renderer)
        self._renderer.finalize()
        return self._content.getvalue()


class _Texts(TextToPath):
    """Texts as outlines, each measured and laid out once: most stand in several figures of a page."""

    def get_text_width_height_descent(self, s: str, prop: Any, ismath: Any) -> Any:
        """Size of a text, points; as `matplotlib.textpath.TextToPath.get_text_width_height_descent`."""
        return _measured(s, prop.copy(), ismath)

    def get_glyphs_with_font(
        self, font: Any, s: str, glyph_map: Any = None, return_new_glyphs_only: bool = False, **look: Any
    ) -> Any:
        """Letters of a text, their outlines and lines; as `matplotlib.textpath.TextToPath.get_glyphs_with_font`."""
        if not return_new_glyphs_only or any(look.values()):
            return super().get_glyphs_with_font(font, s, glyph_map, return_new_glyphs_only, **look)
        places, outlines, lines = _laid_out(font, s)
        return places, {name: outline for name, outline in outlines.items() if name not in glyph_map}, lines


@lru_cache
def _line(font: str) -> tuple[float, ...]:
    """Ascent, descent and gap between lines of a font, as parts of its size."""
    face: Any = get_font(font)
    lines, units = face.get_sfnt_table("OS/2"), face.get_sfnt_table("head")["unitsPerEm"]
    return tuple(lines[key] / units for key in ("sTypoAscender", "sTypoDescender", "sTypoLineGap"))


_measured: Any = lru_cache(MOST_TEXTS)(TextToPath().get_text_width_height_descent)
_laid_out: Any = lru_cache(MOST_TEXTS)(TextToPath().get_glyphs_with_font)


def picture(figures: Figure | Sequence[Figure], words: str, numbers: Mapping[str, str] | None = None) -> str:
    """Figures, side by side where there is room, with what they show, and files of their numbers by name."""
    links = "".join(download(name, text) for name, text in (numbers or {}).items())
    several = [figures] if isinstance(figures, Figure) else figures
    images = "".join(f'<img alt="{escape(words, quote=True)}" src="{svg(figure)}">' for figure in several)
    kind = ' class="row"' if len(several) > 1 else ""
    return f"<figure><div{kind}>{images}</div><figcaption>{escape(words)} {links}</figcaption></figure>"


def download(name: str, text: str) -> str:
    """A link that saves a text as a file."""
    content = base64.b64encode(text.encode()).decode()
    file = escape(name, quote=True)
    return (
        f'<a class="numbers" download="{file}" href="data:text/csv;charset=utf-8;base64,{content}">{escape(name)}</a> '
    )


def numbers(result: Result, names: Iterable[str]) -> str:
    """Some variables of a result as CSV, one row for each value; with a decimal comma cells end with semicolons."""
    kept = {name: result.data[name] for name in names if name in result.data}
    return to_csv(Result(result.coords, kept, result.attrs), decimals.DIALECTS[decimals.current()], MOST_NUMBERS)
