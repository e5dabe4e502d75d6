"""Maps: every node is found and says what the ordinary questions say there."""

import math
from typing import ClassVar

import numpy as np
import pytest
import xarray as xr

import jointplay as jp
from helpers.answers import example
from jointplay.analyses.map.contact import Contacts

SQUARE = {"from": -160, "to": 160, "count": 41}


def reach_of_3_rrr(x: np.ndarray, y: np.ndarray, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Whether every leg (two links of 150) reaches the platform, and its crank's angle with the file's elbow."""
    bases = np.array([[-260.0, -150.0], [260.0, -150.0], [0.0, 300.0]])
    pins = np.array([[-69.282, -40.0], [69.282, -40.0], [0.0, 80.0]])
    c, s = math.cos(angle), math.sin(angle)
    turned = pins @ np.array([[c, s], [-s, c]])
    legs = np.stack([x, y], axis=-1)[..., None, :] + turned - bases
    length = np.linalg.norm(legs, axis=-1)
    with np.errstate(invalid="ignore"):
        crank = np.arctan2(legs[..., 1], legs[..., 0]) + np.arccos(length / 300.0)
    return (length <= 300.0).all(axis=-1), crank


class TestNodes:
    def arm(self, upper: float, forearm: float) -> jp.Mechanism:
        """Two links in series, the output at the end of the second."""
        output = {"body": "forearm", "at": [forearm, 0]}
        return example("serial-2r", **{"joints.elbow.on.upper": [upper, 0], "output": output})

    def test_all_that_three_legs_reach_is_found_with_the_drives_of_the_closed_form(self) -> None:
        result = jp.map(example("3-rrr"), grid={"x": SQUARE, "y": SQUARE, "angle": 5.0})
        x, y = np.meshgrid(result.x, result.y, indexing="ij")
        within, crank = reach_of_3_rrr(x, y, math.radians(5.0))
        assert 0.1 < within.mean() < 0.9
        np.testing.assert_array_equal(result.status != "not_assembled", within)
        for k, drive in enumerate("abc"):
            apart = np.radians(result[drive].values) - crank[..., k]
            np.testing.assert_allclose(np.exp(1j * apart[within]), 1.0, rtol=0, atol=1e-9)
        for name, along in (("x", x), ("y", y), ("angle", np.full(x.shape, 5.0))):
            nominal = result.nominal.sel(component=name).values[within]
            np.testing.assert_allclose(nominal, along[within], rtol=0, atol=1e-9)
        assert float(result.angle) == pytest.approx(5.0, rel=1e-15)

    def test_an_axis_ends_where_it_is_said_to(self) -> None:
        # 6.9 times three over three is another number: the node could not be selected by its label.
        along = {"from": -6.9, "to": 6.9, "count": 4}
        result = jp.map(example("3-rrr"), "solve", {"x": along, "y": 0.0, "angle": 0.0})
        np.testing.assert_array_equal(result.x[[0, -1]], [-6.9, 6.9])
        np.testing.assert_array_equal(result.x, -result.x[::-1].values)
        assert str(result.status.sel(x=6.9).values) == "ok"

    @pytest.mark.parametrize("chunk", [7, 60, 10**6])
    def test_a_ring_around_what_cannot_be_reached_is_found_from_both_sides(self, chunk: int) -> None:
        # The arm cannot fold onto its base: its tool moves in a ring.
        m = self.arm(200.0, 120.0)
        far, near = 200.0 + 120.0, 200.0 - 120.0
        along = {"from": -350, "to": 350, "count": 36}
        result = jp.map(m, "solve", {"x": along, "y": along}, chunk=chunk)
        distance = np.hypot(*np.meshgrid(result.x, result.y, indexing="ij"))
        np.testing.assert_array_equal(result.status != "not_assembled", (distance <= far) & (distance >= near))

    def test_a_dead_centre_on_the_grid_is_singular_and_the_end(self) -> None:
        # Both links in line at x = 300, which the grid meets exactly.
        result = jp.map(self.arm(150.0, 150.0), "solve", {"x": [200, 250, 300, 350], "y": 0.0})
        assert result.status.values.tolist() == ["ok", "ok", "singular", "not_assembled"]

    def test_chunks_do_not_change_what_is_found(self) -> None:
        m, grid = example("3-rrr"), {"x": SQUARE, "y": SQUARE, "angle": -20.0}
        whole = jp.map(m, grid=grid)
        for chunk in (11, 200):
            parts = jp.map(m, grid=grid, chunk=chunk)
            np.testing.assert_array_equal(parts.status, whole.status)
            np.testing.assert_array_equal(parts.contact_change, whole.contact_change)
            # The nodes are reached on other ways, so that the last digits may differ; they grow near a singularity.
            np.testing.assert_allclose(parts.nominal, whole.nominal, rtol=0, atol=1e-9)
            ok = whole.status == "ok"
            np.testing.assert_allclose(parts.error.where(ok), whole.error.where(ok), rtol=1e-6, atol=1e-9)


class TestQuestions:
    """A map says at its nodes what the question says for the same drives, which it reaches on another way."""

    OPTIONS: ClassVar[dict[str, dict[str, object]]] = {
        "loaded": {},
        "worst": {},
        "random": {"samples": 500, "seed": 3},
        "given": {"offsets": {"A": [0.01, -0.005], "C.x": 0.01}},
        "solve": {},
    }

    @pytest.mark.parametrize("question", OPTIONS)
    def test_on_a_grid_of_drives(self, question: str) -> None:
        m, options = example("five-bar"), self.OPTIONS[question]
        left, right = np.array([120.0, 130.0, 145.0]), np.array([35.0, 50.0])
        result = jp.map(m, question, {"left": left, "right": right}, **options)
        mesh = [v.ravel() for v in np.meshgrid(left, right, indexing="ij")]
        drives = {"drives.left.values": mesh[0], "drives.right.values": mesh[1], "path": None}
        self.compare(result, getattr(jp, question)(m.with_(drives), **options))

    @pytest.mark.parametrize("question", OPTIONS)
    def test_on_a_grid_of_positions(self, question: str) -> None:
        m, options = example("five-bar"), self.OPTIONS[question]
        result = jp.map(m, question, {"x": [-40.0, 0.0, 35.0], "y": [150.0, 180.0]}, **options)
        mesh = [v.ravel() for v in np.meshgrid(result.x, result.y, indexing="ij")]
        along = getattr(jp, question)(m.with_({"path": {"x": mesh[0], "y": mesh[1]}}), **options)
        self.compare(result, along)
        for drive in ("left", "right"):
            np.testing.assert_allclose(result[drive].values.ravel(), along[drive], rtol=0, atol=1e-9)

    @pytest.mark.parametrize("exact", [True, False])
    def test_without_details_it_says_the_same_of_the_errors(self, exact: bool) -> None:
        m, grid = (
            example("3-rrr"),
            {"x": np.linspace(-100.0, 100.0, 9), "y": np.linspace(-80.0, 100.0, 8), "angle": 0.0},
        )
        whole = jp.map(m, grid=grid, exact=exact, chunk=30)
        light = jp.map(m, grid=grid, exact=exact, chunk=30, details=False)
        assert set(light.data_vars) == {
            *("contact_change", "equilibria", "error", "iterations", "nominal", "singular_crossing", "status"),
            "undetermined",
            *("limit", "limit_met", "margin"),
        }
        assert not {"parameter", "source", "joint"} & set(light.dims)
        for name in light.variables:
            xr.testing.assert_identical(light[name].variable, whole[name].variable)
        assert light.contact_change.any()

    def compare(self, result: xr.Dataset, along: xr.Dataset) -> None:
        dims = result.attrs["grid"].split(", ")
        flat = result.stack(configuration=dims).transpose("configuration", ...)
        # A singular motion has no sign; its size is in singular_value.
        names = set(along.data_vars) - {"target", "mismatch", "singular_motion"}
        # The nodes of a grid are no path that one specimen goes along.
        names -= {name for name in names if name.startswith(("yield_", "repeatability"))}
        assert names <= set(flat.data_vars)
        for name in names:
            ours, theirs = flat[name].transpose(*along[name].dims).values, along[name].values
            if theirs.dtype.kind == "f":
                np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-9, err_msg=name)
            else:
                np.testing.assert_array_equal(ours, theirs, err_msg=name)

    def test_an_axis_holds_the_other_drives(self) -> None:
        m = example("five-bar")
        line = jp.map(m, "solve", {"left": [130.0, 140.0], "right": 40.0})
        area = jp.map(m, "solve", {"left": [130.0, 140.0], "right": [40.0, 50.0]})
        assert line.nominal.dims == ("left", "component")
        np.testing.assert_allclose(line.nominal, area.nominal.sel(right=40.0), rtol=0, atol=1e-9)
        assert float(line.right) == pytest.approx(40.0, rel=1e-15)

    def test_the_machine_cannot_stand_at_nodes_outside_its_ranges(self) -> None:
        m = example("five-bar", **{"limits.drives": {"left": [125, 140]}, "limits.joints": {"B": [-120, 0]}})
        result = jp.map(m, "solve", {"x": {"from": -60, "to": 60, "count": 9}, "y": [150.0, 190.0]})
        drive = (result.left >= 125) & (result.left <= 140)
        joint = (result.coordinate.sel(joint="B") >= -120) & (result.coordinate.sel(joint="B") <= 0)
        inside = drive & joint
        assert 0 < int(inside.sum()) < inside.size
        np.testing.assert_array_equal(result.status, np.where(inside, "ok", "outside_limits"))
        np.testing.assert_array_equal(result.leaves_range, np.where(drive, np.where(joint, "", "B"), "left"))
        # The pose is that of the map without ranges.
        free = jp.map(example("five-bar"), "solve", {"x": {"from": -60, "to": 60, "count": 9}, "y": [150.0, 190.0]})
        np.testing.assert_array_equal(result.pose, free.pose)


class TestContact:
    def slider_crank(self) -> jp.Mechanism:
        """Pushed along the guide through its wrist pin: the guide's force changes sign where the rod is in line."""
        changes = {"gravity": [0, 0], "output.at": [0, 0], "loads": [{"force": [-400, 0], "at": [0, 0]}]}
        return example("slider-crank", **changes)

    def test_the_guide_changes_sides_where_its_force_changes_sign(self) -> None:
        m = self.slider_crank()
        result = jp.map(m, grid={"theta": {"from": 1, "to": 359, "count": 180}})
        force = result.reaction.sel(joint="guide", wrench="fy").values
        flips = np.flatnonzero(np.sign(force[:-1]) != np.sign(force[1:]))
        # In line at 180 degrees, between the nodes at 179 and 181.
        assert result.theta.values[flips].tolist() == [179.0]
        np.testing.assert_array_equal(np.flatnonzero(result.contact_change.sel(across="theta")), flips)
        jump = np.diff(result.offset.sel(parameter="guide.normal"))
        assert abs(jump[flips[0]]) == pytest.approx(2 * 0.03, rel=1e-9)

    def test_between_chunks_it_is_marked_as_well(self) -> None:
        m, grid = self.slider_crank(), {"theta": {"from": 1, "to": 359, "count": 180}}
        whole = jp.map(m, grid=grid)
        # 90 nodes end at 179 degrees, where the change is.
        parts = jp.map(m, grid=grid, chunk=90)
        np.testing.assert_array_equal(parts.contact_change, whole.contact_change)
        assert bool(parts.contact_change.any())

    def test_a_node_where_the_load_decides_nothing_is_a_state_of_its_own(self) -> None:
        result = jp.map(self.slider_crank(), grid={"theta": {"from": 170, "to": 190, "count": 5}})
        assert result.status.values.tolist() == ["ok", "ok", "undetermined", "ok", "ok"]
        assert np.flatnonzero(result.contact_change.values[:, 0]).tolist() == [1, 2]

    def test_a_pin_changes_where_its_direction_turns_by_a_right_angle(self) -> None:
        m = example("four-bar")
        contacts = Contacts(m)

        def changes(before: np.ndarray, after: np.ndarray) -> bool:
            return bool(contacts.change(contacts.states(before), contacts.states(after)))

        first = np.zeros(len(m.parameters))
        first[:8] = np.tile([1.0, 0.0], 4)
        for degrees, expected in ((80.0, False), (100.0, True), (180.0, True)):
            turned = first.copy()
            turned[2:4] = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
            assert changes(first, turned) is expected
        nowhere = first.copy()
        nowhere[2:4] = 0.0
        assert changes(first, nowhere)
        assert not changes(nowhere, nowhere)
        assert not changes(first, np.full_like(first, np.nan))


class TestRefusals:
    @pytest.mark.parametrize(
        ("grid", "said"),
        [
            ({"x": [1, 2], "y": 3}, r"grid: x, y: 3 drives can bring the output to 3 asked components; .* angle = 0"),
            ({"x": [1, 2], "y": 3, "angle": 0, "a": 73}, r"one of drives \(a\) or one of the output \(x, y, angle\)"),
            ({"u": [1, 2]}, "'u' is not a drive or a component of the output; .*known: a, b, c, x, y, angle"),
            ({"a": [70, 80]}, "the grid does not say where drive 'b' is"),
            ({"x": 1, "y": 3, "angle": 0}, "a map has one to 3 axes"),
            ({"x": [1, 3, 2], "y": 3, "angle": 0}, "grid.x: the values of an axis rise or fall"),
            ({"x": {"from": 1, "to": 2}, "y": 3, "angle": 0}, "grid.x: give from, to and count"),
            ({"x": "far", "y": 3, "angle": 0}, r'grid.x: a table such as { from = .* is needed, not "far"'),
        ],
    )
    def test_a_grid_that_does_not_fit(self, grid: dict[str, object], said: str) -> None:
        with pytest.raises(jp.InputError, match=said):
            jp.map(example("3-rrr"), grid=grid)

    def test_questions_and_options(self) -> None:
        m, grid = example("five-bar"), {"x": [0.0, 10.0], "y": 180.0}
        with pytest.raises(jp.InputError, match=r"say what is mapped: a \[grid\]"):
            jp.map(m)
        with pytest.raises(jp.InputError, match=r"'wors' is not a question .* did you mean 'worst'"):
            jp.map(m, "wors", grid)
        with pytest.raises(jp.InputError, match="nothing loads the mechanism"):
            jp.map(m.with_({"loads": []}), grid=grid)
        with pytest.raises(jp.InputError, match="'Q' is not a source or a parameter"):
            jp.map(m, "given", grid, offsets={"Q": 1.0})
        with pytest.raises(jp.InputError, match="0 is not a number of nodes"):
            jp.map(m, grid=grid, chunk=0)
        with pytest.raises(jp.InputError, match="GB are too much to hold in memory"):
            jp.map(m, grid={"x": np.linspace(-50, 50, 9_000), "y": np.linspace(150, 190, 9_000)})

    def test_a_mechanism_that_is_not_together(self) -> None:
        m = example("five-bar", **{"joints.C.on.left_rod": [20, 0], "joints.C.on.right_rod": [20, 0]})
        with pytest.raises(jp.InputError, match="cannot be assembled at its start"):
            jp.map(m, grid={"x": [0.0, 10.0], "y": 180.0})

    def test_a_file_with_nothing_but_a_grid(self) -> None:
        drives = {"a": {"joint": "A1"}, "b": {"joint": "B1"}, "c": {"joint": "C1"}}
        m = example("3-rrr", drives=drives, grid={"x": [0, 10], "y": 0, "angle": 0})
        assert jp.map(m, "solve").status.values.tolist() == ["ok", "ok"]
        with pytest.raises(jp.InputError, match=r"drives: the file has a \[grid\] for `map`"):
            jp.loaded(m)
