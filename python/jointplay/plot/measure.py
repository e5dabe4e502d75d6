"""How large texts are, each measured once."""

import warnings
from functools import lru_cache

import matplotlib as mpl
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

#: texts that are kept
MOST = 8192


def extent_of(text: str, size: float) -> tuple[float, float, float]:
    """Width, height and what of it is below the line, of a text with letters of a size, points."""
    return _measured(text, size, tuple(mpl.rcParams["font.family"]))


@lru_cache(MOST)
def _measured(text: str, size: float, family: tuple[str, ...]) -> tuple[float, float, float]:
    with warnings.catch_warnings():
        # A box for a letter that the font lacks is as wide as one.
        warnings.filterwarnings("ignore", message="(?s)Glyph .* missing from font")
        wide, high, low = text_to_path.get_text_width_height_descent(
            text, FontProperties(family=[*family], size=size), False
        )
    return float(wide), float(high), float(low)
