"""Paper 3: closed form and general engine agree, and the page and the tables of the maps say what they compute.

The paper's own numbers are not known. The closed form of the page is held to another one, which was derived and
written apart from it.
"""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from helpers.oracles.upu import Upu as Oracle

PAPERS = Path(__file__).resolve().parents[2] / "examples" / "papers"
sys.path.insert(0, str(PAPERS))

from paper3 import figures, maps, page  # noqa: E402
from paper3 import study as asked  # noqa: E402
from paper3.closed_form import Legs, Upu  # noqa: E402
from paper3.robot import at, robot  # noqa: E402


@pytest.fixture(scope="module")
def study() -> asked.Study:
    return asked.study()


@pytest.fixture(scope="module")
def tables() -> maps.Maps:
    return maps.compute()


def test_the_closed_form_is_the_one_derived_apart_from_it() -> None:
    rng = np.random.default_rng(7)
    for _ in range(40):
        p = np.append(rng.uniform(-120, 120, 2), rng.uniform(250, 550))
        force, moment = rng.uniform(-100, 100, 3), rng.uniform(-3000, 3000, 3)
        expected = Oracle().error(p / 1000, force, moment / 1000)
        expected[:3] *= 1000
        np.testing.assert_allclose(Upu().error(p, force, moment), expected, rtol=1e-9)


def test_work_of_the_closed_form_is_load_times_error_and_no_other_error_does_more() -> None:
    rng = np.random.default_rng(8)
    loads = rng.normal(size=(30, 6)) * [1, 1, 1, 100, 100, 100]
    errors = Upu().error(asked.ASIDE, loads[:, :3], loads[:, 3:])
    work = Upu().work(asked.ASIDE, loads[:, :3], loads[:, 3:])
    every = loads @ errors.T
    np.testing.assert_allclose(np.diag(every), work, rtol=1e-12)
    assert np.all(every <= work[:, None] * (1 + 1e-12))


def test_the_general_engine_gives_the_closed_form(study: asked.Study) -> None:
    assert study.gap_of_closed_form < 1e-10
    for pose in study.poses:
        np.testing.assert_allclose(pose.first_order, pose.closed_form, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(study.poses[1].first_order[:3], [3.2768048, -2.7506930, -0.6179690], rtol=1e-7)


def test_reactions_come_to_those_of_the_closed_form_as_play_shrinks() -> None:
    keys = {key: 1e-4 * getattr(Upu(), name) for name, several in asked.CLEARANCES.items() for key in several}
    result = jp.loaded(at(robot(), asked.ASIDE, asked.FORCE, asked.MOMENT).with_(keys))
    along, couple = asked.transmitted(result, asked.ASIDE)
    np.testing.assert_allclose(along, [112.536812, -52.461432, 40.814341], rtol=1e-4)
    np.testing.assert_allclose(couple, [-24884.958, -10459.029, 36162.894], rtol=1e-4)


def test_first_order_is_approached_linearly(study: asked.Study) -> None:
    ratios = study.shrinking[:-1, 1:] / study.shrinking[1:, 1:]
    np.testing.assert_allclose(ratios, 2.0, atol=0.05)


def test_weight_alone_decides_the_height_only(study: asked.Study) -> None:
    over_the_middle = study.poses[0]
    assert over_the_middle.status == "undetermined"
    drop = 4 * Upu().radial * over_the_middle.lengths[0] / over_the_middle.position[2]
    assert over_the_middle.first_order[2] == pytest.approx(-drop, rel=1e-9)
    np.testing.assert_allclose(over_the_middle.exact[[0, 1, 3, 4, 5]], 0.0, atol=1e-8)
    assert over_the_middle.undetermined[2] < 1e-9


def test_what_weight_alone_leaves_open_is_the_roll_of_the_guides(study: asked.Study) -> None:
    legs = Legs(Upu(), np.array(asked.HOME))
    rolls = Upu().gap * 2 * legs.sin / Upu().guide_width
    expected = np.degrees(np.abs(np.linalg.inv(legs.n)) @ rolls)
    # The engine tells the half-width at the loaded pose, 0.04 mm lower.
    np.testing.assert_allclose(study.poses[0].undetermined[3:], expected, rtol=3e-4)


def test_the_worst_case_lies_between_what_was_found_and_its_bound(study: asked.Study) -> None:
    for found in study.worst:
        for k in (0, 1):
            assert found.first_order[k] == pytest.approx(found.closed_form[k], rel=1e-9)
            assert found.first_order[k] <= found.bound[k] <= 1.0011 * found.first_order[k]
            assert sum(found.parts[k].values()) == pytest.approx(found.first_order[k], rel=1e-9)


def test_compensation_takes_the_displacement_and_leaves_the_rotation(study: asked.Study) -> None:
    fix = study.compensation
    np.testing.assert_allclose(fix.residual[:3], 0.0, atol=1e-6)
    assert np.linalg.norm(fix.residual[3:]) == pytest.approx(np.linalg.norm(fix.before[3:]), rel=0.02)


def test_axial_play_of_the_pins_on_the_legs_is_given_way_to(study: asked.Study) -> None:
    exact, first_order = study.silent
    assert first_order < 1e-10
    assert exact < 1e-5


def test_what_a_clearance_adds_goes_when_it_goes(study: asked.Study) -> None:
    for k, name in ((0, "radial"), (1, "axial"), (2, "gap")):
        assert list(asked.CLEARANCES)[k] == name
        first = study.swept[name][2]
        assert np.all(np.diff(first) > 0)
    np.testing.assert_allclose(study.swept["axial"][3], study.swept["axial"][3][0], rtol=1e-9)
    for series in study.swept["guide_length"]:
        np.testing.assert_allclose(series, series[0], rtol=1e-9)


def test_scatter_agrees_with_its_first_order_and_stays_within_the_worst_case(study: asked.Study) -> None:
    found = study.scatter
    assert found.failures == 0
    np.testing.assert_allclose(found.std, found.std_first_order, rtol=0.01)
    assert max(np.divide(found.largest, study.worst[1].exact)) < 1


def test_the_map_says_what_the_closed_form_says_at_every_node(tables: maps.Maps) -> None:
    for level in tables.levels:
        position, rotation = maps.closed_form(level)
        np.testing.assert_allclose(level.position_first_order, position, rtol=0, atol=0.6 * 10**-maps.DIGITS)
        np.testing.assert_allclose(level.rotation_first_order, rotation, rtol=0, atol=0.6 * 10**-maps.DIGITS)


def test_the_map_says_what_the_engine_says_at_some_nodes(tables: maps.Maps) -> None:
    rng = np.random.default_rng(1)
    for level in tables.levels:
        sound = np.argwhere(level.status == "ok")
        nodes = [tuple(node) for node in rng.permutation(sound)[:12]]
        position, rotation = maps.at_nodes(level, nodes)
        where = tuple(np.transpose(nodes))
        np.testing.assert_allclose(level.position[where], position, rtol=0, atol=0.6 * 10**-maps.DIGITS)
        np.testing.assert_allclose(level.rotation[where], rotation, rtol=0, atol=0.6 * 10**-maps.DIGITS)


def test_no_node_under_the_load_is_beyond_the_worst_case_there(tables: maps.Maps) -> None:
    level, largest = tables.level(maps.WORST_HEIGHT), tables.largest
    i, j = (np.searchsorted(nodes, places) for nodes, places in ((level.x, largest.x), (level.y, largest.y)))
    assert np.all(level.position[np.ix_(i, j)] <= largest.position + 1e-5)
    assert np.all(level.rotation[np.ix_(i, j)] <= largest.rotation + 1e-5)
    middle = len(largest.x) // 2
    assert largest.position[middle, middle] == pytest.approx(4.06090, abs=1e-5)


def test_the_page_has_every_number_and_a_place_for_every_figure(study: asked.Study, tables: maps.Maps) -> None:
    text = page.render(study, tables)
    assert not re.search(r"\$[a-z]|\bnan\b", text)
    assert set(re.findall(r"\(img/([^)]+)\)", text)) == {f"paper-3-{name}.svg" for name in figures.FIGURES}
