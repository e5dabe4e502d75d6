"""The interactive drawing of a mechanism for pages: what is drawn (`scene`), and the program that draws it.

`viewer.js` is one ECMAScript module without dependencies. It draws lines as SVG, in the plane and in orthographic
projection from any side, so that a page prints as sharp as it is seen and needs no graphics driver and no network.
"""

from importlib.resources import files

from .scene import DisplacedScene, scene

__all__ = ["DisplacedScene", "scene", "script", "style"]


def script() -> str:
    """The module that draws, as it is shipped."""
    return files(__package__).joinpath("viewer.js").read_text(encoding="utf-8")


def style() -> str:
    """Its style sheet."""
    return files(__package__).joinpath("viewer.css").read_text(encoding="utf-8")
