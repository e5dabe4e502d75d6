"""`workspace`: how large the region is in which a mechanism holds what is asked of it, and what bounds it.

    region = nodes of a grid of output positions where every condition holds in every orientation, as far as they hang
             together with the node nearest to the start
    boundary = where the edges of the grid that lead out of it leave it (`crossing`), joined by facets (`surface`)

Conditions are those of a map: the mechanism is assembled, on its way from the start it meets no singularity, and drives
and joints are within their ranges; with a question the limits of the file hold as well.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.analyses.beside import said, why_not, with_forces
from jointplay.analyses.map.answering import MapQuestion
from jointplay.analyses.nominal import Progress
from jointplay.analyses.questions import check, taken
from jointplay.analyses.recorded import recorded
from jointplay.basics.arrays import Floats, Ints
from jointplay.basics.typed import typed
from jointplay.errors import InputError, in_range, listed, shown
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, ResultBuilder, Variable, to_dataset
from jointplay.result.verdict import HELD, NOT_SHOWN

from .asked import COARSE, USUAL, AskedGrid, AskedRanges, around, even, further, widened
from .found import HeldRegion, coarse_region, region
from .holding import EDGE
from .inscribed import box, box_of_nodes, disc, larger_box
from .surface import enclosed, facet_sizes

if TYPE_CHECKING:
    import xarray as xr

#: nodes in all orientations: some gigabytes of poses
MOST_NODES = 1_000_000
MOST_ALONG = 2_000
#: part of a spacing to which the boundary is found where nobody says it
TOLERANCE = 1e-3
#: how often a coarse region that reaches an edge of its grid is looked for in a larger one
WIDENED = 16
#: such a grid has up to so many times the nodes along an axis
FINER = 4
#: of the whole work, as progress shows it
STEPS = 100


@typed
def workspace(
    m: Mechanism,
    grid: Mapping[str, Any] | None = None,
    *,
    question: str | None = None,
    centre: Sequence[float] | None = None,
    count: int | None = None,
    tolerance: float | None = None,
    **options: Any,
) -> xr.Dataset:
    """Find the region in which a mechanism can be used: its size, what bounds it, the largest disc and box in it.

    Parameters
    ----------
    m : Mechanism
        With two drives or more.
    grid : mapping, optional
        In place of the file's ``[grid]``, as for `map`: two or three coordinates of the output as axes, others held.
        Several values of rotations are orientations, each of which has to be possible at every position. If no
        positions are given, the box is found from the ranges of the drives.
    question : {"loaded", "worst", "random", "forces"}, optional
        In which the limits of the file have to hold as well, those of forces in the worst case; ``forces`` for these
        alone. By default none of them counts.
    centre : sequence of float, optional
        About which the disc and the box are, in place of the best place for each; in the order of the axes.
    count : int, optional
        Nodes along the longest side of a box that is found; 101 in the plane and 25 in space if left out.
    tolerance : float, optional
        To which the boundary is found along edges of the grid; a thousandth of the spacing if left out.
    **options
        Of the question, such as ``samples``.

    Returns
    -------
    xarray.Dataset
        `size` (area or volume) and `size_error` (how far the size of every second node is from it, or what tolerance
        and edges that are cut off leave), `share` over `bound` (parts of the boundary that are bounded by the end of a
        range, such as ``drives.q1.high``, by
        ``not_assembled``, ``singular``, a limit, or ``edge``: that of the grid), `disc_centre`, `disc_radius`,
        `box_low`, `box_high` and `box_size` with `disc_radius_error` and `box_size_error`; the boundary as `vertex`
        (the points, over `point` and `along`), `vertex_bound` and `facet` (numbers of the points of segments or
        triangles, counterclockwise seen from outside); over the axes `inside` and `outside_by`; `status`: ``ok``, or
        ``empty``. With a question of a file that limits forces, `forces_outcome`: ``held``, or ``not shown``, and why.

    Raises
    ------
    InputError
        When the mechanism has one drive only, the grid does not fit it, nothing says how far a drive goes, the centre
        is not in the region, or there are no limits for the question.

    Notes
    -----
    The boundary is that of the nodes: islands, holes and necks that are narrower than the spacing can be missed. A
    region that meets the region of the start only across a singularity, or outside a range or a limit, is not counted.

    Examples
    --------
    An arm whose two joints have ranges reaches a part of a ring:

    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("serial-2r")).with_({"limits.drives": {"q1": [0, 90], "q2": [-120, -20]}})
    >>> result = jp.workspace(m, count=31)
    >>> sorted(result.bound.values.tolist())
    ['drives.q1.high', 'drives.q1.low', 'drives.q2.high', 'drives.q2.low']
    """
    given = None if centre is None else [*centre]
    return to_dataset(compute(m, grid, question=question, centre=given, count=count, tolerance=tolerance, **options))


@recorded
def compute(
    m: Mechanism,
    grid: Mapping[str, Any] | None = None,
    *,
    question: str | None = None,
    centre: Sequence[float] | None = None,
    count: int | None = None,
    tolerance: float | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Result:
    """The light form of `workspace`."""
    if question is not None:
        check(question, options, "workspace")
    elif options:
        raise InputError(f"goes with a question: {listed(options)}", key=next(iter(options)))
    if count is not None:
        in_range(count, "count", "a number of nodes", 5, MOST_ALONG)
    ranges = AskedRanges.of(m, grid)
    if count is not None and not ranges.unsaid:
        problem = "says how many nodes there are where no grid does; here one does"
        raise InputError(problem, file=m.file, key="count")
    asked = ranges.given()
    if centre is not None:
        _check_centre(centre, ranges.lengths if ranges.unsaid else list(asked.axes))
    if count is not None:
        # Before the box is known: as many as there are where it is long and flat.
        names = ranges.lengths
        fewest = even(np.zeros(len(names)), np.eye(len(names))[0], names, count)
        _check_nodes(m, replace(asked, axes=fewest), "count")
    found = _box(m, ranges, asked, count) if ranges.unsaid else asked
    step = TOLERANCE * found.spacing if tolerance is None else tolerance
    if not 0.0 < step <= found.spacing:
        problem = f"{shown(step)} is not above zero and at most the spacing of {found.spacing:.4g}"
        raise InputError(problem, key="tolerance")
    asks = [] if question is None else [MapQuestion(m, question, options, "workspace")]
    unjudged = why_not(m) if m.limits.forces else ""
    if asks and m.limits.forces and not unjudged and question != "forces":
        asks.append(MapQuestion(m, "forces", {}, "workspace"))

    def part(done: float) -> None:
        if progress is not None:
            progress(round(STEPS * done), STEPS)

    most = FINER * max(map(len, found.axes.values()))
    for _ in range(WIDENED):
        _check_nodes(m, found)
        within = region(m, found, ranges.start_at(found.axes), asks, step, part)
        if not ranges.unsaid or EDGE not in within.bound:
            break
        found = replace(found, axes=further(found.axes, within.inside, most))
    result = _told(ranges, within, step, question, None if centre is None else np.array(centre, dtype=float))
    if question is not None:
        # Which specimens decided where the limits hold.
        own = taken(question, options)
        drawn: dict[str, Any] = {name: own[name] for name in ("samples", "seed") if name in own}
        result = replace(result, attrs={**result.attrs, **drawn})
    if not (asks and m.limits.forces):
        return result
    outcome = NOT_SHOWN if unjudged else HELD if within.inside.any() else ""
    return with_forces(result, said(outcome, unknown=unjudged))


def _check_nodes(m: Mechanism, asked: AskedGrid, key: str = "grid") -> None:
    nodes = len(asked.orientations) * math.prod(map(len, asked.axes.values()))
    if nodes > MOST_NODES:
        problem = f"{nodes:.3g} nodes in all orientations; up to {MOST_NODES:.0e} are possible"
        raise InputError(problem, file=m.file, key=key)


def _check_centre(centre: Sequence[float], names: Sequence[str]) -> None:
    if len(centre) != len(names) or not np.isfinite(centre).all():
        raise InputError(f"{shown(list(centre))} is not a number for each of {listed(names)}", key="centre")


def _box(m: Mechanism, ranges: AskedRanges, asked: AskedGrid, count: int | None) -> AskedGrid:
    """Axes over the box of the region, as a coarse grid shows it."""
    names = ranges.lengths
    low, high = widened(*ranges.swept())
    for _ in range(WIDENED):
        coarse = replace(asked, axes=even(low, high, names, COARSE[len(names)]))
        inside = coarse_region(m, coarse, ranges.start_at(names))
        if not inside.any():
            break
        lowest, highest, cut = around(coarse.axes, inside)
        if not cut:
            low, high = lowest, highest
            break
        more = 0.25 * (high - low)
        low, high = np.minimum(low, lowest - more), np.maximum(high, highest + more)
    return replace(asked, axes=even(low, high, names, count or USUAL[len(names)]))


def _told(
    ranges: AskedRanges, found: HeldRegion, tolerance: float, question: str | None, centre: Floats | None
) -> Result:
    """The result of a region."""
    asked, values, m = found.asked, found.values, found.m
    builder = ResultBuilder(m, "workspace", spacing=asked.spacing, tolerance=tolerance)
    builder.attrs["axes"] = ", ".join(asked.axes)
    if question is not None:
        builder.attrs["asked"] = question
    if asked.held:
        builder.attrs["held"] = ", ".join(f"{name} = {value:g}" for name, value in asked.held.items())
    if asked.orientations != ({},):
        builder.attrs["orientations"] = len(asked.orientations)
        builder.attrs["orientation"] = _orientation(asked)
    builder.attrs["box"] = "found" if ranges.unsaid else "asked"
    builder.attrs["ranges"] = len(m.limits.drives) + len(m.limits.joints)
    builder.attrs["apart"] = found.apart
    length, n = builder.units.length, len(values)
    for name, along in asked.axes.items():
        builder.labels(name, along, f"{name} of the output", builder.name("length"))
    builder.labels("along", list(asked.axes), "axis of the grid")
    builder.add("inside", tuple(asked.axes), found.inside, "whether the node is in the region")
    builder.add("outside_by", tuple(asked.axes), found.why, "what keeps the mechanism from the node; empty: nothing")
    facets, coarse = found.facets(), found.coarse()
    size, half = enclosed(found.points, facets), enclosed(found.points, coarse)
    words = "area of the region" if n == 2 else "volume of the region"
    builder.add("size", (), np.array(size * length**n), words, "length", n)
    words = "how far the size by every second node is from it, and what tolerance and edges cut off leave"
    error = max(abs(size - half), _cut_off(found, facets)) + tolerance * facet_sizes(found.points, facets).sum()
    builder.add("size_error", (), np.array(error * length**n), words, "length", n)
    far = found.far > np.sqrt(n)
    builder.data["status"] = Variable((), np.array("ok" if found.inside.any() else "empty"), "", "outcome")
    if far and found.inside.any():
        builder.attrs["start"] = "apart"
    _add_shares(builder, found, facets)
    builder.add("vertex", ("point", "along"), found.points * length, "points of the boundary", "length")
    builder.add("vertex_bound", "point", found.bound, "what bounds the region at the point")
    builder.add("facet", ("piece", "corner"), facets, "points of the segments or triangles of the boundary")
    _add_inscribed(builder, found, facets, coarse, centre, tolerance)
    return builder.result()


def _orientation(asked: AskedGrid) -> str:
    """``angle = -10 to 10``: the orientations in words."""
    names = asked.orientations[0]
    every = {name: sorted({one[name] for one in asked.orientations}) for name in names}
    return ", ".join(
        f"{name} = {values[0]:g}" if len(values) == 1 else f"{name} from {values[0]:g} to {values[-1]:g}"
        for name, values in every.items()
    )


def _add_shares(builder: ResultBuilder, found: HeldRegion, facets: Ints) -> None:
    """Of what the boundary is, the largest part first."""
    names, numbers = np.unique(found.bound, return_inverse=True)
    sizes = facet_sizes(found.points, facets)
    shares = np.zeros(len(names))
    for corner in facets.T:
        np.add.at(shares, numbers[corner], sizes / len(facets.T))
    order = [k for k in np.argsort(-shares, kind="stable") if shares[k] > 0.0]
    builder.labels("bound", names[order], "what bounds the region")
    builder.add("share", "bound", shares[order] / max(shares.sum(), 1e-300), "part of the boundary")


def _cut_off(found: HeldRegion, facets: Ints) -> float:
    """What a boundary cuts of right edges between its bounds at most."""
    cut = facets[found.is_cut(facets)]
    corners, bounds = found.points[cut], found.bound[cut]
    across = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=3)
    across[bounds[:, :, None] == bounds[:, None]] = np.inf
    return 0.25 * float(facet_sizes(found.points, cut) @ across.min(axis=(1, 2), initial=np.inf))


def _add_inscribed(
    builder: ResultBuilder, found: HeldRegion, facets: Ints, coarse: Ints, centre: Floats | None, tolerance: float
) -> None:
    """The disc or ball, and the box."""
    n, length, spacing = len(found.values), builder.units.length, found.asked.spacing
    middle, ends = np.full(n, np.nan), np.full((2, n), np.nan)
    radius = radius_error = error = np.nan
    if found.inside.any() and (centre is None or _holds(found, facets, centre)):
        middle, radius = disc(found.points, facets, found.nodes, spacing, centre)
        ends = box(found.points, facets, found.holds, centre)
        if centre is None and _product(nodes := box_of_nodes(found.inside, found.values)) > 0.0:
            ends = max(ends, larger_box(found.points, facets, nodes, centred=False), key=_product)
        if len(coarse):
            radius_error = abs(radius - disc(found.points, coarse, middle[None], 2.0 * spacing, centre)[1])
            # From there, because the boundary by every second node may have ends of the region outside; and without
            # what may cut an edge off.
            is_centred, open_ = centre is not None, facets[~found.is_cut(facets)]
            rough = [larger_box(found.points, some, ends, centred=is_centred) for some in (coarse, open_)]
            again = (larger_box(found.points, facets, one, centred=is_centred) for one in rough)
            ends = max([ends, *again], key=_product)
            error = max(abs(_product(ends) - _product(one)) for one in rough)
            # Facets are off by as much again where they lean.
            error += _product(ends + 2.0 * tolerance * np.array([[-1.0], [1.0]])) - _product(ends)
            radius_error += tolerance
    elif centre is not None:
        builder.attrs["centre"] = "outside"
    if centre is not None:
        builder.attrs.setdefault("centre", "asked")
        middle = centre
    ball = "disc" if n == 2 else "ball"
    where = "about the given centre" if centre is not None else "in the region"
    builder.add("disc_centre", "along", middle * length, f"centre of the {ball}", "length")
    builder.add("disc_radius", (), np.array(radius * length), f"radius of the largest {ball} {where}", "length")
    words = "how far the radius by every second node is from it, and the tolerance"
    builder.add("disc_radius_error", (), np.array(radius_error * length), words, "length")
    builder.add("box_low", "along", ends[0] * length, f"lowest corner of the largest box {where}", "length")
    builder.add("box_high", "along", ends[1] * length, "highest corner of the box", "length")
    size = np.array(_product(ends) * length**n)
    builder.add("box_size", (), size, "area of the box" if n == 2 else "volume of the box", "length", n)
    words = "how far its size by every second node, or without edges that may be cut off, is from it, and the tolerance"
    builder.add("box_size_error", (), np.array(error * length**n), words, "length", n)


def _product(ends: Floats) -> float:
    """Area or volume of a box."""
    return float(np.prod(ends[1] - ends[0]))


def _holds(found: HeldRegion, facets: Ints, place: Floats) -> bool:
    """Whether a place is within the boundary: the angle at which it is seen from there is a whole turn."""
    corners = found.points[facets] - place
    if corners.shape[2] == 2:
        (ax, ay), (bx, by) = corners[:, 0].T, corners[:, 1].T
        return bool(np.arctan2(ax * by - ay * bx, ax * bx + ay * by).sum() > np.pi)
    a, b, c = (corners[:, k] for k in range(3))
    x, y, z = (np.linalg.norm(corner, axis=1) for corner in (a, b, c))
    # Van Oosterom and Strackee (1983).
    below = x * y * z + (a * b).sum(1) * z + (b * c).sum(1) * x + (c * a).sum(1) * y
    return bool(2.0 * np.arctan2(np.linalg.det(corners), below).sum() > 2.0 * np.pi)
