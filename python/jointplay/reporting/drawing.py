"""The drawing to play with: what is known of a mechanism, as data of the viewer, and how it stands on a page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from jointplay import viewer
from jointplay.result import in_words, size
from jointplay.verdict import cause, place, verdict
from jointplay.viewer import Displaced, scene

from .answers import Chapter, displaced, shown

#: what the questions are called in headings and sentences
WORDS = {"worst": "worst case", "loaded": "under load", "random": "random specimens"}
#: nothing is fetched from anywhere, and nothing is sent
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
#: draws every scene of the page
START = """
for (const place of document.querySelectorAll("[data-viewer]")) {
  view(place, JSON.parse(place.nextElementSibling.textContent));
}
"""


def drawing(chapter: Chapter) -> dict[str, Any]:
    """The data of the viewer."""
    m, at = chapter.m.first, chapter.at
    kept = shown(len(at))
    states = []
    for label, question, name, chosen in (
        ("under load", "loaded", "offset", {}),
        ("at the largest position error", "worst", "worst_offset", {"extreme": "position"}),
    ):
        for heading, part in chapter.parts(question)[:1]:
            moved = displaced(m, at, part, part.get(name, **chosen)) if name in part.data else None
            if moved is not None:
                states.append(Displaced(", ".join(filter(None, (label, heading))), moved[kept]))
    own = replace(at, **{key: value[kept] for key, value in vars(at).items() if key != "units"})
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
        texts=[_text(chapter, int(k)) for k in kept],
    )


def _text(chapter: Chapter, k: int) -> list[str]:
    """What is said beside a configuration."""
    lines: list[str] = []
    for question, part in (
        (name, chapter.parts(name)[0][1]) for name in ("worst", "loaded") if name in chapter.results
    ):
        if not lines:
            where = place(part, k)
            lines.append(f"{where[:1].upper()}{where[1:]}")
        if question == "worst":
            value, unit = float(part.get("worst_position")[k]), part.unit("worst_position")
            found = cause(part, "position", "high", k)
            whose = f", to blame first: {in_words(*found)}" if found else ""
            lines.append(f"largest position error {value:.4g} {unit}{whose}")
        else:
            value = float(size(part, "error", "position")[k])
            lines.append(f"under load {value:.4g} {part.unit('error', component='x')}")
        mark = (verdict(part).marks or ("",) * (k + 1))[k]
        if mark:
            lines.append(f"{WORDS[question]}: beyond the limit of {mark}")
    return lines


def embedded(data: Mapping[str, Any]) -> str:
    """Where a drawing stands on a page, with its data."""
    # Within a script a page ends at the first tag that closes one.
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return f'<div class="viewer" data-viewer></div><script type="application/json">{text}</script>'


def head(style: str) -> str:
    """The beginning of a page, up to its title."""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}"><style>{style}{viewer.style()}</style>'
    )


def program() -> str:
    """The end of a page: what draws."""
    return f'<script type="module">{viewer.script()}{START}</script></body></html>\n'
