"""The shares of specimens outside the limits where the load decides the offsets, beside those where they scatter.

outside_loaded = max over the load cases of the share outside under the loads of the case

A yield is required of the machine that works: where a load presses every joint to one side, specimens whose offsets
scatter are not those that work. A specimen under load takes ten times as long as one whose offsets are drawn, so that
at every configuration as many are drawn as decide whether a required yield is met, of all those that are drawn without
the load.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Flags
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, Variable, coordinate_names

from .nominal import Nominal, Progress, carried, nominal
from .running import CONTACT, SPEEDS
from .several import share

#: what is found of every share, and how where it was searched for
ENDS = ("", "_low", "_high", "_method")
#: asks a part of the mechanism at its configurations
Asker = Callable[[Mechanism, Nominal | None, int, Progress | None], Result]
#: specimens that are drawn first, and where somebody waits for a page
FEW, FEWER = 16_384, 1024


def counts_too(m: Mechanism) -> bool:
    """Whether the file has limits and loads, and does not say where clearances are."""
    outputs = m.outputs or (None,)
    return bool(m.has_loads and not m.limits.contact and any(m.only(name).limits.errors for name in outputs))


def cases(m: Mechanism) -> list[tuple[str, Mechanism]]:
    """The mechanism in every load case in which something loads it, with its name; without a name where it has none."""
    every = [(name, m.only(load_case=name)) for name in m.load_cases] or [("", m)]
    return [(name, part) for name, part in every if part.has_loads]


def in_cases(
    m: Mechanism, at: Nominal | None, samples: int, ask: Asker, progress: Progress | None, few: int = FEW
) -> list[Result]:
    """The answers in every load case: of few specimens at the configurations where they decide, of all at others."""
    found = [(part, at if at is None or part is m else carried(at, m, part)) for _, part in cases(m)]
    count = min(samples, few)
    answers = [
        ask(part, here, count, None if progress is None else share(progress, k, len(found) + 1))
        for k, (part, here) in enumerate(found, 1)
    ]
    while count < samples and (is_open := np.any([_is_open(answer) for answer in answers], axis=0)).any():
        count = min(4 * count, FEW, samples) if count < FEW else samples
        answers = [
            _with_more(answer, part, here, count, np.flatnonzero(is_open), ask)
            for answer, (part, here) in zip(answers, found, strict=True)
        ]
    return answers


def _is_open(result: Result) -> Flags:
    """Where a required yield is neither met nor missed for sure, by configuration."""
    outside = 1.0 - float(result.attrs.get("required_yield", np.nan))
    is_open = (result.get("outside_low") < outside) & (outside < result.get("outside_high"))
    # Of several outputs each counts.
    return np.asarray(is_open.reshape(-1, is_open.shape[-1]).any(axis=0))


def _with_more(
    result: Result, part: Mechanism, at: Nominal | None, count: int, places: NDArray[np.intp], ask: Asker
) -> Result:
    """The shares with more specimens at some configurations."""
    if len(places) == result.sizes["configuration"] or part.loads.vary or part.motion is not None:
        # Loads and speeds go by the number of the configuration.
        return ask(part, at, count, None)
    more = ask(part, (at or nominal(part)).chosen(places), count, None)
    data = dict(result.data)
    for name in (f"outside{end}" for end in ENDS if f"outside{end}" in data):
        values = data[name].values.astype(np.result_type(data[name].values, more.data[name].values))
        values[..., places] = more.data[name].values
        data[name] = replace(data[name], values=values)
    return replace(result, data=data, attrs={**result.attrs, "samples": more.attrs["samples"]})


def beside(result: Result, m: Mechanism, answers: Sequence[Result]) -> Result:
    """A result with the largest shares outside over the load cases; unknown where one case is unknown."""
    own = result.data["outside"]
    high = np.stack([answer.get("outside_high") for answer in answers])
    unknown = np.isnan(high).any(axis=0)
    largest = np.where(unknown, 0, np.where(np.isnan(high), -np.inf, high).argmax(axis=0))
    data = dict(result.data)
    for end in (end for end in ENDS if f"outside{end}" in result.data):
        values = np.stack([answer.get(f"outside{end}") for answer in answers])
        chosen = np.take_along_axis(values, largest[None], axis=0)[0]
        words = f"{result.data[f'outside{end}'].long_name}, where the load decides the offsets"
        nothing: str | float = "" if end == "_method" else np.nan
        data[f"outside_loaded{end}"] = Variable(own.dims, np.where(unknown, nothing, chosen), "", words)
    if m.load_cases:
        names = np.array([name for name, _ in cases(m)])
        words = "load case with the largest share"
        data["outside_loaded_case"] = Variable(own.dims, np.where(unknown, "", names[largest]), "", words)
    if "contact" in answers[0].data:
        each = np.stack([answer.get("contact")[..., None] == np.array(CONTACT) for answer in answers])
        worst = np.where(each.any(axis=(0, -2)), np.arange(1, len(CONTACT) + 1), 0).max(axis=-1)
        words = "whether contact follows the reactions; empty: not judged"
        data["contact_loaded"] = Variable(own.dims, np.array(["", *CONTACT])[worst], "", words)
    attrs = {**result.attrs, "samples_loaded": answers[0].attrs["samples"]}
    attrs |= {name: answers[0].attrs[name] for name in SPEEDS if name in answers[0].attrs}
    return _without_clash(replace(result, data=data, attrs=attrs))


def _without_clash(result: Result) -> Result:
    """A drive that is called like one of these variables has another name in the result."""
    others = {name: v for name, v in result.coords.items() if name not in result.drives}
    taken = {*result.sizes, *result.data, *result.attrs, *others}
    names = coordinate_names([*result.drives], taken)
    drives = dict(zip(names, result.drives.values(), strict=True))
    attrs = {**result.attrs, "drives": ", ".join(names)} if names else result.attrs
    return replace(result, coords={**drives, **others}, attrs=attrs)
