"""Columns are declared once, in the core: what is typed on this side, and what comes out, is held against it."""

from typing import Any, get_type_hints

import numpy as np
import pytest

import jointplay as jp
from jointplay import _core, examples
from jointplay.analyses.nominal import nominal
from jointplay.core import answers, spec

TYPES: dict[str, Any] = {
    "measure": answers.Measured,
    "inverse": answers.Reached,
    "trace": answers.Traced,
    "nearness": answers.Nearness,
    "moving": answers.Moving,
    "given": answers.Given,
    "sensitivity": answers.Sensitivity,
    "jacobians": answers.Jacobians,
    "loaded": answers.Loaded,
    "loaded_specimens": answers.LoadedSpecimens,
    "worst": answers.Worst,
    "certificate": answers.Certificate,
    "region": answers.Region,
    "random": answers.Random,
}
#: counts over all configurations, which are no columns
TOTALS = {"loaded": {"fallbacks"}}
ELEMENTS = {
    "float64": answers.Floats,
    "uint64": answers.Counts,
    "bool": answers.Flags,
    "uint8": answers.Codes,
}
#: determinate, and over-constrained with elastic bodies
MECHANISMS = ("four-bar", "x-braced-square", "stewart-gough")


def asked(m: jp.Mechanism) -> dict[str, Any]:
    """What the core answers to every question."""
    at = nominal(m)
    drives, poses = at.drives[:2], at.poses[:2]
    u = m.core.specimens(len(drives), 1)
    levels = np.array([0.5, 0.9, 0.99])
    found: dict[str, Any] = {
        "measure": m.core.measure(drives, poses),
        "trace": m.core.trace(drives),
        "moving": m.core.moving(drives, poses, np.ones_like(drives), np.zeros_like(drives)),
        "given": m.core.given(drives, poses, u),
        "sensitivity": m.core.sensitivity(drives, poses),
        "jacobians": m.core.jacobians(drives, poses),
        "loaded": m.core.loaded(drives, poses),
        "loaded_specimens": m.core.loaded_specimens(drives[:1], poses[:1], u),
        "worst": m.core.worst(drives, poses, 2),
        "region": m.core.region(drives, poses, np.eye(2 if m.pose_size == 3 else 3)),
        "random": m.core.random(drives, poses, 16, 1, levels, keep=True),
    }
    worst = found["worst"]
    attained = worst["position"], worst["rotation"], worst["component"]
    found["certificate"] = m.core.certificate(drives, poses, *attained, 1)
    if m.core.isostatic:
        found["nearness"] = m.core.nearness(poses, m.length, [0, 1])
    return found


def test_the_types_have_the_columns_that_the_core_declares() -> None:
    """A column that is declared in the core and not typed here could not be used; a typed one might not exist."""
    assert set(TYPES) == set(_core.COLUMNS)
    for question, typed in TYPES.items():
        types = get_type_hints(typed)
        declared = _core.COLUMNS[question]
        assert set(types) == set(declared) | TOTALS.get(question, set()), question
        for name, (element, _) in declared.items():
            assert types[name] == ELEMENTS[element], (question, name)


@pytest.mark.parametrize("name", MECHANISMS)
def test_arrays_have_the_declared_elements_and_dimensions(name: str) -> None:
    """The same dimension has the same length in every column, and different columns of one row as many rows."""
    m = jp.loads(examples.text(name))
    sizes: dict[str, int] = {}
    for question, found in asked(m).items():
        declared = _core.COLUMNS[question]
        assert set(found) - set(declared) == TOTALS.get(question, set())
        rows = len(next(found[name] for name in ("status", "reason", "closure", "singular_value") if name in found))
        for column, (element, dims) in declared.items():
            if column not in found:
                continue
            array = found[column]
            assert array.dtype == np.dtype(element), (question, column)
            assert array.ndim == 1 + len(dims)
            assert len(array) == rows or column.startswith("kept_")
            for dim, size in zip(dims, array.shape[1:], strict=True):
                assert sizes.setdefault(dim, size) == size, (question, column, dim)
    assert sizes["component"] == len(m.components)
    assert sizes["source"] == len(m.sources)
    assert sizes["joint"] == len(m.joints)


def test_columns_that_are_not_asked_for_are_not_given() -> None:
    for name in MECHANISMS:
        m = jp.loads(examples.text(name))
        at = nominal(m)
        lean = m.core.loaded(at.drives, at.poses, offset=False, details=False)
        required = answers.Loaded.__required_keys__
        assert required <= set(lean)
        assert not set(lean) & {"offset", "reaction", "contribution", "decided", "undetermined_contribution"}


@pytest.mark.parametrize("name", examples.names())
def test_what_is_handed_to_the_core_has_the_typed_keys(name: str) -> None:
    m = jp.loads(examples.text(name))
    whole: Any = m.spec()
    assert set(whole) == spec.Spec.__required_keys__
    for part, typed in (
        ("points", spec.PointSpec),
        ("joints", spec.JointSpec),
        ("drives", spec.DriveSpec),
        ("loads", spec.LoadSpec),
        ("sources", spec.SourceSpec),
    ):
        keys = set(get_type_hints(typed))
        for entry in whole[part]:
            assert set(entry) <= keys
    for joint in whole["joints"]:
        assert set(joint.get("coupling", {})) <= set(get_type_hints(spec.CouplingSpec))
