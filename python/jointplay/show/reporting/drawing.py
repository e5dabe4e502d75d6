"""The drawing to play with: what is known of a mechanism, as data of the viewer, and how it stands on a page."""

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses import displaced
from jointplay.questions import QUESTIONS
from jointplay.result import blame, figure, figures, in_words
from jointplay.result.verdict import place, verdict
from jointplay.show import viewer
from jointplay.show.viewer import DisplacedScene, scene

from . import decimals
from .answers import Chapter, reproduces, shown

#: what the questions are called in headings and sentences that judge, the one first that says most
WORDS = {name: QUESTIONS[name].label for name in ("worst", "loaded", "random")}
#: width of what is printed on A4, which is narrower than Letter, times the size of its letters: 182 mm of 9.5 pt
PAPER = 54
#: draws every scene of the page; what is folded is printed, too, and tables get as narrow as the paper
START = """
const narrow = (table) => {
  const room = PAPER * parseFloat(getComputedStyle(document.documentElement).fontSize);
  const width = (kind) => (table.style.width = kind, table.offsetWidth);
  table.classList.toggle("narrow", width("max-content") > room);
  const [most, least] = [width("max-content"), width("min-content")];
  table.style.width = "";
  table.style.zoom = Math.min(1, Math.max(room / most, 0.7), room / least);
};
addEventListener("beforeprint", () => {
  document.querySelectorAll("details").forEach((part) => (part.open = true));
  document.querySelectorAll(".wide table").forEach(narrow);
});
addEventListener("afterprint", () => {
  document.querySelectorAll(".wide table").forEach((table) => (table.style.zoom = ""));
});
for (const place of document.querySelectorAll("[data-viewer]")) {
  view(place, JSON.parse(place.nextElementSibling.textContent));
}
"""


def drawing(chapter: Chapter) -> dict[str, Any]:
    """The data of the viewer."""
    m, at = chapter.m.first, chapter.at
    kept = shown(len(at))
    states = [DisplacedScene(label, moved.poses[kept], moved.points[kept]) for label, moved in _states(chapter)]
    own = at.chosen(kept)
    bounds = dict(zip(m.quantities, m.limits.bounds(m.quantities), strict=True))
    limit = float(bounds["position"][1]) / m.units.length
    region = chapter.results["region"].get("region")[kept] if "region" in chapter.results else None
    return scene(
        m,
        own,
        displaced=states,
        region=region,
        cloud=None if chapter.cloud is None else chapter.cloud[kept],
        limit=limit if np.isfinite(limit) else None,
        texts=_texts(chapter, kept),
    )


def _states(chapter: Chapter) -> Iterator[tuple[str, displaced.Displaced]]:
    """What displaces the mechanism, in words, and where it is then."""
    for heading, part in chapter.parts("loaded"):
        case = chapter.m.only(None, str(part.coords["load_case"].values) if heading else None)
        moved = displaced.under_load(case, chapter.at)
        if reproduces(case, chapter.at, part, moved):
            yield ", ".join(filter(None, (QUESTIONS["loaded"].displaced, heading))), moved
    for _, part in chapter.parts("worst"):
        moved = displaced.at_offsets(chapter.m.first, chapter.at, part.get("worst_offset", extreme="position"))
        if reproduces(chapter.m.first, chapter.at, part, moved):
            yield QUESTIONS["worst"].displaced, moved


def _texts(chapter: Chapter, kept: NDArray[np.intp]) -> list[list[str]]:
    """What is said beside every configuration."""
    lines: list[list[str]] = [[] for _ in kept]
    for question in ("worst", "loaded"):
        for heading, part in chapter.parts(question):
            label = ", ".join(filter(None, (WORDS[question], heading)))
            values, unit = figure(part, "position")
            said = figures(part)["position"].words if question == "worst" else label
            shares, marks = blame(part) if question == "worst" else None, verdict(part).marks
            for own, k in zip(lines, kept.tolist(), strict=True):
                if not own:
                    where = place(part, k)
                    own.append(f"{where[:1].upper()}{where[1:]}")
                found = shares.largest("position", k) if shares else None
                whose = f", to blame first: {in_words(*found)}" if found else ""
                own.append(f"{said} {float(values[k]):.4g} {unit}{whose}")
                if marks and marks[k]:
                    own.append(f"{label}: beyond the limit: {marks[k]}")
    return [[*map(decimals.in_text, own)] for own in lines]


def embedded(data: Mapping[str, Any]) -> str:
    """Where a drawing stands on a page, with its data."""
    # Within a script a page ends at the first tag that closes one.
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return f'<div class="viewer" data-viewer></div><script type="application/json">{text}</script>'


def program() -> str:
    """The end of a page: what draws."""
    return f'<script type="module">{viewer.script()}const PAPER = {PAPER};{START}</script></body></html>\n'
