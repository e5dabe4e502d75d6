"""`compare`: two mechanisms on the same path of the output.

The second one's drives are solved so that its output follows the nominal output of the first; both are then asked the
same question.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.basics import poses
from jointplay.basics.typed import typed
from jointplay.errors import InputError, listed, not_known
from jointplay.model.mechanism import Mechanism
from jointplay.model.mobility import require_determinate
from jointplay.result import Result, Variable, align, axes_of, split, stack, to_dataset

from .nominal import Nominal, bounded, follow, nominal, report, within_another
from .questions import check, computation
from .recorded import recorded

if TYPE_CHECKING:
    import xarray as xr


@typed
def compare(
    a: Mechanism,
    b: Mechanism,
    question: str = "worst",
    *,
    components: Sequence[str] | None = None,
    names: tuple[str, str] | None = None,
    **options: Any,
) -> xr.Dataset:
    """Ask two mechanisms the same question on the same path.

    Parameters
    ----------
    a : Mechanism
        Gives the path: the nominal poses of its output.
    b : Mechanism
        Its drives are solved from the path; its own drive values do not matter.
    question : str
        Such as ``worst``; `jointplay compare --help` lists all that can be asked.
    components : sequence of str, optional
        What `b` has to follow, of x, y, angle (in space x, y, z, rx, ry, rz), in the least squares sense; all with as
        many drives or more, else the position.
    names : (str, str), optional
        Labels of the two; the names of their files if left out.
    **options
        Of the question, such as ``samples`` and ``seed``. Of ``compensate``: ``target``, ``weights``, and ``corrects``,
        which is what its argument `question` is.

    Returns
    -------
    xarray.Dataset
        The variables of the question over `mechanism` and `configuration`, in the units of `a`; `drive_value` (nan for
        the drives of the other one) and `mismatch` (nominal pose - that of `a`). Where `a` has no pose there is nothing
        to follow: `b` is ``not_assembled`` there, with all numbers nan.

    Examples
    --------
    >>> import jointplay as jp
    >>> four, other = (jp.loads(jp.examples.text(name), name) for name in ("four-bar", "p3r"))
    >>> result = jp.compare(four, other)
    >>> bool((result.worst_position.sel(mechanism="four-bar") < result.worst_position.sel(mechanism="p3r")).all())
    True
    """
    return to_dataset(compute(a, b, question, components=components, names=names, **options))


@recorded
def compute(
    a: Mechanism,
    b: Mechanism,
    question: str = "worst",
    *,
    components: Sequence[str] | None = None,
    names: tuple[str, str] | None = None,
    **options: Any,
) -> Result:
    """The light form of `compare`."""
    check(question, options, "compare")
    ask = computation(question, "compare")
    if a.components != b.components:
        spaces = f"{a.data.space} and {b.data.space}"
        raise InputError(f"one moves in the plane and one in space ({spaces}), so their errors cannot be compared")
    if a.outputs != b.outputs or a.load_cases != b.load_cases:
        held = " and ".join(f"{listed(m.outputs)} (load cases: {listed(m.load_cases)})" for m in (a, b))
        raise InputError(f"two mechanisms are compared by the same outputs and load cases; here: {held}")
    followed = _components(b, components)
    labels = _labels(a, b, names)
    require_determinate(b, over_constrained=True)
    first = nominal(a)
    # With the same drives it is looked for beside their values: the output may be at a place more than once.
    beside = first.drives if a.drives == b.drives else None
    second = replace(bounded(b, follow(b, first.output, followed, beside), path=True), units=a.units)
    with within_another():
        results = [_side(m, ask(m, at=at, **options), at, first) for m, at in ((a, first), (b, second))]
    aligned = align(_without_clash(a, b, results))
    along = Variable(("mechanism",), np.array(labels, dtype=str), "", "mechanism")
    attrs = {**aligned[0].attrs, "title": " | ".join(m.title or Path(m.file).name for m in (a, b))}
    attrs |= {"file": " | ".join(Path(m.file).name for m in (a, b)), "components": ", ".join(followed)}
    attrs.pop("drives", None)
    return stack(aligned, along, attrs)


def _side(m: Mechanism, result: Result, at: Nominal, path: Nominal) -> Result:
    """One mechanism's part: its drive values as a variable, and how far it is from the path."""
    builder = report(m, "compare", at)
    builder.add("drive_value", ("configuration", "drive"), at.drives, "drive value", "drive")
    mismatch = poses.difference(at.output, path.output)
    builder.add(
        "mismatch", ("configuration", "component"), mismatch, "nominal pose - nominal pose of the first", "component"
    )
    extra = builder.result()
    # A drive of one part may have the name of a dimension of the other.
    coords = {name: v for part in (result, extra) for name, v in part.coords.items() if name not in part.drives}
    return Result(coords, {**extra.data, **result.data}, result.attrs)


def _without_clash(a: Mechanism, b: Mechanism, results: list[Result]) -> list[Result]:
    """A drive of the second that has the name of one of the first, but another unit, gets a number."""
    kinds = [dict(zip(m.drives, axes_of(m)["drive"].kinds, strict=True)) for m in (a, b)]
    first, second = results
    names = [f"{name} (2)" if kinds[0].get(name, kind) != kind else name for name, kind in kinds[1].items()]
    drive = Variable(("drive",), np.array(names, dtype=str))
    return [first, Result({**second.coords, "drive": drive}, second.data, second.attrs)]


def _components(b: Mechanism, components: Sequence[str] | None) -> tuple[str, ...]:
    if components is None:
        lengths, _ = split(list(b.components))
        return b.components if len(b.drives) >= len(b.components) else tuple(lengths)
    chosen = (components,) if isinstance(components, str) else tuple(components)
    for name in chosen:
        if name not in b.components:
            raise InputError(not_known(str(name), "a component", b.components), key="components")
    if not chosen:
        raise InputError(f"name at least one of {', '.join(b.components)}", key="components")
    _, angles = split(list(b.components))
    if 0 < sum(name in angles for name in chosen) < len(angles):
        raise InputError(f"{', '.join(angles)} are one rotation and belong together", key="components")
    return chosen


def _labels(a: Mechanism, b: Mechanism, names: tuple[str, str] | None) -> tuple[str, str]:
    if names is not None:
        if len(names) != 2:
            raise InputError(f"two mechanisms need two names, not {len(names)}", key="names")
        first, second = names
        if first == second:
            raise InputError(f"two mechanisms need two names, not twice '{first}'", key="names")
        return first, second
    first, second = (Path(m.file).stem for m in (a, b))
    return (first, second) if first != second else (first, f"{second} (2)")
