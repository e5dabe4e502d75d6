"""Workspaces against closed forms and brute force: rings and sectors, two rings on one branch, shells in space."""

import itertools
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import label

import jointplay as jp
from helpers.answers import example
from jointplay.analyses.questions import taken
from jointplay.analyses.workspace.holding import OneOrientation
from jointplay.analyses.workspace.inscribed import box, box_of_nodes, disc
from jointplay.analyses.workspace.surface import CrossedEdges, enclosed, facet_sizes, framed, framed_values
from jointplay.cli import run
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism
from jointplay.result import from_dataset
from jointplay.result.conclusions import conclude

TOOL = np.array([250.0, 0.0]) + 80.0 * np.array([np.cos(np.radians(15.0)), -np.sin(np.radians(15.0))])
#: links of the arm; its tool is turned against the forearm
UPPER, FORE, TURNED = 300.0, float(np.hypot(*TOOL)), float(np.degrees(np.arctan2(TOOL[1], TOOL[0])))


def arm(**drives: list[float]) -> jp.Mechanism:
    at = {"q1": {"joint": "shoulder", "values": [45.0]}, "q2": {"joint": "elbow", "values": [-110.0]}}
    return example("serial-2r").with_({"drives": at, "limits.drives": drives})


class Ball:
    """A region with a closed form, and its boundary as `workspace` finds it."""

    def __init__(self, dimensions: int, count: int) -> None:
        self.values = [np.linspace(-1.2, 1.25, count)] * dimensions
        places = np.stack(np.meshgrid(*self.values, indexing="ij"), axis=-1)
        self.inside = np.linalg.norm(places, axis=-1) < 1.0
        self.nodes = places[self.inside]
        along = [framed_values(values) for values in self.values]
        every = np.stack(np.meshgrid(*along, indexing="ij"), axis=-1).reshape(-1, dimensions)
        self.edges = CrossedEdges.of(framed(self.inside))
        first, last = every[self.edges.inner], every[self.edges.outer]
        way = last - first
        a, b, c = (way**2).sum(1), (first * way).sum(1), (first**2).sum(1) - 1.0
        self.points = first + ((-b + np.sqrt(b * b - a * c)) / a)[:, None] * way
        self.facets = self.edges.facets()

    def within(self, places: np.ndarray) -> np.ndarray:
        return np.linalg.norm(places, axis=1) < 1.0


@pytest.mark.parametrize(("dimensions", "size", "surface"), [(2, np.pi, 2 * np.pi), (3, 4 / 3 * np.pi, 4 * np.pi)])
def test_size_of_a_ball_converges_with_the_square_of_the_spacing(dimensions: int, size: float, surface: float) -> None:
    errors = []
    for count in (13, 25, 49):
        ball = Ball(dimensions, count)
        found, half = (enclosed(ball.points, facets) for facets in (ball.facets, ball.edges.halved().facets()))
        errors.append(size - found)
        # The stated uncertainty is no smaller than the error, and has its order.
        assert 0.0 < size - found < abs(found - half) < 8.0 * (size - found)
        assert facet_sizes(ball.points, ball.facets).sum() == pytest.approx(surface, rel=1.5 * (size - found) / size)
    # Halved spacing: a quarter of the error; the cells that the sphere cuts differ from grid to grid.
    assert all(3.0 < a / b < 5.5 for a, b in itertools.pairwise(errors))


@pytest.mark.parametrize("seed", range(3))
def test_boundary_of_any_region_is_closed(seed: int) -> None:
    inside = np.random.default_rng(seed).random((6, 5, 7)) < 0.5
    edges = CrossedEdges.of(framed(inside))
    for one in (edges, edges.halved()):
        facets = one.facets()
        sides = np.concatenate([facets[:, [0, 1]], facets[:, [1, 2]], facets[:, [2, 0]]])
        # Every side is passed as often in one direction as in the other.
        forwards, backwards = (sorted(map(tuple, pairs.tolist())) for pairs in (sides, sides[:, ::-1]))
        assert forwards == backwards
        assert (facets >= 0).all()


@pytest.mark.parametrize("dimensions", [2, 3])
def test_largest_ball_and_box_in_a_ball(dimensions: int) -> None:
    ball = Ball(dimensions, 31 if dimensions == 2 else 15)
    spacing = float(np.diff(ball.values[0])[0])
    error = 0.5 * spacing**2  # of chords
    centre, radius = disc(ball.points, ball.facets, ball.nodes, spacing, None)
    assert np.abs(centre).max() < spacing
    assert 1.0 - error < radius <= 1.0
    low, high = box(ball.points, ball.facets, ball.within, None)
    best = (2.0 / np.sqrt(dimensions)) ** dimensions
    assert best * (1.0 - 2 * dimensions * error) < np.prod(high - low) <= best * (1.0 + 1e-9)
    assert (np.linalg.norm(np.where(np.abs(low) > np.abs(high), low, high)) <= 1.0 + 1e-9).all()
    middle = np.full(dimensions, 0.2)
    assert disc(ball.points, ball.facets, ball.nodes, spacing, middle)[1] == pytest.approx(
        1.0 - np.linalg.norm(middle), abs=error
    )
    low, high = box(ball.points, ball.facets, ball.within, middle)
    np.testing.assert_allclose(0.5 * (low + high), middle, atol=1e-12)
    # The farthest corner is on the ball, and by symmetry the best box is a cube.
    half = 1.0 / np.sqrt(dimensions) - 0.2
    assert np.prod(high - low) == pytest.approx((2 * half) ** dimensions, rel=8 * error)


def gantry(*axes: tuple[float, ...], **ranges: list[float]) -> jp.Mechanism:
    """Slides one on the other, each of which goes 50 mm to both sides or as far as is said."""
    names = "xyz"[: len(axes)]
    joints, under = {}, "ground"
    for name, axis in zip(names, axes, strict=True):
        on = {under: {"at": [0.0] * len(axes), "axis": list(axis)}, f"slide_{name}": [0.0] * len(axes)}
        joints[name] = {"type": "prismatic", "on": on}
        under = f"slide_{name}"
    file = {
        "format": 1,
        "space": "spatial" if len(axes) == 3 else "planar",
        "units": {"length": "mm", "angle": "deg"},
        "joints": joints,
        "output": {"body": under},
        "limits": {"drives": {f"p{name}": [-50, 50] for name in names} | ranges},
        "drives": {f"p{name}": {"joint": name, "values": [1.0 + k]} for k, name in enumerate(names)},
    }
    return Mechanism(file)


def within(result: Any, name: str, value: float) -> bool:
    """Whether a number is as near to its value as it says."""
    return abs(result[name].item() - value) <= result[f"{name}_error"].item()


@pytest.mark.parametrize(("count", "centre"), [(12, None), (31, [0.0, 0.0])])
def test_a_square_has_its_corners(count: int, centre: list[float] | None) -> None:
    """A box of 9,416 mm2 was said to be known to 0.07 where 10,000 is right: every boundary cut the corners off."""
    result = jp.workspace(gantry((1.0, 0.0), (0.0, 1.0)), count=count, centre=centre)
    for name, value in (("size", 1e4), ("box_size", 1e4), ("disc_radius", 50.0)):
        assert within(result, name, value), name
        assert result[f"{name}_error"] <= 0.005 * value, name
    # As far as the tolerance of the boundary allows.
    assert result["size"] > 1e4 - 400.0 * result.attrs["tolerance"]
    assert result["box_size"] > 1e4 - 800.0 * result.attrs["tolerance"]


@pytest.mark.parametrize(
    ("width", "height", "count"), [(100.0, 40.0, 101), (2.394, 11.46, 95), (10.70, 188.9, 16), (332.8, 1.092, 60)]
)
def test_a_rectangle_is_its_largest_box(width: float, height: float, count: int) -> None:
    """Boxes stood up to 10 % short of it against the two ends of a piece of the boundary that leaned by 0.001."""
    m = gantry((1.0, 0.0), (0.0, 1.0), px=[-0.3 * width, 0.7 * width], py=[2.0 - 0.4 * height, 2.0 + 0.6 * height])
    result = jp.workspace(m, count=count)
    for name, value in (
        ("size", width * height),
        ("box_size", width * height),
        ("disc_radius", 0.5 * min(width, height)),
    ):
        assert within(result, name, value), name
        assert result[f"{name}_error"] <= (0.03 if name != "disc_radius" else 0.2) * value, name


def test_a_parallelogram_has_its_corners() -> None:
    # Of 60 and of 120 degrees, on both sides of which the boundary is straight.
    result = jp.workspace(gantry((1.0, 0.0), (0.5, np.sqrt(0.75))), count=25)
    assert within(result, "size", 1e4 * np.sqrt(0.75))
    assert result["size_error"] < 1e-3 * result["size"]
    corners = [[sign * 50.0 + other * 25.0, other * 50.0 * np.sqrt(0.75)] for sign in (-1, 1) for other in (-1, 1)]
    far = np.linalg.norm(result.vertex.values[:, None] - np.array(corners), axis=2).min(axis=0)
    assert far.max() < 3.0 * result.attrs["tolerance"]


def test_what_edges_of_a_cube_that_are_cut_off_leave_is_said() -> None:
    result = jp.workspace(gantry(*np.eye(3).tolist()), count=7, centre=[0.0, 0.0, 0.0])
    assert within(result, "size", 1e6)
    assert within(result, "box_size", 1e6)
    assert within(result, "disc_radius", 50.0)


def test_it_says_how_many_specimens_it_took_by_default() -> None:
    m = example("serial-2r").with_({"limits.probability": 0.9})
    found = jp.workspace(m, count=5, question="random", samples=64)
    assert (found.attrs["samples"], found.attrs["seed"]) == (64, 0)
    assert taken("random", {})["samples"] == jp.random(m).attrs["samples"]
    assert "samples" not in jp.workspace(m, count=5, question="worst").attrs


def test_two_links_reach_a_ring() -> None:
    result = jp.workspace(arm(), count=41)
    inner, outer = abs(UPPER - FORE), UPPER + FORE
    area, error = result["size"].item(), result.size_error.item()
    assert abs(area - np.pi * (outer**2 - inner**2)) < error < 0.01 * area
    radii = np.linalg.norm(result.vertex.values, axis=1)
    off = np.minimum(np.abs(radii - outer), np.abs(radii - inner))
    assert off.max() <= result.attrs["tolerance"]
    # Stretched, the output is at a singularity, and a way may end on it.
    shares = dict(zip(result.bound.values.tolist(), result.share.values.tolist(), strict=True))
    assert shares["not_assembled"] > 0.9
    assert shares.keys() <= {"not_assembled", "singular"}
    assert result.disc_radius.item() == pytest.approx((outer - inner) / 2, abs=3.0)
    assert np.linalg.norm(result.disc_centre) == pytest.approx((outer + inner) / 2, abs=3.0)


def test_ranges_of_two_links_cut_a_sector_out() -> None:
    q1, q2 = [0.0, 90.0], [-120.0, -40.0]
    result = jp.workspace(arm(q1=q1, q2=q2), count=41)
    bends = np.radians(np.array(q2) + TURNED)
    squares = UPPER**2 + FORE**2 + 2 * UPPER * FORE * np.cos(bends)
    area = 0.5 * np.pi / 2 * (squares.max() - squares.min())
    assert abs(result["size"].item() - area) < result.size_error.item() + 1e-3 * area
    near, far = np.sqrt([squares.min(), squares.max()]) * np.pi / 2
    sides = FORE * float(np.ptp(bends))
    lengths = {"drives.q2.low": near, "drives.q2.high": far, "drives.q1.low": sides, "drives.q1.high": sides}
    shares = dict(zip(result.bound.values.tolist(), result.share.values.tolist(), strict=True))
    assert shares.keys() == lengths.keys()
    for name, length in lengths.items():
        # A bound ends within a cell of the corner.
        assert shares[name] == pytest.approx(length / sum(lengths.values()), abs=0.01)
    # Every point of the boundary is at the end that it names: there the drive has that value.
    at = result.vertex.values
    for name, value in (("q2.low", q2[0]), ("q2.high", q2[1])):
        own = at[result.vertex_bound.values == f"drives.{name}"]
        exact = np.sqrt(UPPER**2 + FORE**2 + 2 * UPPER * FORE * np.cos(np.radians(value + TURNED)))
        assert np.abs(np.linalg.norm(own, axis=1) - exact).max() <= result.attrs["tolerance"]


def five_bar_region(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Where the rods reach the tool with elbows outside, on the side of the singular poses where the start is."""
    place = np.stack([x, y], axis=-1)
    rods = []
    for pivot, side in ((-45.0, 1.0), (45.0, -1.0)):
        way = place - [pivot, 0.0]
        far = np.linalg.norm(way, axis=-1)
        with np.errstate(invalid="ignore", divide="ignore"):
            inner = np.arccos((110.0**2 + far**2 - 150.0**2) / (2 * 110.0 * far))
        turned = np.arctan2(way[..., 1], way[..., 0]) + side * inner
        elbow = np.stack([pivot + 110.0 * np.cos(turned), 110.0 * np.sin(turned)], axis=-1)
        rods.append(place - elbow)
    left, right = rods
    with np.errstate(invalid="ignore"):
        inside = left[..., 0] * right[..., 1] - left[..., 1] * right[..., 0] > 0.0
    numbers = label(inside)[0]
    k = np.unravel_index(np.argmin(np.hypot(x, y - 190.0)), x.shape)
    return np.asarray(numbers == numbers[k])


def test_five_bar_reaches_what_two_rings_share_on_one_branch() -> None:
    result = jp.workspace(example("five-bar"), count=61)
    step = 0.5
    x, y = np.meshgrid(np.arange(-300, 300, step), np.arange(-300, 300, step), indexing="ij")
    inside = five_bar_region(x, y)
    area = step**2 * np.count_nonzero(inside)
    assert abs(result["size"].item() - area) < 2.0 * result.size_error.item() + 1e-3 * area
    assert set(result.bound.values.tolist()) == {"not_assembled", "singular"}
    # By brute force over the places of the lattice: no disc in the true region is larger.
    edge = np.stack([x, y], axis=-1)[inside & ~five_bar_eroded(inside)]
    at = result.disc_centre.values
    radius = float(np.linalg.norm(edge - at, axis=1).min())
    assert result.disc_radius.item() == pytest.approx(radius, abs=2 * step)
    some = np.stack([x, y], axis=-1)[::20, ::20][inside[::20, ::20]]
    best = max(float(np.linalg.norm(edge - place, axis=1).min()) for place in some)
    assert result.disc_radius.item() > best - 2 * step
    low, high = result.box_low.values, result.box_high.values
    within = (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1])
    assert np.count_nonzero(within & ~inside) <= 1e-3 * np.count_nonzero(within)
    assert result.box_size.item() > 0.99 * largest_rectangle(inside[::10, ::10], 10 * step)


def five_bar_eroded(inside: np.ndarray) -> np.ndarray:
    """The places whose four neighbours are inside as well."""
    found = inside.copy()
    for axis in (0, 1):
        for shift in (-1, 1):
            found &= np.roll(inside, shift, axis=axis)
    return found


def largest_rectangle(inside: np.ndarray, step: float) -> float:
    """The largest rectangle of nodes that are all inside, by trying them all."""
    sums = np.zeros(np.add(inside.shape, 1), dtype=int)
    sums[1:, 1:] = inside.cumsum(0).cumsum(1)
    best = 0
    for i in range(len(inside)):
        for j in range(i + 1, len(inside) + 1):
            band = sums[j] - sums[i]
            full = band[None, :] - band[:, None] == (j - i) * (
                np.arange(len(band))[None] - np.arange(len(band))[:, None]
            )
            runs = np.where(full, np.arange(len(band))[None] - np.arange(len(band))[:, None], 0)
            best = max(best, (j - i - 1) * (int(runs.max()) - 1))
    return best * step**2


def two_links(upper: float, fore: float, values: list[float], q1: list[float], q2: list[float]) -> jp.Mechanism:
    """An arm of two bars with ranges of its angles."""
    joints = {
        "A": {"type": "revolute", "on": {"ground": [0, 0], "upper": [0, 0]}},
        "B": {"type": "revolute", "on": {"upper": [upper, 0], "fore": [0, 0]}},
    }
    drives = {
        name: {"joint": joint, "values": [at]} for name, joint, at in zip(("q1", "q2"), "AB", values, strict=True)
    }
    file = {
        "format": 1,
        "units": {"length": "mm", "angle": "deg"},
        "joints": joints,
        "drives": drives,
        "output": {"body": "fore", "at": [fore, 0]},
        "limits": {"drives": {"q1": q1, "q2": q2}},
    }
    return jp.Mechanism(file)


@pytest.mark.parametrize("width", [8.0, 4.0])
def test_a_narrow_band_is_found_whole(width: float) -> None:
    """For the coarse grid it was in pieces, and a third was given for the whole, nearly without error."""
    q2 = [-110.0 - width / 2, -110.0 + width / 2]
    result = jp.workspace(arm(q1=[0.0, 90.0], q2=q2), count=61)
    bends = np.radians(np.array(q2) + TURNED)
    area = UPPER * FORE * np.pi / 2 * abs(np.diff(np.cos(bends)).item())
    assert within(result, "size", area)
    assert result.size_error < 0.01 * area
    assert "edge" not in result.bound.values


def test_the_largest_box_of_nodes_is_that_by_trying_them_all() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        inside = rng.random((9, 12)) < 0.8
        low, high = box_of_nodes(inside, [np.arange(9.0), np.arange(12.0)])
        assert np.prod(high - low) == largest_rectangle(inside, 1.0)
        (a, b), (c, d) = low.astype(int), high.astype(int)
        assert inside[a : c + 1, b : d + 1].all()


def test_of_two_places_in_a_crescent_the_larger_box_is_found() -> None:
    """The better box lies across the ends of a ring, far from one that is nearly as good: 565 was given for 768."""
    m = two_links(82.55, 77.217, [190.9, 123.5], q1=[50.16, 331.68], q2=[116.0, 130.93])
    result = jp.workspace(m)
    reach = np.sqrt([82.55**2 + 77.217**2 + 2 * 82.55 * 77.217 * np.cos(np.radians(q)) for q in (130.93, 116.0)])
    # Boxes that stand on the inner circle and touch the outer one.
    half = np.linspace(1.0, reach[1], 4000)
    sides = 2.0 * half * np.clip(np.sqrt(np.maximum(reach[1] ** 2 - half**2, 0.0)) - reach[0], 0.0, None)
    assert result.box_size > 0.99 * sides.max()


def test_no_box_of_a_lattice_is_larger_than_that_in_a_narrow_sector() -> None:
    """Two links whose corners of the region stand against the box."""
    upper, fore = 67.01978131023162, 126.82591337901204
    q1, q2 = [-38.160261126742455, 74.91467622183214], [42.15969911639534, 82.08167928495985]
    m = two_links(upper, fore, [29.66074283745618, 57.31885454295078], q1, q2)
    result = jp.workspace(m, count=41)
    step = 1.0
    x, y = np.meshgrid(np.arange(-80, 80, step), np.arange(120, 190, step), indexing="ij")
    bend = np.arccos(np.clip((x**2 + y**2 - upper**2 - fore**2) / (2 * upper * fore), -1.0, 1.0))
    turn = np.arctan2(y, x) - np.arctan2(fore * np.sin(bend), upper + fore * np.cos(bend))
    within = [(np.radians(low) <= q) & (q <= np.radians(high)) for q, (low, high) in ((turn, q1), (bend, q2))]
    assert result.box_size.item() > 0.99 * largest_rectangle(within[0] & within[1], step)


LEGS = {f"l{k}": [380.0, 460.0] for k in (1, 2, 3)}
FEET = 150.0 * np.array([[np.cos(t), np.sin(t), 0.0] for t in np.radians([0.0, 120.0, 240.0])])


def test_strokes_of_a_3_upu_share_three_shells(tmp_path: Path) -> None:
    m = example("3-upu").with_({"limits.drives": LEGS})
    grid = {"x": np.linspace(-150, 150, 17), "y": np.linspace(-150, 150, 17), "z": np.linspace(325, 465, 11)}
    result = jp.workspace(m, grid)
    axes = [np.linspace(low, high, 150) for low, high in ((-155, 155), (-155, 155), (325, 465))]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    legs = np.linalg.norm(places[:, None] - FEET, axis=2)
    room = np.minimum(legs - 380.0, 460.0 - legs).min(axis=1)
    volume = np.prod([along[1] - along[0] for along in axes]) * np.count_nonzero(room > 0.0)
    assert abs(result["size"].item() - volume) < result.size_error.item()
    assert result.size_error.item() < 0.15 * volume
    # Every point of the boundary is on the sphere of the leg that it names.
    for k in (1, 2, 3):
        for side, length in (("low", 380.0), ("high", 460.0)):
            own = result.vertex.values[result.vertex_bound.values == f"drives.l{k}.{side}"]
            assert np.abs(np.linalg.norm(own - FEET[k - 1], axis=1) - length).max() <= result.attrs["tolerance"]
    assert result.share.values == pytest.approx(1 / 6, abs=0.05)
    # The room of a place is the radius of the largest ball about it.
    assert result.disc_radius.item() == pytest.approx(room.max(), abs=result.disc_radius_error.item() + 1.0)
    corners = np.array(np.meshgrid(*zip(result.box_low.values, result.box_high.values, strict=True))).reshape(3, -1).T
    legs = np.linalg.norm(corners[:, None] - FEET, axis=2)
    assert legs.max() < 460.0 + 1e-6
    # Chords of the inner spheres are up to a sagitta behind them.
    assert legs.min() > 380.0 - 19.0**2 * 3 / (8 * 380.0)
    jp.export(result, tmp_path / "room.stl")
    content = (tmp_path / "room.stl").read_bytes()
    (count,) = struct.unpack("<I", content[80:84])
    assert len(content) == 84 + 50 * count
    floats = np.frombuffer(content[84:], dtype=[("f", "<f4", 12), ("no", "<u2")])["f"].reshape(count, 4, 3)
    turned = np.linalg.det(floats[:, 1:].astype(float)).sum() / 6.0
    assert turned == pytest.approx(result["size"].item(), rel=1e-4)


def test_every_orientation_is_needed() -> None:
    m = example("3-rrr")
    axes = {"x": {"from": -90, "to": 90, "count": 13}, "y": {"from": -90, "to": 90, "count": 13}}
    alone = [jp.workspace(m, {**axes, "angle": angle}).inside.values for angle in (-10.0, 10.0)]
    both = jp.workspace(m, {**axes, "angle": [-10.0, 10.0]})
    assert both.attrs["orientations"] == 2
    np.testing.assert_array_equal(both.inside.values, alone[0] & alone[1])
    assert 0 < both.inside.values.sum() < min(one.sum() for one in alone)
    # Left out, it is that of the start.
    assert jp.workspace(m, axes).attrs["orientation"] == "angle = -0.548158"


def test_limits_hold_inside_and_are_missed_outside() -> None:
    m = example("five-bar").with_({"limits.position": 0.5})
    grid = {"x": np.linspace(-200, 200, 15), "y": np.linspace(20, 240, 11)}
    result = jp.workspace(m, grid, question="worst")
    kinds = result.bound.values.tolist()
    assert "limits.position" in kinds
    free = jp.workspace(m, grid)
    assert (result.inside.values <= free.inside.values).all()
    asked = jp.map(m, "worst", grid)
    largest = asked.worst_position.values
    assert largest[result.inside.values].max() <= 0.5
    missed = result.outside_by.values == "limits.position"
    assert missed.any()
    assert largest[missed].min() > 0.5
    own = result.vertex.values[result.vertex_bound.values == "limits.position"][:4]
    at = jp.worst(m.with_({"path.x": own[:, 0].tolist(), "path.y": own[:, 1].tolist()}))
    assert at.worst_position.values == pytest.approx(0.5, rel=0.01)
    assert (at.worst_position.values <= 0.5 + 1e-9).all()


def test_how_many_specimens_show_a_region_is_no_property_of_it() -> None:
    """Few specimens show a smaller part of where the yield is reached; the answer does not call that the workspace."""
    m = arm(q1=[0, 60], q2=[-120, -20])
    at = jp.random(m, samples=4096).error_quantile.sel(quantity="position", probability=0.9).values
    limits = {"position": 1.03 * float(at.max()), "probability": 0.9, "contact": "scattered"}
    m = m.with_({f"limits.{name}": value for name, value in limits.items()})
    few, many = (jp.workspace(m, question="random", count=15, samples=samples) for samples in (256, 4096))
    assert many["size"].item() > 1.1 * few["size"].item()
    for result in (few, many):
        said = conclude(from_dataset(result)).sentences
        assert said[0].text.startswith("The workspace, as far as it is shown, has an area of")
        assert said[1].text.endswith("More specimens show more of it.")
    whole = conclude(from_dataset(jp.workspace(m, count=9))).sentences
    assert whole[0].text.startswith("The workspace has an area of")


def test_what_hangs_together_only_through_what_is_outside_does_not_count() -> None:
    """A joint range that leaves two arms of the ring: the start is in one of them."""
    m = arm(q1=[-80.0, 80.0], q2=[-170.0, -100.0])
    grid = {"x": np.linspace(-640, 640, 41), "y": np.linspace(-640, 640, 41)}
    whole = jp.workspace(m, grid)
    assert whole.attrs["apart"] == 0
    start = whole.inside.values
    assert start.any()
    numbers = label(whole.outside_by.values == "", np.ones((3, 3)))[1]
    assert numbers == 1


def test_about_a_centre_and_as_a_drawing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    monkeypatch.chdir(tmp_path)
    Path("arm.toml").write_text(jp.examples.text("serial-2r"))
    line = ["workspace", "arm.toml", "--count", "31", "-s", "limits.drives.q2=[-120,-20]"]
    assert run([*line, "--centre", "300,100", "-o", "ring.dxf", "--plot", "ring.svg"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "about (x, y) = (300, 100) mm" in said
    assert said.endswith("wrote ring.dxf")
    assert Path("ring.svg").stat().st_size > 0
    drawn = ezdxf.readfile("ring.dxf")
    (circle,) = drawn.modelspace().query("CIRCLE")
    assert tuple(circle.dxf.center)[:2] == (300.0, 100.0)
    assert {e.dxf.layer for e in drawn.modelspace().query("LWPOLYLINE")} == {
        *(f"drives.{name}.{side}" for name in ("q1", "q2") for side in ("low", "high"))
    }
    assert run([*line, "--centre", "-500,-500"]) == 0
    assert "The centre (x, y) = (-500, -500) mm is not in it." in " ".join(capsys.readouterr().out.split())
    assert run([*line, "-o", "ring.stp"]) == 2
    assert ".dxf, .stl" in capsys.readouterr().err
    # It is refused before the work.
    monkeypatch.setattr("jointplay.analyses.workspace.compute", lambda *_, **__: pytest.fail("was asked"))
    assert run([*line, "-o", "ring.stl"]) == 2
    assert "ring.stl: --output: a region in a plane has no surface" in capsys.readouterr().err
    assert not Path("ring.stl").exists()


def test_nothing_is_a_workspace_too() -> None:
    result = jp.workspace(arm(q1=[0, 90], q2=[-120, -40]), {"x": [-900, -800], "y": [-900, -800]})
    assert result.status.item() == "empty"
    assert result["size"].item() == 0.0
    assert np.isnan(result.disc_radius)


def test_edge_of_a_grid_is_a_bound_of_its_own() -> None:
    result = jp.workspace(arm(), {"x": [300, 350, 400], "y": [-50, 0, 50]})
    assert result.bound.values.tolist() == ["edge"]
    assert result["size"].item() == pytest.approx(1e4, rel=1e-9)
    assert result.box_size.item() == pytest.approx(1e4, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "changes", "options", "message"),
    [
        ("four-bar", {}, {}, "one drive moves the output along a line"),
        ("3-upu", {}, {}, "nothing says how far drive 'l1' goes"),
        ("serial-2r", {}, {"grid": {"x": [0, 1], "y": 0}}, "an area needs two axes of positions"),
        ("serial-2r", {}, {"grid": {"q1": [0, 1]}}, "is a drive; a workspace is one of the output: x, y, angle"),
        ("serial-2r", {}, {"grid": {"v": [0, 1]}}, "'v' is not a component of the output"),
        ("serial-2r", {}, {"grid": {"x": [0, 0], "y": [0, 1]}}, "rise or fall"),
        ("serial-2r", {}, {"grid": {"x": [0, 1], "y": [0, 1]}, "count": 9}, "where no grid does"),
        ("serial-2r", {}, {"count": 2}, "is not a number of nodes"),
        ("serial-6r", {}, {"count": 2000}, r"count: 2e\+09 nodes in all orientations"),
        ("serial-2r", {}, {"centre": [1.0]}, "is not a number for each of x, y"),
        ("serial-2r", {}, {"tolerance": -1.0}, "is not above zero"),
        ("serial-2r", {}, {"question": "given"}, "'given' is not a question"),
        ("serial-2r", {}, {"samples": 3}, "goes with a question"),
        ("five-bar", {}, {"question": "worst", "count": 5}, "no limit that worst can be judged by"),
    ],
)
def test_what_cannot_be_asked_is_said(name: str, changes: dict, options: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        jp.workspace(example(name).with_(changes), **options)


def test_a_way_beyond_the_reach_says_how_far_it_leads() -> None:
    """Every try beyond the end of the reach walked there anew, and only halved the way."""
    one = OneOrientation(arm().with_(grid={"x": [100.0, 200.0], "y": [100.0, 200.0]}), ())
    assert one.nodes().inside.all()
    outside = np.ascontiguousarray(np.tile([0.9, 0.3], (4, 1)))
    held, _ = one.on_the_way(one.rows, one.poses, outside)
    assert (held.why == "not_assembled").all()
    assert held.ends is not None
    places = one.rows + held.ends[:, None] * (outside - one.rows)
    # Steps end where the singular value is as large as its limit, 1e-4, near the stretched arm: by its square.
    assert np.allclose(np.linalg.norm(places, axis=1), (UPPER + FORE) / 1e3, rtol=1e-5)
