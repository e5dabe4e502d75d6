"""The bundled examples, their answers and refusals, as the tests of the Python interface ask for them."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

import jointplay as jp
from jointplay.errors import InputError
from jointplay.model.mobility import require_determinate

#: the examples that hold their bodies more than once
OVER_CONSTRAINED = (
    "redundant-bar",
    "x-braced-square",
    "antenna-support",
    "sarrus",
    "bennett",
    "four-legged-platform",
    "ball-screw",
    "planetary-gear",
)
#: those that hold them once, by drives that give way
YIELDING = ("arm-with-gearboxes",)
EXAMPLES = tuple(name for name in jp.examples.names() if name not in (*OVER_CONSTRAINED, *YIELDING))


def example(name: str, **changes: Any) -> jp.Mechanism:
    """A bundled mechanism; of several outputs and load cases the first."""
    m = jp.loads(jp.examples.text(name), f"{name}.toml")
    m = m.only(*(next(iter(names), None) for names in (m.outputs, m.load_cases)))
    return m.with_({key.replace("__", "."): value for key, value in changes.items()}) if changes else m


def ask(question: str, m: jp.Mechanism) -> xr.Dataset:
    if question == "random":
        return jp.random(m, samples=2000)
    if question == "given":
        return jp.given(m, {m.parameters[0]: 0.001})
    return getattr(jp, question)(m)


def distance(error: xr.DataArray) -> np.ndarray:
    lengths = [component for component in error.component.values if component in ("x", "y", "z")]
    return np.linalg.norm(error.sel(component=lengths).transpose(..., "component").values, axis=-1)


def refusal(text: str) -> str:
    """What is said of a mechanism file that does not do."""
    with pytest.raises(InputError) as caught:
        require_determinate(jp.loads(text, "file.toml"))
    assert str(caught.value).startswith("file.toml: ")
    assert str(caught.value).isprintable(), "one line, no control characters"
    return str(caught.value)


def require_refused(text: str, old: str, new: str, key: str, said: str) -> None:
    """With a change a mechanism file does not do, which is told with the key and in these words."""
    assert old in text
    begin = f"file.toml: {key}: " if key else "file.toml: "
    found = refusal(text.replace(old, new, 1))
    assert found.startswith(begin), found
    assert said in found.removeprefix(begin), found


def same(ours: xr.Dataset, theirs: xr.Dataset, own: tuple[str, ...] = ("fingerprint",)) -> None:
    """Every bit of every variable and coordinate, and all attributes but those of each run."""
    assert {*ours.variables} == {*theirs.variables}
    for name in ours.variables:
        a, b = ours[name], theirs[name]
        assert (a.dims, a.attrs) == (b.dims, b.attrs), name
        assert a.values.tobytes() == b.values.astype(a.dtype).tobytes(), name
    attributes = [{k: v for k, v in d.attrs.items() if k not in own} for d in (ours, theirs)]
    assert attributes[0] == attributes[1]
