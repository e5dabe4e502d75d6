"""The questions of the paper, answered by jointplay on the file of the bundled example."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

import jointplay as jp

from . import published
from .determinate import Determinate, determinate
from .fivebar import Loop, loops
from .fixed import Fixed, fixed
from .published import Floats

SAMPLES, SEED = 1000, 0
#: at which step the dyad stands
DYAD = 2
#: the joints that have play in it
DYAD_JOINTS = ("B", "E", "D/ED")
#: a clearance so small that the exact answer is the linear one, mm
SLIGHT = 1e-4
REDUNDANT = ("DF", "DI")
#: the largest clearance that the forces are told for, mm
WIDEST = 0.12
#: errors of the locked angle that are tried on the folding link, degrees
LOCKED = 1.0


@dataclass(frozen=True)
class Study:
    """Everything that the page says."""

    #: of D by the lengths of BD and ED, by B, and by E; x along the panels, y along the cabin
    jacobians: list[Floats]
    #: by force (1 along DF, 2 along DI) and base: the force on the base for a unit force on D
    contact: dict[int, dict[str, Floats]]
    #: how far D goes along a force in the direction of DF when only B has play: by jointplay, and by the diagonal
    #: matrix
    along: tuple[float, float]
    #: where shaft and bearing of a joint of the dyad go under that force when only this joint has play
    centres: dict[str, tuple[Floats, Floats]]
    #: the folding link BD: shortest and longest with its hinge locked straight, and shortest with the hinge off
    links: tuple[float, float, float]
    #: `unit`, `without_play`: the built unit of the over-constrained structure; the same without play
    unit: xr.Dataset
    without_play: xr.Dataset
    #: the determinate structure
    freely: Determinate
    #: a single link that is fixed
    fixed: Fixed
    #: the four ways to assemble a five-bar
    loops: dict[str, Loop]
    #: `scatter`, `worst`: with the published deviations as tolerances
    scatter: xr.Dataset
    worst: xr.Dataset
    #: the clearance that each step needs to go together without strain, mm
    needed: Floats
    #: clearances of all joints, mm, and
    clearances: Floats
    #: the forces of both redundant links in the end with each of them, N
    forces: dict[str, Floats]


def support(locked: bool = True) -> jp.Mechanism:
    """The support structure with the published deviations, unloaded; errors of latched angles are not known to us."""
    settings = {"locked": str(locked).lower(), "angle_a": "0", "angle_f": "0"}
    return jp.loads(jp.examples.text("antenna-support", settings)).with_({"loads": None})


def vertex() -> jp.Mechanism:
    """The same with perfect parts, asked about D."""
    changes = {"output": {"body": "BD", "at": "D"}, "dimensions.*.deviation": 0.0}
    return support().with_(changes)


def jacobians() -> list[Floats]:
    """Of D in the dyad, by name."""
    slopes = jp.assemble(vertex()).sensitivity.sel(step=DYAD, component=["x", "y"])
    names = (["BD.length", "ED.length"], ["B.x", "B.y"], ["E.x", "E.y"])
    return [np.asarray(slopes.sel(parameter=list(parameters)).values) for parameters in names]


def directions() -> dict[int, Floats]:
    """Unit vectors along DF and DI, as the printed forces point: up, and from I to D."""
    return {k: _unit(published.PLACES["D"] - published.PLACES[far]) for k, far in ((1, "F"), (2, "I"))}


def contact(force: Floats) -> dict[str, Floats]:
    """What the bases B and E take of a force on D in the dyad."""
    m = vertex().with_({"loads": [{"force": force.tolist()}], "joints.*.clearance.radial": 0.0})
    found = jp.assemble(m).reaction.sel(step=DYAD, wrench=["fx", "fy"])
    return {joint: -np.asarray(found.sel(joint=joint).values) for joint in ("B", "E")}


def with_play_in(joint: str) -> xr.Dataset:
    """The dyad under a force on D along DF when only one joint has play, and little of it."""
    joints = {f"joints.{name}.clearance.radial": SLIGHT if name == joint else 0.0 for name in vertex().data.joints}
    m = vertex().with_({"loads": [{"force": directions()[1].tolist()}], **joints})
    return jp.assemble(m).sel(step=DYAD, component=["x", "y"])


def along() -> tuple[float, float]:
    """How far D goes along DF when only B has play."""
    force = directions()[1]
    diagonal = published.contact_forces(1)["B"]
    printed = published.CLEARANCE * diagonal * diagonal / np.linalg.norm(diagonal)
    return float(with_play_in("B").error.values @ force) * published.CLEARANCE / SLIGHT, float(printed @ force)


def centres() -> dict[str, tuple[Floats, Floats]]:
    """Where shaft and bearing of a joint go when only that joint has play."""
    scale = published.CLEARANCE / SLIGHT
    found = {}
    for joint in DYAD_JOINTS:
        moved = with_play_in(joint.split("/")[0]).sel(joint=joint)
        found[joint] = (scale * moved.error_shaft.values, scale * moved.error_bearing.values)
    return found


def folding_link(wander: float) -> xr.Dataset:
    """BD as two bars that lock straight in C, from the cabin to a slider on its line."""
    half = published.lengths()["BD"][0] / 2.0
    b = jp.Builder(space="planar", units={"length": "mm", "angle": "deg", "force": "N"})
    b.revolute("B", bodies=["ground", "BC"], at=(0, 0))
    b.revolute("C", bodies=["BC", "CD"], at=(half, 0), clearance=jp.radial(published.CLEARANCE))
    b.revolute("D", bodies=["slider", "CD"], at=(2 * half, 0))
    b.prismatic("guide", bodies=["ground", "slider"], at=(2 * half, 0), axis=(1, 0))
    b.drive("C", joint="C", values=[0], error=wander)
    b.output(body="slider", at="D")
    b.assembly(steps=[["BC", "CD"], ["slider"]])
    return jp.assemble(b.mechanism())


def forces(m: jp.Mechanism) -> dict[str, float]:
    """Forces of the redundant links in the finished structure, N."""
    found = jp.loaded(m).member_force.isel(configuration=0)
    return {name: found.sel(member=name).item() for name in REDUNDANT}


def study() -> Study:
    """Ask everything."""
    m = support()
    unit = jp.assemble(m)
    tolerances = {f"dimensions.{name}.tolerance": abs(d.deviation) for name, d in m.data.dimensions.items()}
    series = m.with_(tolerances | {"dimensions.*.deviation": 0.0})
    clearances = np.linspace(0.0, WIDEST, 7)
    finished = [forces(m.with_({"joints.*.clearance.radial": float(r)})) for r in clearances]
    straight, bent = folding_link(0.0), folding_link(LOCKED)
    return Study(
        jacobians=jacobians(),
        contact={k: contact(force) for k, force in directions().items()},
        along=along(),
        centres=centres(),
        links=(straight.link_shortest.item(), straight.link_longest.item(), bent.link_shortest.item()),
        unit=unit,
        without_play=jp.assemble(m.with_({"joints.*.clearance.radial": 0.0})),
        freely=determinate(support(locked=False)),
        fixed=fixed(),
        loops=loops(),
        scatter=jp.assemble(series, "random", samples=SAMPLES, seed=SEED),
        worst=jp.assemble(series, "worst"),
        needed=np.asarray(published.CLEARANCE * unit.clearance_factor.values),
        clearances=clearances,
        forces={name: np.array([found[name] for found in finished]) for name in REDUNDANT},
    )


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))
