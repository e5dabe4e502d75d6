"""Limits and margins as variables of a result.

margin = min(high - largest value, lowest value - low)      negative where a limit is missed
"""

from collections.abc import Iterator, Sequence

import numpy as np

from jointplay.basics.arrays import Array
from jointplay.core.compile import LENGTHS
from jointplay.result import ROUNDING, SIDES, SIZES, Result, ResultBuilder, Variable

#: attribute of results in whose limits the target of the file does not count
PLAY_ALONE = "play_alone"
TOGETHER = " by structural error and play together"
#: what clearances that scatter are taken as beside their middle sizes
PLAYS = ("largest", "smallest")


def add_limits(builder: ResultBuilder) -> None:
    """Add the limits of the file to a result: `limit`, nan where there is none."""
    m = builder.m
    bounds = m.limits.bounds(m.quantities)
    words = "lowest and highest acceptable value"
    builder.add("limit", ("quantity", "side"), np.where(np.isfinite(bounds), bounds, np.nan), words, "quantity")


def judge(builder: ResultBuilder) -> None:
    """Add the limits to a result of errors, and whether and by how much they are kept: `limit_met`, `margin`."""
    add_limits(builder)
    limit = builder.data["limit"]
    margin = room(limit.values, *ends(Result(builder.coords, builder.data, builder.attrs)))
    limited = np.isfinite(limit.values).any(axis=1)
    met = ~limited | (margin >= -_roundings(builder))
    per = ("configuration", "quantity")
    builder.data["limit_met"] = Variable(per, met, "", "whether the quantity keeps to its limits")
    words = "how far the quantity is from its limits, negative where it is beyond one"
    builder.data["margin"] = Variable(per, margin, limit.units, words)


def add_play(builder: ResultBuilder, play: str, lowest: Array, highest: Array) -> None:
    """Add what quantities reach with clearances of the largest or the smallest play; nan where it is not known."""
    values = np.stack([lowest, highest], axis=-1)
    words = f"lowest and highest value with the {play} play"
    builder.add(f"play_{play}", ("configuration", "quantity", "side"), values, words, "quantity")


def ends_of_plays(result: Result) -> Iterator[tuple[str, Array, Array]]:
    """The name of every other choice of sizes that is judged, with the ends of every quantity, as `ends` gives them."""
    for play in PLAYS:
        if f"play_{play}" in result.data:
            low, high = np.moveaxis(result.get(f"play_{play}"), -1, 0)
            yield play, *_strayed(result, low, high)


def room(limit: Array, lowest: Array, highest: Array) -> Array:
    """How far values are from their limits; nan where there is no limit, or no value."""
    low, high = limit.T
    below, above = (np.where(np.isfinite(end), end, sign * np.inf) for end, sign in ((low, -1.0), (high, 1.0)))
    left = np.minimum(above - highest, lowest - below)
    return np.where((np.isfinite(low) | np.isfinite(high)) & np.isfinite(left), left, np.nan)


def _roundings(builder: ResultBuilder) -> Array:
    """What of every quantity is rounding, in the units of the result."""
    sizes = {"length": builder.m.length / builder.units.length, "angle": 1.0 / builder.units.angle}
    return ROUNDING * np.array([sizes[kind] for kind in builder.axes["quantity"].kinds])


def ends(result: Result) -> tuple[Array, Array]:
    """Lowest and highest value of every quantity, each (configuration, quantity).

    What a load leaves open counts: a component may be anywhere within its half-width, and a size is at most that of
    the farthest corner. Of corrected drives it is what is left that counts. With friction both sides count from which a
    configuration is reached, or all that it can hold at rest. With a target the structural error counts as well: to a
    size that the worst case or friction has it is added, which is a bound.
    """
    if "nominal_force" in result.data:
        low, high = (result.get("force", **({"side": side} if is_between(result) else {})) for side in SIDES)
        return low, high
    for found in ("worst", "residual"):
        if f"{found}_component" in result.data:
            low, high = (result.get(f"{found}_component", side=side) for side in SIDES)
            sizes = [result.get(f"{found}_{which}") for which in SIZES]
            nothing = map(np.zeros_like, sizes)
            return _strayed(result, np.column_stack([low, *nothing]), np.column_stack([high, *sizes]))
    error, half = judged(result)
    components = result.labels("component")
    if "friction_low" in result.data:
        low, high, position, rotation = (result.get(f"friction_{name}") for name in ("low", "high", *SIZES))
        return _strayed(result, *of_sizes(low, high, position, rotation))
    if "reversal" not in result.data:
        return reached([error], half, components)
    # The limits hold from whichever side the machine comes.
    other = error + result.get("reversal") * (-1.0 if result.attrs["approach"] == "forward" else 1.0)
    return reached([error, other], half, components)


def is_between(result: Result) -> bool:
    """Whether forces have a lowest and a highest value."""
    return "side" in result.data["force"].dims


def judged(result: Result) -> tuple[Array, Array]:
    """The errors that are judged, with those against the target, and what a load leaves open of each."""
    is_corrected = "correction" in result.data
    error = result.get("residual") - result.get("target") if is_corrected else result.get("error")
    if has_strays(result):
        error = error + np.nan_to_num(result.get("structural_deviation"))
    open_ = "residual_undetermined" if is_corrected else "undetermined"
    return error, result.get(open_) if open_ in result.data else np.zeros_like(error)


def has_strays(result: Result) -> bool:
    """Whether the nominal mechanism is compared with a target."""
    return "structural_deviation" in result.data


def play_alone(result: Result) -> str:
    """What is to be said where the structural error does not count."""
    return " by play alone" if has_strays(result) or PLAY_ALONE in result.attrs else ""


def together(result: Result) -> str:
    """The same where it does, if there is any."""
    return TOGETHER if has_strays(result) else play_alone(result)


def _strayed(result: Result, low: Array, high: Array) -> tuple[Array, Array]:
    """Ends of errors of play with the structural error: components move, its sizes are added."""
    if not has_strays(result):
        return low, high
    off = np.nan_to_num(result.get("structural_deviation"))
    sizes = np.column_stack(_sizes(off, result.labels("component")))
    return low + np.column_stack([off, np.zeros_like(sizes)]), high + np.column_stack([off, sizes])


def reached(errors: Sequence[Array], half: Array, components: Sequence[str]) -> tuple[Array, Array]:
    """Lowest and highest value of every quantity at some errors, with what a load leaves open of each."""
    position, rotation = np.max([_sizes(np.abs(error) + half, components) for error in errors], axis=0)
    return of_sizes(np.min(errors, axis=0) - half, np.max(errors, axis=0) + half, position, rotation)


def _sizes(error: Array, components: Sequence[str]) -> tuple[Array, Array]:
    moves = np.array([name in LENGTHS for name in components])
    return np.linalg.norm(error[:, moves], axis=1), np.linalg.norm(error[:, ~moves], axis=1)


def of_sizes(low: Array, high: Array, position: Array, rotation: Array) -> tuple[Array, Array]:
    """Ends of all quantities by those of the components and by the sizes, which have no lower end."""
    nothing = np.zeros_like(position)
    return np.column_stack([low, nothing, nothing]), np.column_stack([high, position, rotation])
