"""The batch engine against the plain solver: same numbers on every width of vector registers, for any
number of threads."""

import numpy as np
import pytest

from helpers.answers import EXAMPLES, example
from jointplay import _core
from jointplay.analyses.nominal import nominal
from jointplay.analyses.running import drive_units

WIDTHS = ["plain", "avx2", "avx512"]
#: examples with pins whose axial play moves the output to second order only, or guides that lean to either side
FLOATING = ("rssr", "3-upu", "stewart-gough", "delta", "delta-by-hand", "3-rrr-spherical", "excavator")
#: square of that play (30 um) over the length of an arm (30 mm), in characteristic lengths, a few times
SECOND_ORDER = 2e-7


@pytest.fixture(autouse=True)
def _width_of_before():
    before = _core.simd()
    yield
    _core.simd(before)


def _dense_path(mechanism, count):
    """The example's drive values, given or solved from its path, filled in between."""
    values = nominal(mechanism).drives
    at = np.linspace(0, len(values) - 1, count)
    return np.column_stack([np.interp(at, np.arange(len(values)), column) for column in values.T])


def _scale(mechanism, size):
    """The characteristic length of positions, one of angles and quaternions, for poses or errors of so many numbers."""
    lengths = 2 if size == 3 else 3
    return np.repeat([mechanism.length, 1.0], [lengths, size - lengths])


def _on_every_width(*questions):
    """The answer to the first of some questions, which is that to all of them, on every width and to the last bit."""
    answers = []
    for width in WIDTHS:
        _core.simd(width)
        answers += [ask() for ask in questions]
    for other in answers[1:]:
        for key, value in answers[0].items():
            assert np.array_equal(value, other[key], equal_nan=True), key
    return answers[0]


@pytest.mark.parametrize("name", EXAMPLES)
def test_samples_equal_the_plain_solver_on_every_width(name):
    mechanism = example(name)
    at = nominal(mechanism)
    core, drives, poses = mechanism.core, at.drives[-1:], at.poses[-1:]
    count = 1000  # not a whole number of blocks

    def draw(threads):
        return core.random(drives, poses, count, 3, np.array([0.5]), threads=threads, keep=True)

    first = _on_every_width(lambda: draw(1), lambda: draw(2))
    assert first["fallbacks"].sum() == 0
    given = core.given(np.repeat(drives, count, 0), np.repeat(poses, count, 0), first["kept_parameters"])
    # Relative to the size of the mechanism: rounding of positions does not shrink with the clearances.
    difference = np.abs(given["error"] - first["kept_errors"]) / _scale(mechanism, given["error"].shape[1])
    assert difference.max() < 1e-13


def _of_play(mechanism):
    """Rounding of what play counts, as a share: it widens with the distance of the centres, whose rounding is that of
    the mechanism's size."""
    spec = mechanism.core_spec
    meshes = {k for k, joint in enumerate(spec["joints"]) if "coupling" in joint}
    sets = [s["set"] for s in spec["sources"] if s["kind"] == "clearance" and s["joint"] in meshes]
    plays = [found["interval"]["high"] for found in sets if "interval" in found]
    return 4.0 * np.finfo(float).eps * mechanism.length / min(filter(None, plays), default=np.inf)


def _loaded_path(name):
    """A mechanism with loads, in the core too, and drives and poses along its path."""
    mechanism = example(name)
    if not mechanism.has_loads:
        pytest.skip("no load")
    drives = _dense_path(mechanism, 130)
    return mechanism, mechanism.core, drives, mechanism.core.trace(drives)["poses"]


@pytest.mark.parametrize("name", EXAMPLES)
def test_loaded_equals_the_plain_solver_on_every_width(name):
    mechanism, core, drives, poses = _loaded_path(name)
    result = _on_every_width(lambda: core.loaded(drives, poses))
    # Few configurations at a time are solved plainly.
    parts = [core.loaded(drives[i : i + 1], poses[i : i + 1]) for i in range(len(drives))]
    size = _scale(mechanism, result["error"].shape[1])
    scales = dict.fromkeys(("error", "error_first_order", "undetermined"), size)

    def difference(key):
        plain = np.concatenate([part[key] for part in parts]).astype(float)
        scale = scales.get(key, max(float(np.max(np.abs(plain))), 1e-300))
        return np.max(np.abs(plain - result[key]).reshape(len(drives), -1) / np.ravel(scale), axis=1, initial=0.0)

    for key in ("error_first_order", "contribution", "status"):
        assert difference(key).max() < max(1e-12, _of_play(mechanism) if key == "contribution" else 0.0), key
    for key in ("error", "undetermined", "reaction", "undetermined_contribution", "decided"):
        assert difference(key).max() < 1e-12, key
    # A pin that hangs between its shoulders is held there by forces of second order, which rounding is part of.
    decided = np.repeat(result["decided"], np.bincount([source for source, _ in core.parameters]), axis=1)
    plain = np.concatenate([part["offset"] for part in parts])
    apart = np.abs(plain - result["offset"]) / np.abs(plain).max()
    # An offset within a ball has the direction of a reaction, which is small beside the others in some rods.
    assert apart[decided].max(initial=0.0) < 1e-11
    assert apart.max() < 1e-6


@pytest.mark.parametrize("name", EXAMPLES)
def test_loaded_with_drives_beside_the_nominal_ones_equals_the_plain_solver(name):
    """What a correction asks: errors against the nominal pose, with the drives elsewhere."""
    mechanism, core, drives, poses = _loaded_path(name)
    drives = drives + 1e-3 * drive_units(mechanism) * np.sin(np.arange(drives.size)).reshape(drives.shape)
    result = _on_every_width(lambda: core.loaded(drives, poses, offset=False, details=False))
    parts = [core.loaded(drives[i : i + 1], poses[i : i + 1]) for i in range(len(drives))]
    size = _scale(mechanism, result["error"].shape[1])
    # A pin that hangs between its shoulders is held there by forces of second order, which rounding is part of.
    hangs = np.array([not part["decided"].all() for part in parts])
    most = np.where(hangs, 1e-10, 1e-12)
    for key in ("error", "undetermined"):
        plain = np.concatenate([part[key] for part in parts])
        assert ((np.abs(plain - result[key]) / size).max(axis=1) < most).all(), key
    assert np.array_equal(np.concatenate([part["status"] for part in parts]), result["status"])
    if core.isostatic and name not in FLOATING:
        assert result["fallbacks"] < 0.1 * len(drives)


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_first_order_equals_the_plain_solver_on_every_width(name):
    mechanism, core, drives, poses = _loaded_path(name)
    result = _on_every_width(lambda: core.loaded(drives, poses, exact=False))
    # Few configurations at a time are solved plainly.
    parts = [core.loaded(drives[i : i + 1], poses[i : i + 1], exact=False) for i in range(len(drives))]
    size = _scale(mechanism, result["error"].shape[1])
    scales = dict.fromkeys(("error", "error_first_order", "undetermined", "undetermined_contribution"), size)
    # An offset has the direction of a reaction, which rounding turns the more the smaller that is beside the others; it
    # matters as little then.
    bounds = {"offset": 1e-10, "contribution": max(1e-12, _of_play(mechanism))}
    for key in ("error", "undetermined", "undetermined_contribution", "decided", "reaction", "offset", "contribution"):
        plain = np.concatenate([part[key] for part in parts]).astype(float)
        scale = scales.get(key, max(float(np.abs(plain).max(initial=0.0)), 1e-300))
        assert (np.abs(plain - result[key]) / scale).max(initial=0.0) < bounds.get(key, 1e-12), key
    assert np.array_equal(np.concatenate([part["status"] for part in parts]), result["status"])
    assert np.array_equal(result["error"], result["error_first_order"], equal_nan=True)
    # What else is asked for changes nothing.
    light = _on_every_width(lambda: core.loaded(drives, poses, exact=False, offset=False, details=False))
    for key in ("error", "undetermined", "status", "iterations"):
        assert np.array_equal(light[key], result[key], equal_nan=True), key


@pytest.mark.parametrize("name", EXAMPLES)
def test_traced_poses_equal_the_plain_path(name):
    mechanism = example(name)
    core, drives = mechanism.core, _dense_path(mechanism, 400)
    traced = core.trace(drives)
    # Fewer rows than a block are followed one by one; full turns in between are not lost.
    parts = [core.trace(np.vstack([drives[:1], drives[i : i + 40]]))["poses"][1:] for i in range(0, 400, 40)]
    difference = np.abs(traced["poses"] - np.concatenate(parts)) / _scale(mechanism, mechanism.pose_size)
    assert difference.max() < 1e-13
    assert np.array_equal(traced["poses"], core.trace(drives)["poses"])


@pytest.mark.parametrize("count", [64, 70, 100, 128, 130, 200])
def test_a_drive_that_turns_by_half_a_turn_within_a_block_stays_on_its_branch(count):
    """A crank asked for a coarse turn was found half a turn off, where the sine of its angle has another root."""
    mechanism = example("rssr")
    core, drives = mechanism.core, np.linspace(0.0, 2 * np.pi, count)[:, None]
    poses = core.trace(drives)["poses"]
    parts = [core.trace(np.vstack([drives[:1], drives[i : i + 40]]))["poses"][1:] for i in range(0, count, 40)]
    difference = np.abs(poses - np.concatenate(parts)) / _scale(mechanism, mechanism.pose_size)
    assert difference.max() < 1e-12


@pytest.mark.parametrize("name", EXAMPLES)
def test_worst_equals_the_plain_solver_on_every_width(name):
    mechanism = example(name)
    core, drives = mechanism.core, _dense_path(mechanism, 5 if mechanism.pose_size == 3 else 3)
    poses = core.trace(drives)["poses"]
    first = _on_every_width(lambda: core.worst(drives, poses))
    # What becomes of a start does not depend on what is in the other lanes; the first configuration, in which
    # the elimination is planned, stays.
    for key, value in core.worst(drives[[0, 2]], poses[[0, 2]]).items():
        assert np.array_equal(value, first[key][[0, 2]], equal_nan=True), key
    few = slice(0, 5 if mechanism.pose_size == 3 else 1)
    plain = core.worst(drives[few], poses[few], lanes=False)
    # The plain solver tells how many starts there are; all of them settle on lanes but where pins float.
    floats = name in FLOATING
    assert first["fallbacks"].sum() <= (0.02 if floats else 0.005) * len(drives) * plain["fallbacks"].min()
    assert np.array_equal(first["status"][few], plain["status"])
    # Floating pins have summits side by side that differ in second order: which one a start leads to is chance.
    tolerance = SECOND_ORDER if floats else 1e-12
    by_component = _scale(mechanism, plain["component"].shape[1])[:, None]
    for key, scale in {"position": mechanism.length, "rotation": 1.0, "component": by_component}.items():
        assert np.max(np.abs(first[key][few] - plain[key]) / scale) < tolerance, key
    for key in ("position", "rotation", "component"):
        assert np.array_equal(first[f"{key}_first_order"][few], plain[f"{key}_first_order"]), key
    # In the plane the rotation needs no direction.
    assert first["rotation_direction"].shape[1] == (0 if mechanism.pose_size == 3 else 3)
    assert np.allclose(np.linalg.norm(first["direction"], axis=1), 1.0, rtol=0, atol=1e-12)


def test_drive_values_column_by_column_are_the_same():
    mechanism = example("3-rrr")
    drives = _dense_path(mechanism, 70)
    by_rows, by_columns = (mechanism.core.trace(order(drives)) for order in (np.ascontiguousarray, np.asfortranarray))
    assert np.array_equal(by_rows["poses"], by_columns["poses"])


def test_a_grid_that_does_not_spread_is_reached_at_its_seeds_only():
    mechanism = example("five-bar")
    at = nominal(mechanism)
    drives = _dense_path(mechanism, 80)
    seeds = [10, 11, 40]
    given = [drives, seeds, np.repeat(at.drives[:1], 3, 0), np.repeat(at.poses[:1], 3, 0), [False] * 3]
    found = mechanism.core.trace_grid([80], *given, spread=False)
    assert np.flatnonzero(found["status"] == 0).tolist() == seeds
    everywhere = mechanism.core.trace_grid([80], *given)
    assert (everywhere["status"] == 0).all()
    assert np.abs(found["poses"][seeds] - everywhere["poses"][seeds]).max() < 1e-9
