"""A page to hand on: the mechanism to play with, its verdict, and its file, from which the studio takes it back."""

import json
from html import escape

from jointplay.basics import pages
from jointplay.errors import one_line
from jointplay.model.mechanism import Mechanism
from jointplay.show import viewer
from jointplay.show.reporting import answers, drawing, sections

#: specimens behind its verdict
SAMPLES = 1024
STYLE = (
    "body { font: 16px/1.45 system-ui, sans-serif; max-width: 60rem; margin: 1rem auto; padding: 0 1rem;"
    " color-scheme: light dark } h1 { font-size: 1.3rem } pre { overflow: auto; font-size: 0.85rem }"
)


def mailed(m: Mechanism, text: str) -> str:
    """The page of a mechanism.

    Parameters
    ----------
    text : str
        Of its file.
    """
    found = answers.ask(m, SAMPLES, 0)
    title = one_line(m.title) or "mechanism"
    parts = [f'<h1 translate="no">{escape(title)}</h1>{sections.whole(found.chapters)}']
    for chapter in found.chapters:
        name = f"<h2>Output {escape(one_line(chapter.output))}</h2>" if chapter.output else ""
        parts.append(name + drawing.embedded(drawing.drawing(chapter)))
    # Within a script a page ends at the first tag that closes one.
    own = json.dumps(text).replace("<", "\\u003c")
    parts.append(f'<script type="application/json" id="mechanism">{own}</script>')
    parts.append(f"<details><summary>Its file</summary><pre>{escape(text)}</pre></details>")
    return f"{pages.head(title, STYLE + viewer.style())}<body>{''.join(parts)}{drawing.program()}"
