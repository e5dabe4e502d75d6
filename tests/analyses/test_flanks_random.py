"""Random specimens of over-constrained mechanisms with couplings, where bearing play opens the play between flanks."""

import numpy as np
import pytest

import jointplay as jp
from helpers.couplings import NOT_ASSEMBLABLE, OK, STRAINED, pair, planetary
from jointplay.model.mechanism import in_core

PRESSURE = np.radians(20.0)


def _outside(sources, offsets):
    """By which part of its set the offset that is farthest outside is so, specimen by specimen."""
    first, outside = 0, np.full(len(offsets), -1.0)
    for source in sources:
        size = len(source["centre"])
        own = offsets[:, first : first + size] - np.array(source["centre"])
        first += size
        if source["kind"] != "clearance":
            continue
        ((kind, sizes),) = source["set"].items()
        if kind == "interval":
            low, high = sizes["low"], sizes["high"]
            used = np.abs(own[:, 0] - 0.5 * (low + high)) / (0.5 * (high - low))
        else:
            assert kind == "disc"
            used = np.hypot(*own.T) / sizes["radius"]
        outside = np.maximum(outside, used - 1.0)
    return outside


def _drawn(core, samples, drives, **options):
    poses = core.trace(drives)["poses"]
    drawn = core.random(drives, poses, samples, 3, np.array([0.5]), keep=True, **options)
    return poses, drawn


def _is_closed(core, drives, poses, drawn):
    """The offsets that are told close the mechanism to the error that is told."""
    some = np.flatnonzero(drawn["kept_status"] == OK)[:500]
    n = len(some)
    given = core.given(np.repeat(drives, n, 0), np.repeat(poses, n, 0), drawn["kept_parameters"][some])
    np.testing.assert_array_equal(given["status"], OK)
    np.testing.assert_allclose(given["error"], drawn["kept_errors"][some], atol=1e-12)


def _loose(radius, play, law="uniform", **options):
    m = planetary(torque=1.0, **options)
    for k, joint in enumerate(m.joints):
        is_gear = joint["kind"] == "gear"
        m.source("clearance", play if is_gear else {"disc": {"radius": radius}}, law=law, joint=k)
    return m


def _keep_to_their_clearances(core, sources, count):
    drives = np.zeros((1, 1))
    poses, drawn = _drawn(core, count, drives)
    np.testing.assert_array_equal(drawn["kept_status"], OK)
    assert _outside(sources, drawn["kept_parameters"]).max() <= 1e-9
    _is_closed(core, drives, poses, drawn)


def test_specimens_of_the_bundled_planetary_gear_keep_to_their_clearances():
    """One specimen of ten had an offset up to 14 % outside its clearance: the section of a flank's play was linear in
    the offsets, and what moved the centres of the wheels was corrected afterwards."""
    spec = jp.loads(jp.examples.text("planetary-gear")).core_spec
    _keep_to_their_clearances(in_core(spec), spec["sources"], 4000)


@pytest.mark.parametrize("law", ["uniform", "normal"])
@pytest.mark.parametrize(("radius", "play"), [(1e-5, 3e-5), (3e-5, 3e-5), (1e-4, 3e-5)])
def test_specimens_keep_to_their_clearances_however_far_bearings_open_the_flanks(radius, play, law):
    """By a tenth of the play, by all of it, and where most offsets of the bearings would let teeth overlap."""
    m = _loose(radius, play, law)
    _keep_to_their_clearances(m.core(), m.sources, 600)


def test_ratio_errors_leave_tight_specimens_inside_their_clearances():
    """Ratio errors larger than the play of a mesh: what can be assembled is within its clearances, and what cannot
    needs more of them."""
    m = _loose(1e-5, 2e-5)
    for k, joint in enumerate(m.joints):
        if joint["kind"] == "gear":
            m.source("ratio", 1e-4, joint=k)
    core, drives = m.core(), np.zeros((1, 1))
    poses, drawn = _drawn(core, 300, drives)
    fits = drawn["kept_status"] == OK
    assert 50 < fits.sum() < 250
    np.testing.assert_array_equal(drawn["kept_status"][~fits], NOT_ASSEMBLABLE)
    assert _outside(m.sources, drawn["kept_parameters"][fits]).max() <= 1e-9
    _is_closed(core, drives, poses, drawn)


def _opened(shifts, play):
    """The displacement of the flank of :func:`_driven_pair`, and the gap, by the involutes: wheels in their turns."""
    centres = 0.03
    base = centres * np.cos(PRESSURE)
    rho = np.sqrt(np.abs(centres + shifts) ** 2 - base**2)
    arc = rho - base * np.arctan(rho / base)
    start = np.sqrt(centres**2 - base**2)
    opened = (arc - start + base * np.arctan(start / base)) / np.cos(PRESSURE)
    return -centres * np.angle(centres + shifts), 1.0 + opened / play


def _driven_pair(radius, play, law):
    """Two wheels that are both driven, so that what the bearing of one leaves must fit the flanks."""
    m = pair()
    m.drives.append({"joint": 1, "coefficient": 1.0, "also": []})
    m.source("clearance", {"disc": {"radius": radius}}, law=law, joint=1)
    m.source("clearance", play, law=law, joint=2)
    return m


@pytest.mark.parametrize("law", ["uniform", "normal"])
@pytest.mark.parametrize("radius", [5e-5, 1e-4, 2e-4])
def test_offsets_scatter_by_their_laws_where_bearing_play_opens_the_flanks(radius, law):
    """Against a quadrature of the closed form. All offsets of the bearing are as likely as the flank's offset that fits
    them, times one over the gap: the density of the displacement of the flank."""
    play, samples = 1e-4, 20_000
    core, drives = _driven_pair(radius, play, law).core(), np.zeros((1, 2))
    _, drawn = _drawn(core, samples, drives)
    np.testing.assert_array_equal(drawn["kept_status"], OK)
    found = drawn["kept_parameters"]

    line = (np.arange(1500) + 0.5) / 750 - 1.0
    x, y = np.meshgrid(line, line, indexing="ij")
    inside = x**2 + y**2 < 1.0
    shifts = radius * (x[inside] + 1j * y[inside])
    displacement, gap = _opened(shifts, play)
    offset = displacement / gap
    fits = (gap > 0.0) & (np.abs(offset) < play)
    shifts, offset, gap = shifts[fits], offset[fits], gap[fits]
    weights = 1.0 / gap
    if law == "normal":
        # Three standard deviations are the radius, and half the play.
        weights *= np.exp(-4.5 * (np.abs(shifts / radius) ** 2 + (offset / play) ** 2))
    for values, samples_of in zip((shifts.real, shifts.imag, offset), found.T, strict=True):
        for power in (1, 2):
            expected = np.average(values**power, weights=weights)
            drawn_of = samples_of**power
            # Five standard errors, and what the grid leaves.
            error = 5.0 * drawn_of.std() / np.sqrt(samples) + 1e-3 * np.abs(values).max() ** power
            assert abs(drawn_of.mean() - expected) < error, (power, drawn_of.mean(), expected)


def test_strained_specimens_leave_loose_flanks_inside_their_play():
    """Elastic teeth take up ratio errors; flanks and bearings that carry nothing scatter in the room that is left."""
    m = _loose(1e-5, 1e-5)
    for k, joint in enumerate(m.joints):
        if joint["kind"] == "gear":
            m.source("ratio", 1e-4, joint=k)
            joint["compliance"] = [1e-8]
    core, drives = m.core(), np.zeros((1, 1))
    _, drawn = _drawn(core, 300, drives)
    assert np.isin(drawn["kept_status"], (OK, STRAINED)).all()
    assert (drawn["kept_status"] == STRAINED).sum() > 50
    # A cone program decides the offsets that carry, to about 1e-9.
    assert _outside(m.sources, drawn["kept_parameters"]).max() <= 1e-8
