"""Files with several outputs and load cases, and the files of one output and one load case that they are made of."""

import copy
import tomllib
from typing import Any

import numpy as np
import xarray as xr

import jointplay as jp

Raw = dict[str, Any]


def raw_of(name: str) -> Raw:
    """The data of a bundled example whose loads all say where they act, with two configurations at most."""
    raw = tomllib.loads(jp.examples.text(name))
    for load in raw.get("loads", []):
        if load.setdefault("body", raw["output"]["body"]) == raw["output"]["body"]:
            load.setdefault("at", raw["output"].get("at", [0.0] * (3 if raw.get("space") == "spatial" else 2)))
    for drive in raw.get("drives", {}).values():
        if "count" in drive:
            drive["count"] = 2
        if "values" in drive:
            drive["values"] = drive["values"][:2]
    return raw


def together(raw: Raw, outputs: Raw, load_cases: Raw | None = None) -> Raw:
    """A file with several outputs, and with load cases in the place of its loads."""
    whole = {key: value for key, value in copy.deepcopy(raw).items() if key != "output"}
    whole |= {"outputs": copy.deepcopy(outputs)}
    if load_cases is not None:
        whole |= {"load_cases": load_cases}
    return whole


def alone(whole: Raw, output: str | None = None, load_case: str | None = None) -> Raw:
    """The file with one of the outputs and one of the load cases only, as somebody would write it."""
    raw = {key: value for key, value in copy.deepcopy(whole).items() if key not in ("outputs", "load_cases")}
    if output is not None:
        raw["output"] = copy.deepcopy(whole["outputs"][output])
        own = raw["output"].pop("limits", {})
        raw["output"].pop("leads", None)
        if own:
            raw["limits"] = raw.get("limits", {}) | own
    if load_case is not None:
        raw["loads"] = [*raw.get("loads", []), *whole["load_cases"][load_case]]
    return raw


def assert_same(part: xr.Dataset, single: xr.Dataset) -> None:
    """The same numbers to the bit for everything that the single file has; where it has no label nothing is there."""
    for name, expected in single.data_vars.items():
        found = part[name]
        for dim in expected.dims:
            # A file of its own has other pieces of an elastic body.
            if dim in expected.coords and found[dim].values.tolist() != expected[dim].values.tolist():
                found = found.sel({dim: expected[dim].values})
        assert found.dims == expected.dims, name
        equal = np.array_equal(found.values, expected.values, equal_nan=expected.dtype.kind == "f")
        assert equal, f"{name}: {np.abs(found.values - expected.values).max() if expected.dtype.kind == 'f' else ''}"
