"""Derivatives of the output's pose, against differences of exact poses and closed forms."""

import json
import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jointplay as jp
from helpers import platforms
from helpers.builders import planar, spatial
from helpers.crossed import loose
from helpers.graphs import graph
from helpers.places import deviating
from jointplay import _core, examples
from jointplay.analyses.nominal import nominal

#: what is zero where a clearance is held
GAPS = ("radius", "gap", "axial", "low", "high")
#: steps of lengths as parts of the characteristic length, and of angles
STEP = 1e-5


class Held:
    """A mechanism whose clearances are held: what its loads make of it, with everything changed by a little."""

    def __init__(self, m: jp.Mechanism, configuration: int) -> None:
        at = nominal(m)
        self.m, self.spec = m, m.at_rest_under(configuration).core_spec
        self.drives, self.poses = at.drives[[configuration]], at.poses[[configuration]]
        # Sizes of clearances move nothing that is held.
        sources = [s for s in self.spec["sources"] if s["kind"] != "size"]
        self.sources = [self._held(s) for s in sources]
        kept = [k for k, s in enumerate(self.spec["sources"]) if s["kind"] != "size"]
        self.parameters = np.flatnonzero(np.isin(m.parameter_source, kept))

    @staticmethod
    def _held(source: dict[str, Any]) -> dict[str, Any]:
        ((shape, sizes),) = source["set"].items()
        none = {name: 0.0 if name in GAPS else size for name, size in sizes.items()}
        return {**source, "set": {shape: none}, "centre": [0.0] * len(source["centre"]), "law": "uniform"}

    def error(self, parameter: int | None = None, change: float = 0.0, drive: int | None = None, **more: Any) -> Any:
        """Displacement from nominal with one parameter or drive changed, or with other loads."""
        sources, passed = [dict(s) for s in self.sources], 0
        for source in sources:
            size = len(source["centre"])
            if parameter is not None and passed <= parameter < passed + size:
                source["centre"] = [change * (k == parameter - passed) for k in range(size)]
            passed += size
        drives = self.drives.copy()
        if drive is not None:
            drives[0, drive] += change
        core = _core.Mechanism(json.dumps({**self.spec, "sources": sources, "correlations": [], **more}))
        found = core.loaded(drives, self.poses)
        assert _core.STATUSES[found["status"][0]] in ("ok", "strained", "undetermined")
        return found["error"][0]

    def loaded(self, load: int, component: int, change: float) -> Any:
        """The same with one component of a load changed."""
        loads = [dict(one) for one in self.spec["loads"]]
        along = [0, 1, 2] if self.m.pose_size == 7 else [0, 1]
        kind, place = ("force", component) if component < len(along) else ("moment", component - len(along))
        place = 2 if kind == "moment" and len(along) == 2 else place
        loads[load][kind] = [v + change * (k == place) for k, v in enumerate(loads[load][kind])]
        return self.error(loads=loads)

    def slope(self, ask: Any, step: float) -> Any:
        """Central differences of displacements, extrapolated from two steps: some mechanisms are near a singularity."""
        return (4.0 * self._difference(ask, step / 2) - self._difference(ask, step)) / 3.0

    @staticmethod
    def _difference(ask: Any, step: float) -> Any:
        """Turns compose."""
        high, low = ask(step), ask(-step)
        if len(high) == 3:
            return (high - low) / (2 * step)
        turn = Rotation.from_rotvec(high[3:]) * Rotation.from_rotvec(low[3:]).inv()
        return np.concatenate([high[:3] - low[:3], turn.as_rotvec()]) / (2 * step)


def assert_slopes(m: jp.Mechanism, configuration: int, parameters: Any = None, tolerance: float = 2e-6) -> None:
    """All matrices of the core against differences; `parameters` are those that are looked at."""
    held = Held(m, configuration)
    found = m.at_rest_under(configuration).core.jacobians(held.drives, held.poses)
    assert _core.STATUSES[found["status"][0]] == "ok"
    units = np.array([1.0 if name in "xyz" else 1.0 / m.length for name in m.components])

    def compare(told: Any, ask: Any, step: float) -> None:
        expected = held.slope(ask, step)
        scale = max(float(np.abs(expected * 1.0 / units).max()), 1.0 if step < 1.0 else 0.0)
        np.testing.assert_allclose(told / units, expected / units, rtol=0, atol=tolerance * scale + 1e-15)

    spread = np.flatnonzero(held.parameters >= 0) if parameters is None else parameters
    for k in spread:
        parameter = int(held.parameters[k])
        angle = m.parameters[parameter].rpartition(".")[2] in ("angle", "roll", "tilt_side", "tilt_normal")
        step = STEP * (1.0 if angle else m.length)
        if m.parameters[parameter] == "temperature":
            step = 1.0
        compare(found["parameter"][0, :, parameter], lambda h, k=k: held.error(int(k), h), step)
    for d in range(len(m.drives)):
        compare(found["drive"][0, :, d], lambda h, d=d: held.error(drive=d, change=h), STEP)
    if not m.core.isostatic:
        np.testing.assert_allclose(found["error"][0], held.error(), atol=1e-9 * m.length)
    loads = held.spec["loads"]
    for k, load in enumerate(loads):
        force = max(np.abs(load["force"]).max(), np.abs(load["moment"]).max() / m.length, 1.0)
        for c in range(len(m.components)):
            step = 1e-3 * force * (1.0 if c < len(m.components) // 2 + len(m.components) % 2 else m.length)
            told = found["load"][0, :, k, c]
            expected = held.slope(lambda h, k=k, c=c: held.loaded(k, c, h), step)
            scale = np.abs(found["load"][0, :, k] / units[:, None]).max() or 1.0
            np.testing.assert_allclose(told / units, expected / units, atol=1e-4 * scale)


def one(name: str) -> jp.Mechanism:
    """An example with one output in one load case."""
    m = jp.loads(examples.text(name))
    return m.only(m.outputs[0] if m.outputs else None, m.load_cases[-1] if m.load_cases else None)


#: of every kind one that takes little time
QUICK = (
    "four-bar",
    "slider-crank-cases",
    "excavator",
    "geared-five-bar",
    "rack-slider",
    "belt-arm",
    "rssr",
    "3-rrr-spherical",
)
OTHERS = [name for name in examples.names() if name not in QUICK and one(name).core.isostatic]


@pytest.mark.parametrize("name", [*QUICK, *OTHERS])
def test_of_determinate_examples(name: str) -> None:
    """Places of joints deviate as well; some of all parameters."""
    m = one(name)
    m = m if "patterns" in m.raw else deviating(m)
    count = len(Held(m, 0).parameters)
    assert_slopes(m, 0, np.random.default_rng(3).permutation(count)[:5])
    found = m.core.jacobians(nominal(m).drives, nominal(m).poses)
    assert (found["compliance"] == 0.0).all()
    assert found["defined"].all()


@pytest.mark.parametrize("name", ["redundant-bar", "x-braced-square", "antenna-support", "four-legged-platform"])
def test_of_elastic_examples(name: str) -> None:
    """With clearances held, the loads of the file and known deviations that are taken to be zero."""
    m = one(name)
    assert_slopes(m, 0, np.random.default_rng(4).permutation(len(m.parameters))[:8], tolerance=2e-5)


@pytest.mark.parametrize("seed", range(12))
def test_of_random_mechanisms(seed: int) -> None:
    assert_slopes(jp.loads(graph(seed)), 0)


@pytest.mark.parametrize("seed", range(10))
def test_of_random_elastic_platforms(seed: int) -> None:
    text, stiffness = platforms.platform(seed, elastic=True, sliders=0)
    assert_slopes(platforms.mechanism(text, stiffness), 0, tolerance=2e-5)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("elastic", [False, True])
def test_of_crossed_gears(seed: int, elastic: bool) -> None:
    """Worms, spiral bevel and crossed helical gears on loose bearings, with a drive that winds up."""
    m = jp.loads(loose(seed)).with_({"drives.q.backlash": 0.3, "drives.q.error": 0.02})
    if elastic:
        # The deformation of a tooth was taken for a part of its play, which opens with the distance of the centres.
        m = m.with_({"drives.q.stiffness": 2e5, "joints.m.stiffness": {"flank": 2e5}})
    assert_slopes(m, 1, np.random.default_rng(seed).permutation(len(Held(m, 1).parameters))[:5], tolerance=2e-5)


@pytest.mark.parametrize("sprung", [False, True])
def test_of_a_soft_arm_in_space(sprung: bool) -> None:
    """Two joints that wind up by degrees, so that what the loads do as the arm turns counts."""
    b = spatial()
    b.revolute(
        "waist", bodies=["ground", "post"], at=(0, 0, 0), axis=(0, 0, 1), clearance=jp.radial(0.1, axial=0.1, length=60)
    )
    b.revolute(
        "elbow",
        bodies=["post", "arm"],
        at=(30, 0, 100),
        axis=(0, 1, 0.2),
        clearance=jp.radial(0.1, axial=0.1, length=60),
        stiffness={"radial": 800, "axial": 900, "tilt": 50000},
    )
    b.drive("q1", joint="waist", values=[10], error=0.1, stiffness=900)
    b.drive("q2", joint="elbow", values=[25], backlash=0.2, stiffness=700)
    b.dimension("d", body="post", between=["waist", "elbow"], tolerance=0.1)
    b.output(body="arm", at=(230, 10, 120))
    b.load(force=(5, 9, -30), moment=(100, -300, 50))
    b.load(body="arm", at=(150, 0, 100), force=(3, 2, -10), axes="body")
    if sprung:
        b.spring("s", ground=(50, 20, 400), arm=(180, 20, 100), stiffness=0.4, free_length=100)
    assert_slopes(b.mechanism(), 0, tolerance=2e-5)


def test_a_load_that_pulls_stiffens() -> None:
    """An arm of length L along x, pulled by F: k/(1 rad) + F L against turning."""
    b = planar()
    b.revolute("pivot", ground=(0, 0), arm=(0, 0))
    b.drive("q", joint="pivot", values=[0], stiffness=2000)
    b.output(body="arm", at=(300, 0))
    b.load(force=(200, 0))
    found = jp.sensitivity(b.mechanism())
    stiffness = 2000 * 180 / math.pi + 200 * 300
    assert found.compliance.sel(component="y", wrench="fy").item() == pytest.approx(300**2 / stiffness, rel=1e-9)
    turned = found.compliance.sel(component="angle", wrench="moment").item()
    assert turned == pytest.approx(math.degrees(1 / stiffness), rel=1e-9)
    # The pull turns back a part of what is commanded.
    share = 1 - 200 * 300 / stiffness
    assert found.drive_jacobian.sel(component="angle").item() == pytest.approx(share, rel=1e-9)
    assert found.load_jacobian.sel(component="y", wrench="fy").item() == pytest.approx(300**2 / stiffness, rel=1e-9)
    assert found.acting_load.values.tolist() == ["loads.0"]


def test_numbers_are_those_of_given_in_units_of_the_file() -> None:
    m = jp.loads(examples.text("four-bar"))
    slopes = jp.sensitivity(m)
    for parameter, step in (("J1.x", 1e-4), ("l2.length", 1e-4), ("theta1.value", 1e-4)):
        high, low = (jp.given(m, {parameter: h}).error for h in (step, -step))
        told = slopes.parameter_jacobian.sel(parameter=parameter)
        np.testing.assert_allclose(told, (high - low) / (2 * step), rtol=1e-5, atol=1e-8)
    assert slopes.drive_jacobian.attrs["units"] == "mm, mm, deg per deg"
    np.testing.assert_allclose(slopes.drive_jacobian[..., 0], slopes.parameter_jacobian.sel(parameter="theta1.value"))


@pytest.mark.parametrize("name", ["bennett", "sarrus"])
def test_of_rigid_redundant_mechanisms(name: str) -> None:
    """Compatible offsets, such as those that the load chooses, have the error that the matrix gives them."""
    errors, misses = [], []
    for play in (0.05, 0.005):
        m = jp.loads(examples.text(name)).with_(
            {"joints.*.clearance.radial": play, "joints.*.clearance.axial": 2 * play}
        )
        loaded, slopes = jp.loaded(m).isel(configuration=0), jp.sensitivity(m).isel(configuration=0)
        assert slopes.defined.all()
        told = (slopes.parameter_jacobian * loaded.offset).sum("parameter")
        errors.append(float(np.abs(loaded.error).max()))
        misses.append(float(np.abs(told - loaded.error).max()))
    # What is left is of second order.
    assert misses[0] < 0.02 * errors[0]
    assert misses[1] < 0.02 * misses[0]


def test_what_nothing_gives_way_to_has_no_derivative() -> None:
    """A rigid square with a second diagonal: its lengths cannot change one by one, its place can."""
    m = jp.loads(examples.text("redundant-bar")).with_({"joints.*.clearance": None, "bodies": None})
    found = jp.sensitivity(m)
    assert not found.defined.all()
    told = np.isnan(found.parameter_jacobian).any("component")
    np.testing.assert_array_equal(told, ~found.defined)


def test_outputs_and_load_cases_stand_side_by_side() -> None:
    m = jp.loads(examples.text("slider-crank-cases"))
    found = jp.sensitivity(m)
    assert found.drive_jacobian.dims == ("output", "load_case", "configuration", "component", "drive")
    alone = jp.sensitivity(m.only("pin", "press"))
    np.testing.assert_array_equal(found.drive_jacobian.sel(output="pin", load_case="press"), alone.drive_jacobian)


def test_singular_and_unreachable_poses_have_a_status() -> None:
    m = jp.loads(examples.text("four-bar")).with_({"drives.theta1": {"joint": "J1", "values": [30, 179.9]}})
    found = jp.sensitivity(m)
    status = found.status.values.tolist()
    assert status[0] == "ok"
    for k, name in enumerate(status):
        assert np.isfinite(found.drive_jacobian[k]).all() == (name == "ok")
