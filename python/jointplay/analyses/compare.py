"""`compare`: two or more mechanisms on the same path of the output.

The drives of all others are solved so that their outputs follow the nominal output of the first; all are then asked
the same question.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.basics import poses
from jointplay.basics.typed import typed
from jointplay.errors import InputError, listed, not_known, shown
from jointplay.file.carried import LETTERS
from jointplay.model.mechanism import Mechanism
from jointplay.model.mobility import require_determinate
from jointplay.result import Result, Variable, align, axes_of, split, stack, to_dataset

from .beside import judged, said, with_forces
from .nominal import Nominal, bounded, follow, nominal, report, within_another
from .questions import check, computation
from .recorded import recorded

if TYPE_CHECKING:
    import xarray as xr

#: as many have attributes of their own in results
MOST = len(LETTERS)


@typed
def compare(
    a: Mechanism,
    b: Mechanism,
    *more: Mechanism | str,
    question: str = "worst",
    components: Sequence[str] | None = None,
    names: Sequence[str] | None = None,
    **options: Any,
) -> xr.Dataset:
    """Ask two or more mechanisms the same question on the same path.

    Parameters
    ----------
    a : Mechanism
        Gives the path: the nominal poses of its output.
    b : Mechanism
        Its drives are solved from the path; its own drive values do not matter.
    *more : Mechanism
        Further ones, which follow it as `b` does. The question may stand behind them, without its name.
    question : str
        Such as ``worst``; `jointplay compare --help` lists all that can be asked.
    components : sequence of str, optional
        What the others have to follow, of x, y, angle (in space x, y, z, rx, ry, rz), in the least squares sense; all
        with as many drives or more, else the position.
    names : sequence of str, optional
        A label for each; the names of their files if left out.
    **options
        Of the question, such as ``samples`` and ``seed``. Of ``compensate``: ``target``, ``weights``, and ``corrects``,
        which is what its argument `question` is.

    Returns
    -------
    xarray.Dataset
        The variables of the question over `mechanism` and `configuration`, in the units of `a`; `drive_value` (nan for
        the drives of others) and `mismatch` (nominal pose - that of `a`). Where `a` has no pose there is nothing
        to follow: others are ``not_assembled`` there, with all numbers nan. Where a file limits forces also
        `forces_outcome` (``held``, ``missed`` or ``not shown`` in the worst case), with `forces_used` and where it is.

    Examples
    --------
    >>> import jointplay as jp
    >>> four, other = (jp.loads(jp.examples.text(name), name) for name in ("four-bar", "p3r"))
    >>> result = jp.compare(four, other)
    >>> bool((result.worst_position.sel(mechanism="four-bar") < result.worst_position.sel(mechanism="p3r")).all())
    True
    """
    texts = [one for one in more if isinstance(one, str)]
    others = [one for one in more if isinstance(one, Mechanism)]
    if texts:
        if len(texts) > 1 or more[-1] != texts[0]:
            raise TypeError(f"compare(): the question is one text behind the mechanisms, not {shown(texts)} among them")
        question = texts[0]
    return to_dataset(compute(a, b, question, others=others, components=components, names=names, **options))


@recorded
def compute(
    a: Mechanism,
    b: Mechanism,
    question: str = "worst",
    *,
    others: Sequence[Mechanism] = (),
    components: Sequence[str] | None = None,
    names: Sequence[str] | None = None,
    **options: Any,
) -> Result:
    """The light form of `compare`."""
    check(question, options, "compare")
    ask = computation(question, "compare")
    followers = (b, *others)
    every = (a, *followers)
    if len(every) > MOST:
        raise InputError(f"at most {MOST} mechanisms are compared, not {len(every)}")
    for m in followers:
        _check_alike(a, m)
    followed = [_components(m, components) for m in followers]
    labels = _labels(every, names)
    for m in followers:
        require_determinate(m, over_constrained=True)
    first = nominal(a)
    at = [first, *(_following(a, m, first, those) for m, those in zip(followers, followed, strict=True))]
    with within_another():
        results = [_side(m, ask(m, at=one, **options), one, first) for m, one in zip(every, at, strict=True)]
        if any(m.limits.forces for m in every):
            of_forces = [judged(m, at=one) or said("") for m, one in zip(every, at, strict=True)]
            results = [with_forces(one, found) for one, found in zip(results, of_forces, strict=True)]
    aligned = align(_without_clash(every, results))
    along = Variable(("mechanism",), np.array(labels, dtype=str), "", "mechanism")
    attrs = {**aligned[0].attrs, "title": " | ".join(m.title or Path(m.file).name for m in every)}
    told = dict.fromkeys(", ".join(those) for those in followed)
    attrs |= {"file": " | ".join(Path(m.file).name for m in every), "components": " | ".join(told)}
    attrs.pop("drives", None)
    return stack(aligned, along, attrs)


def _check_alike(a: Mechanism, b: Mechanism) -> None:
    """Refuse what cannot be compared."""
    if a.components != b.components:
        spaces = f"{a.data.space} and {b.data.space}"
        raise InputError(f"one moves in the plane and one in space ({spaces}), so their errors cannot be compared")
    if a.outputs != b.outputs or a.load_cases != b.load_cases:
        held = " and ".join(f"{listed(m.outputs)} (load cases: {listed(m.load_cases)})" for m in (a, b))
        raise InputError(f"mechanisms are compared by the same outputs and load cases; here: {held}")


def _following(a: Mechanism, b: Mechanism, first: Nominal, followed: tuple[str, ...]) -> Nominal:
    """Where a mechanism follows the path of the first."""
    # With the same drives it is looked for beside their values: the output may be at a place more than once.
    beside = first.drives if a.drives == b.drives else None
    return replace(bounded(b, follow(b, first.output, followed, beside), path=True), units=a.units)


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


def _without_clash(every: Sequence[Mechanism], results: Sequence[Result]) -> list[Result]:
    """A drive that has the name of one of a former mechanism, but another unit, gets the number of its own."""
    known: dict[str, str] = {}
    found = []
    for number, (m, result) in enumerate(zip(every, results, strict=True), 1):
        kinds = dict(zip(m.drives, axes_of(m)["drive"].kinds, strict=True))
        names = [f"{name} ({number})" if known.get(name, kind) != kind else name for name, kind in kinds.items()]
        known |= dict(zip(names, kinds.values(), strict=True))
        drive = Variable(("drive",), np.array(names, dtype=str))
        found.append(Result({**result.coords, "drive": drive}, result.data, result.attrs) if number > 1 else result)
    return found


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


def _labels(every: Sequence[Mechanism], names: Sequence[str] | None) -> list[str]:
    if names is not None:
        if isinstance(names, str) or len(names) != len(every):
            count = 1 if isinstance(names, str) else len(names)
            raise InputError(f"{len(every)} mechanisms need {len(every)} names, not {count}", key="names")
        twice = next((name for name in names if list(names).count(name) > 1), None)
        if twice is not None:
            raise InputError(f"every mechanism needs a name of its own; '{twice}' is there twice", key="names")
        return [*names]
    found: list[str] = []
    for number, m in enumerate(every, 1):
        stem = Path(m.file).stem
        found.append(f"{stem} ({number})" if stem in found else stem)
    return found
