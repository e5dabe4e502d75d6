r"""Typesets the formulas of the pages while they are built: LaTeX between dollar signs becomes MathML.

Browsers draw MathML by themselves, so that pages need no program, no font and no network for it. A formula that is
not LaTeX stops the build.
"""

import re
from html import unescape
from typing import Any

from math_core import LatexError, LatexToMathML
from mkdocs.exceptions import PluginError
from mkdocs.structure.pages import Page

#: what `pymdownx.arithmatex` makes of ``$...$`` and ``$$...$$``
FORMULA = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<latex>.*?)\\[)\]]</(?P=tag)>',
    re.DOTALL,
)
CONVERTER = LatexToMathML(fancy_error=False)


def mathml(latex: str, *, display: bool) -> str:
    r"""A formula as MathML.

    >>> mathml("a^2", display=False)
    '<math><msup><mi>a</mi><mn>2</mn></msup></math>'
    """
    return str(CONVERTER.convert_with_local_state(latex, displaystyle=display))


def on_page_content(html: str, page: Page, **_: Any) -> str:
    """The page with its formulas."""

    def typeset(found: re.Match[str]) -> str:
        latex = unescape(found["latex"])
        try:
            formula = mathml(latex, display=found["tag"] == "div")
        except LatexError as error:
            raise PluginError(f"{page.file.src_uri}: {latex.strip()}: {error}") from None
        return f'<div class="formula">{formula}</div>' if found["tag"] == "div" else formula

    return FORMULA.sub(typeset, html)
