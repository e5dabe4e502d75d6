"""Drawings on one layer, as linkages are sketched: every line and polyline is a body.

* A text in the middle of a line is the name of its body; lines of one name are one body.
* ``ground`` in the middle of a line, or at a point, says what is fixed. Construction lines and centre lines are fixed.
* A circle is a pin of all lines that go through its centre, a POINT one of the first of them.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from jointplay.errors import InputError, listed

from .drawing import Drawing, tree
from .skeleton import GROUND, Vector


def body_by_body(found: Drawing, ground: str, reach: float) -> Drawing:
    """A drawing with a layer for every body.

    Parameters
    ----------
    found : Drawing
        With all that makes bodies on one layer.
    ground : str
        The body that is fixed.
    reach : float
        What is no farther apart coincides, metres.

    Raises
    ------
    InputError
        When nothing says what is fixed, or a POINT is on no line.
    """
    bars = [corners for _, corners in found.shapes if len(corners) > 1]
    holes = [corners[0] for _, corners in found.shapes if len(corners) == 1]
    points = [at for _, at in found.ends]
    texts, pins = tree([at for _, at in found.words]), tree(points)
    used: set[int] = set()

    def said(at: Vector, only: str = "") -> Iterator[str]:
        """The texts at a point, which are not those of pins then."""
        for k in sorted(texts.query_ball_point(at, reach)):
            word = found.words[k][0]
            if not only or word.lower() == only:
                used.add(k)
                yield word

    names: list[str] = []
    for corners in bars:
        middles = [0.5 * (a + b) for a, b in pairwise(corners)]
        # A text where something is joined is the name of the pin.
        free = [middle for middle in middles if not pins.query_ball_point(middle, reach)]
        names.append(next((name for middle in free for name in said(middle)), ""))
    taken = {*names}
    numbers = (name for name in (f"link{k}" for k in range(1, 2 * len(bars) + 1)) if name not in taken)
    shapes = [(name or next(numbers), corners) for name, corners in zip(names, bars, strict=True)]
    owners = [name for name, corners in shapes for _ in corners[1:]]
    lines = np.array([line for corners in bars for line in pairwise(corners)]).reshape(-1, 2, 3)
    starts, along = lines[:, 0], lines[:, 1] - lines[:, 0]
    squares = np.maximum(np.einsum("ij,ij->i", along, along), np.finfo(float).tiny)

    def through(at: Vector) -> list[str]:
        """The bodies with a line through a point."""
        parts = np.clip(np.einsum("ij,ij->i", at - starts, along) / squares, 0.0, 1.0)
        off = np.linalg.norm(starts + parts[:, None] * along - at, axis=1)
        return list(dict.fromkeys(owners[k] for k in np.flatnonzero(off <= reach)))

    fixed = [at for at in points if next(said(at, GROUND), None)]
    shapes += [(ground, [at]) for at in fixed]
    shapes += [(name, [at]) for at in holes for name in through(at)]
    marks = []
    for _, at in found.marks:
        bodies = sorted(through(at), key=lambda name: name.lower() == ground.lower())
        if not bodies:
            where = ", ".join(f"{x * 1e3:.6g}" for x in at[:2])
            raise InputError(f"the POINT at ({where}) mm is on no line, whose body it would be of", key="output")
        marks.append((bodies[0], at))
    guides = [replace(guide, layer=ground) for guide in found.guides]
    layers = list(dict.fromkeys([name for name, _ in shapes] + [guide.layer for guide in guides]))
    if ground.lower() not in (name.lower() for name in layers):
        where = "at its points or in the middle of its line"
        raise InputError(
            f"nothing says what is fixed: write the text '{GROUND}' {where}; bodies: {listed(layers)}", key="ground"
        )
    words = [one for k, one in enumerate(found.words) if k not in used]
    return Drawing(layers, shapes, marks, guides, words, found.notes)
