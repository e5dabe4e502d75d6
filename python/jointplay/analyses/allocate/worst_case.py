"""The worst case as a question of allocation.

To first order the worst error in a direction is a sum over the sources, each in proportion to its size:

    n . error <= sum over sources of h_s(A_s' n),   h_s the support function of its set

The direction in which it is largest at one plan gives a row that all plans have to keep to; for a component of the
error there is one direction only. The core finds both, the first order and the exact closure.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointplay.analyses.nominal import Nominal
from jointplay.basics.arrays import Floats
from jointplay.model.mechanism import Mechanism
from jointplay.result import axes_of

from .items import TINY, Item, Play
from .looks import Limit, Look, merged, sources_of


@dataclass(frozen=True)
class WorstLook(Look):
    """A look, and the rows that its first order gives.

        rows       parts @ x + rest = first at the plan; at every other plan a bound from below

    The rows hold for all plans.
    """

    #: `used` to first order
    first: Floats
    #: shape (limit, configuration, column)
    parts: Floats
    #: shape (limit, configuration)
    rest: Floats
    #: of the largest position error, shape (limit, configuration, axis)
    direction: Floats


class WorstCase:
    """Looks at plans by their worst case.

    Parameters
    ----------
    m : Mechanism
        With its patterns written out.
    items : sequence of Item
    limits : sequence of Limit
    places : mapping of output to Nominal
        The nominal configurations.
    starts : int
        As of `worst`.
    """

    def __init__(
        self,
        m: Mechanism,
        items: Sequence[Item],
        limits: Sequence[Limit],
        places: dict[str | None, Nominal],
        starts: int,
    ) -> None:
        self.m, self.items, self.limits, self.places, self.starts = m, items, limits, places, starts
        self.has_axial = any(option.play.axial > 0.0 for item in items for option in item.options)

    def look(self, values: Sequence[float]) -> WorstLook:
        """What a plan brings."""
        changed = self.m.with_(merged(self.items, values, probe=True))
        first = next(iter(self.places.values()))
        shape = (len(self.limits), len(first))
        used, linear, rest = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        width = sum(1 if item.is_formula else len(item.options) for item in self.items)
        parts = np.zeros((*shape, width))
        axes = 2 if self.m.data.space == "planar" else 3
        direction = np.zeros((*shape, axes))
        status = np.zeros(len(first), np.uint8)
        for output, at in self.places.items():
            part = changed.only(output)
            found = part.core.worst(at.drives, at.poses, self.starts)
            status = np.maximum(status, at.worse(found["status"]))
            extremes = axes_of(part)["extreme"].labels
            slopes = part.core.sensitivity(at.drives, at.poses)["source"] if self.has_axial else None
            for row, limit in enumerate(self.limits):
                if limit.output != output:
                    continue
                k = extremes.index(limit.extreme)
                sign = -1.0 if limit.side == "low" else 1.0
                shares = sign * found["contribution"][:, k] / limit.value
                exact, order = _figures(part, found, limit)
                used[row], linear[row] = sign * exact / limit.value, sign * order / limit.value
                direction[row] = found["direction"] if limit.quantity == "position" else 0.0
                parts[row], rest[row] = self._row(part, values, shares, slopes, found, limit)
        # Where the machine cannot stand nothing is used of any limit.
        away = ~np.all([place.counts for place in self.places.values()], axis=0)
        for array in (used, linear, parts, rest, direction):
            array[:, away] = 0.0
        status[away] = 0
        return WorstLook(used, status, linear, parts, rest, direction)

    def _row(
        self,
        part: Mechanism,
        values: Sequence[float],
        shares: Floats,
        slopes: Floats | None,
        found: object,
        limit: Limit,
    ) -> tuple[Floats, Floats]:
        """Parts of the columns and the rest, over the configurations."""
        rest = shares.sum(axis=1)
        columns: list[Floats] = []
        for item, value in zip(self.items, values, strict=True):
            own = shares[:, sources_of(part, item)].sum(axis=1)
            rest = rest - own
            along = np.zeros(len(shares)) if slopes is None else _along(part, item, slopes, found, limit)
            ends = scaled(item, value, own, along)
            if item.is_formula:
                # A straight line through both ends of the range.
                low, high = (option.size for option in item.options)
                slope = (ends[1] - ends[0]) / (high - low)
                rest = rest + ends[0] - slope * low
                columns.append(slope)
            else:
                columns += ends
        return np.stack(columns, axis=-1), rest


def _figures(m: Mechanism, found: object, limit: Limit) -> tuple[Floats, Floats]:
    """The exact figure and that to first order."""
    data: dict[str, Floats] = found  # type: ignore[assignment]
    if limit.quantity in ("position", "rotation"):
        return data[limit.quantity], data[f"{limit.quantity}_first_order"]
    at = (slice(None), m.components.index(limit.quantity), int(limit.side == "high"))
    return data["component"][at], data["component_first_order"][at]


def _along(m: Mechanism, item: Item, slopes: Floats, found: object, limit: Limit) -> Floats:
    """What a unit of axial play of an item adds in the direction of the extreme, over the limit."""
    data: dict[str, Floats] = found  # type: ignore[assignment]
    names = [f"{source}.along" for source in item.sizing.sources]
    columns = [k for k, name in enumerate(m.parameters) if name in names]
    moved = slopes[:, :, columns]
    if limit.quantity == "position":
        moved = np.einsum("ca,cap->cp", data["direction"], moved[:, : data["direction"].shape[1]])
    elif limit.quantity == "rotation":
        moved = np.einsum("ca,cap->cp", data["rotation_direction"], moved[:, -3:])
    else:
        moved = moved[:, m.components.index(limit.quantity)]
    return np.asarray(np.abs(moved).sum(axis=1) / limit.value)


def columns_of(item: Item) -> list[float]:
    """The values of an item's columns: of a formula both ends of its range."""
    return [option.size for option in item.options] if item.is_formula else [float(k) for k in range(len(item.options))]


def scaled(item: Item, value: float, part: Floats, axial: Floats) -> list[Floats]:
    """What an item adds to the error with each of the values of its columns.

    Parameters
    ----------
    value : float
        The value at which it adds `part`.
    part : ndarray
        What it adds.
    axial : ndarray
        What a unit of axial play adds, where that is part of it.
    """
    now = probed(item, value)
    radial = part - now.axial * axial
    plays = [item.play(column) for column in columns_of(item)]
    return [radial * (play.scale / now.scale if now.scale else 0.0) + play.axial * axial for play in plays]


def probed(item: Item, value: float) -> Play:
    """How large its set is where directions are looked for; not zero."""
    if item.is_formula or item.options[round(value)].size > 0.0:
        return item.play(value)
    largest = max(item.options, key=lambda option: option.size)
    return Play(largest.play.scale * TINY, largest.play.axial * TINY)
