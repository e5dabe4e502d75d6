"""Puts the numbers of `make verify` into pages while they are built: ``verification.json``, ``robots.json``.

Each ``<!-- PART -->`` on a page stands for one of its parts.
"""

import json
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

from mkdocs.structure.pages import Page

DOCS = Path(__file__).resolve().parents[1]
NUMBERS = DOCS / "verification.json"
MARK = re.compile(r"^<!-- (?P<part>[a-z]+) -->$", re.MULTILINE)


@cache
def numbers() -> dict[str, list[Any]]:
    """What was compared, and how far apart it is."""
    found: dict[str, list[Any]] = json.loads(NUMBERS.read_text(encoding="utf-8"))
    return found


def table(head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table in Markdown."""
    names = list(head)
    lines = [names, ["---"] * len(names), *([str(cell) for cell in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def made() -> str:
    """What the numbers were made with, and how many they are."""
    rows = numbers()["examples"] + numbers()["random"]
    good = sum(row["difference"] <= row["tolerance"] for row in rows)
    total = sum(row["numbers"] for row in rows)
    said = f"{len(rows)} rows compare {total:,} numbers; {good} are within their tolerances."
    return f"{', '.join(numbers()['made'])}. {said}"


def engines() -> str:
    """The engines, and the reasons of their tolerances."""
    rows = {
        (row["engine"], row["version"], f"{row['tolerance']:g} {row['unit']}", row["why"]): None
        for row in numbers()["examples"] + numbers()["random"]
    }
    return table(("engine", "version", "tolerance", "reason for the tolerance"), sorted(rows))


def _rows(rows: Iterable[dict[str, Any]], *first: str) -> Iterable[list[object]]:
    for row in rows:
        outside = "" if row["difference"] <= row["tolerance"] else " **outside**"
        found = f"{row['difference']:g} {row['unit']}{outside}"
        yield [*(row[key] for key in first), row["engine"], row["numbers"], found, f"{row['tolerance']:g}"]


def examples() -> str:
    """A table for every figure of the bundled examples."""
    parts = []
    for figure in numbers()["figures"]:
        some = [row for row in numbers()["examples"] if row["figure"] == figure]
        parts.append(f"## {figure[0].upper()}{figure[1:]}\n")
        head = ("example", "engine", "numbers", "largest difference", "tolerance")
        parts.append(table(head, _rows(some, "mechanisms")))
    return "\n".join(parts)


def random() -> str:
    """The rows of the random mechanisms."""
    head = ("mechanisms", "figure", "engine", "numbers", "largest difference", "tolerance")
    return table(head, _rows(numbers()["random"], "mechanisms", "figure"))


def forms() -> str:
    """Friction and wear."""
    head = ("machine", "figure", "known by", "numbers", "largest difference", "tolerance", "reason for the tolerance")
    keys = ("machine", "figure", "known", "numbers", "difference", "tolerance", "why")
    return table(
        head,
        ([f"{row[key]:g}" if isinstance(row[key], float) else row[key] for key in keys] for row in numbers()["forms"]),
    )


def sources() -> str:
    """Where the published figures were read."""
    return table(
        ("case", "what it is", "source", "read"),
        ([f"`{s['case']}`", s["title"], s["source"], f"{s['place']}; {s['read']}"] for s in numbers()["sources"]),
    )


def published() -> str:
    """The published figures."""
    rows = numbers()["published"]
    agreeing = sum(row["agrees"] in ("jointplay", "both") for row in rows)
    keys = ("case", "figure", "unit", "numbers", "printed", "method", "jointplay", "difference", "tolerance", "remark")
    head = [{"method": "its method"}.get(key, key) for key in keys]
    said = f"{agreeing} of {len(rows)} rows agree with jointplay. The others have a reason in the remark."
    return f"{said}\n\n{table(head, _cells(rows, keys))}"


def _cells(rows: Iterable[dict[str, Any]], keys: Iterable[str]) -> Iterable[list[object]]:
    for row in rows:
        yield [f"{row[key]:g}" if isinstance(row[key], float) else row[key] for key in keys]


def differences() -> str:
    """What is said of single rows."""
    rows = [row for row in numbers()["examples"] + numbers()["random"] if row["remark"]]
    return "\n".join(f"* {row['mechanisms']}, {row['figure']}: {row['remark']}." for row in rows) or "None."


def uncovered() -> str:
    """What no engine covers."""
    rows = ([row["figure"], ", ".join(row["examples"])] for row in numbers()["uncovered"])
    return table(("figure", "examples"), rows)


def robots() -> str:
    """Public robots beside other engines."""
    found = json.loads((DOCS / "robots.json").read_text(encoding="utf-8"))
    head = ("robot", "what it has", "engine", "bodies", "degrees of freedom", "largest difference")
    rows = (
        (
            *(f"[{row['robot']}]({row['source']})", row["has"], row["engine"], row["bodies"]),
            *(row["degrees of freedom"], f"{row['difference']:.0e}"),
        )
        for row in found["robots"]
    )
    return f"{table(head, rows)}\nMade with {', '.join(found['made'])}.\n"


PARTS = {
    part.__name__: part for part in (made, engines, examples, random, forms, sources, published, differences, uncovered)
}
PAGES = {"verification.md": PARTS, "exchange.md": {"robots": robots}}


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """The page with its tables."""
    parts = PAGES.get(page.file.src_uri, {})
    return MARK.sub(lambda found: parts[found["part"]]() if found["part"] in parts else found[0], markdown)
