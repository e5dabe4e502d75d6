"""The certificate of `worst`: upper bounds that hold for all offsets in the sets, on the exact closure.

What `worst` attains is a lower bound of the worst case. The core encloses all poses that the sets allow by interval
arithmetic and bounds the errors from above. Both together say how much the worst case can be missed by.
"""

from typing import cast

import numpy as np

from jointplay.basics.arrays import Array, Floats
from jointplay.core.answers import Worst
from jointplay.model.mechanism import Mechanism
from jointplay.result import ROUNDING, ResultBuilder

#: in front of the names of its columns beside those of `worst`
PREFIX = "certificate_"
#: parts of the sets that can be expanded for each of the bounds
MOST_PARTS = 1_000_000
#: why there is no bound, in the order of the core's numbers
REASONS = (
    "",
    "the mechanism is over-constrained or elastic",
    "the nominal mechanism, or the one in the middle of all sets, cannot be assembled",
    "the nominal pose is singular",
    "the poses could not be enclosed over all of the sets: they are too large, or a singular pose is too near",
    "the error could not be bounded within the limit of parts",
    "flanks would have to pass through each other in a part of the sets",
)
#: what a bound is moved outwards by, as a part of it, because its conversion to the units of the file rounds
ROUNDED = 2.0**-49


def certified(m: Mechanism, drives: Floats, poses: Floats, found: Worst, parts: int) -> Worst:
    """What `worst` has found with its bounds; after Ctrl-C of fewer configurations."""
    count = len(found["status"])
    attained = found["position"], found["rotation"], found["component"]
    bounds = m.core.certificate(drives[:count], poses[:count], *attained, parts, partly=True)
    done = len(bounds["reason"])
    both = {name: np.asarray(values)[:done] for name, values in found.items()} | {
        f"{PREFIX}{name}": values for name, values in bounds.items()
    }
    return cast("Worst", both)


def add_bounds(builder: ResultBuilder, worst: Worst) -> None:
    """Add the bounds and what they are worth to the result of `worst`."""
    found = {name.removeprefix(PREFIX): np.asarray(values) for name, values in worst.items() if name.startswith(PREFIX)}
    attained = {"position": worst["position"], "rotation": worst["rotation"]}
    certified = found["reason"] == 0
    # What is attained is computed to rounding, and can be above its bound by as much. A higher bound holds, too.
    for name, kind in (("position", "length"), ("rotation", "angle")):
        bound = np.where(certified, np.maximum(_above(found[name]), attained[name]), np.nan)
        words = f"upper bound of the largest {name} error, for all offsets in the sets"
        builder.add(f"worst_{name}_certified", "configuration", bound, words, kind)
        words = f"upper bound of the largest {name} error, as a part above the value that is attained"
        resting = ROUNDING * (builder.m.length if kind == "length" else 1.0)
        builder.add(f"worst_{name}_gap", "configuration", _gap(attained[name], bound, resting), words)
    low, high = np.moveaxis(found["component"], -1, 0)
    lowest, highest = np.moveaxis(np.asarray(worst["component"]), -1, 0)
    ends = np.stack([np.minimum(-_above(-low), lowest), np.maximum(_above(high), highest)], axis=-1)
    ends[~certified] = np.nan
    words = "bounds of the lowest and highest error of the component, for all offsets in the sets"
    builder.add("worst_component_certified", ("configuration", "component", "side"), ends, words, "component")
    builder.add("certified", "configuration", certified, "whether there are bounds")
    words = "whether it is proved that there is one pose, and no singular one, for all offsets in the sets"
    builder.add("certified_assembly", "configuration", found["assembled"], words)
    reasons = np.array(REASONS)[found["reason"].astype(int)]
    builder.add("certified_reason", "configuration", reasons, "why there are no bounds")
    words = "number of parts of the sets that were expanded"
    builder.add("certified_parts", "configuration", found["parts"], words)
    if endless := [source.name for source in builder.m.compiled_sources if source.spec["law"] == "gauss"]:
        builder.attrs["bounded_at_three_sigma"] = ", ".join(endless)


def _above(values: Array) -> Array:
    """Numbers that stay above after a conversion of their unit."""
    raised: Array = values + np.abs(values) * ROUNDED
    return raised


def _gap(value: Array, bound: Array, resting: float) -> Array:
    """By which part a bound is above a value.

    Zero where the bound proves that nothing moves but by rounding; nan where nothing is attained, of which no bound is
    a multiple.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        above = np.where(value > resting, bound / value - 1.0, np.nan)
        gap: Array = np.where(bound > resting, above, 0.0 * bound)
    return gap
