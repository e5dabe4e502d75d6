"""Makes the gallery while the documentation is built: every bundled example with its drawing and its answer.

The rows of the tables of ``examples.md`` become cards; each leads to a page of its own, with the mechanism to play with
and the text of its file.
"""

import re
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

import jointplay as jp
from jointplay.result import from_dataset
from jointplay.result.conclusions import conclude

PAGE = "examples.md"
STYLES = ("light", "dark")
TABLE = re.compile(r"^\| name \| what it is \| what it shows \|\n\|[-|]+\|\n(?P<rows>(?:\|.*\|\n)+)", re.MULTILINE)
ROW = re.compile(r"^\| `(?P<name>[^`]+)` \| (?P<what>.*) \| (?P<shows>.*) \|$", re.MULTILINE)
#: what Markdown could take for more than a letter
SPECIAL = re.compile(r"([\\`*_\[\]<>$])")


@dataclass(frozen=True)
class Row:
    """A line of a table of the page: an example, what it is, and what it shows."""

    name: str
    what: str
    shows: str


def rows(markdown: str) -> list[Row]:
    """The examples in the tables of the page."""
    return [Row(**found.groupdict()) for table in TABLE.finditer(markdown) for found in ROW.finditer(table["rows"])]


def plain(text: str) -> str:
    """A text as Markdown that says no more than it."""
    return SPECIAL.sub(r"\\\1", text)


@cache
def mechanism(name: str) -> jp.Mechanism:
    """An example."""
    return jp.loads(jp.examples.text(name), f"{name}.toml")


@cache
def answer(name: str, question: str) -> str:
    """The first sentence of the answer to a question."""
    ask = {"worst": jp.worst, "loaded": jp.loaded}[question]
    return conclude(from_dataset(ask(mechanism(name)))).sentences[0].text


@cache
def drawing(name: str, style: str) -> bytes:
    """A drawing of an example as PNG, without axes and words."""
    look = jp.plot.Style(style, width=110.0, height=80.0, dpi=180)
    figure = jp.plot.mechanism(mechanism(name), names=False, style=look)
    (axes,) = figure.axes
    axes.set_title("", loc="left")
    axes.set_axis_off()
    if (legend := axes.get_legend()) is not None:
        legend.remove()
    content = BytesIO()
    figure.savefig(content, format="png")
    return content.getvalue()


@cache
def view(name: str) -> str:
    """The drawing to play with, of the first output in the first load case."""
    m = mechanism(name)
    return jp.view(m.only(next(iter(m.outputs), None), next(iter(m.load_cases), None))).html


def pictures(path: str, words: str) -> str:
    """A light and a dark picture, of which a reader sees one."""
    return "".join(f"![{plain(words)}]({path}-{style}.png#only-{style})" for style in STYLES)


def card(row: Row) -> str:
    """An example in the gallery."""
    page = f"examples/{row.name}.md"
    picture = pictures(f"examples/{row.name}", f"Drawing of {row.what}")
    return f"""
-   [{picture}]({page})

    **[{row.name}]({page})**: {row.what}

    {plain(answer(row.name, "worst"))}

    `jointplay error {row.name}.toml -q worst` ([the file]({page}#the-file))

    *Shows {row.shows}*
"""


def page(row: Row) -> str:
    """The page of an example."""
    m = mechanism(row.name)
    chosen = [*m.outputs[:1], *m.load_cases[:1]]
    of = f" Shown is {' under '.join(chosen)}." if chosen else ""
    shows = re.sub(r"\]\((?!http)", "](../", row.shows)
    return f"""---
search: {{ boost: 0.5 }}
---
# {row.name}

<div class="grid example" markdown>

{pictures(row.name, f"Drawing of {row.what}")}

<div markdown>

{plain(m.title)}. Shows {shows}.

**Worst case**: {plain(answer(row.name, "worst"))}

**Under its load**: {plain(answer(row.name, "loaded"))}

</div>

</div>

```console
$ jointplay new {row.name}
$ jointplay error {row.name}.toml
```

## To play with

Move the slider through the configurations. Drag to turn the drawing; in the plane, to shift it.{of}

<iframe class="view" src="view.html" title="{row.name}" loading="lazy"></iframe>

## The file

```toml title="{row.name}.toml"
{jp.examples.text(row.name).rstrip()}
```

[All examples](../examples.md)
"""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a page for every example, with its pictures."""
    source = files.get_file_from_path(PAGE)
    assert source is not None
    listed = rows(source.content_string)
    if missing := set(jp.examples.names()) ^ {row.name for row in listed}:
        raise PluginError(f"{PAGE} and the bundled examples differ: {', '.join(sorted(missing))}")
    for row in listed:
        made: dict[str, str | bytes] = {f"{row.name}.md": page(row), f"{row.name}/view.html": view(row.name)}
        for style in STYLES:
            made[f"{row.name}-{style}.png"] = drawing(row.name, style)
        for name, content in made.items():
            files.append(File.generated(config, f"examples/{name}", content=content))
    return files


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Cards in place of the tables."""
    if page.file.src_uri != PAGE:
        return markdown

    def cards(table: re.Match[str]) -> str:
        found = "".join(card(Row(**row.groupdict())) for row in ROW.finditer(table["rows"]))
        return f'<div class="grid cards gallery" markdown>\n{found}\n</div>\n'

    return TABLE.sub(cards, markdown)
