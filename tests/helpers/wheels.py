"""Specimens of wheels between which several couplings mesh, beside plain rejection."""

import numpy as np

from helpers.couplings import GROUND, OK, Machine
from helpers.oracles.flanks import Wheels, drawn

SAMPLES = 10_000
#: specimens that are drawn for as many by rejection, by the number of meshes, and the part of the smallest play by
#: which flanks may miss each other
PROPOSED, NEAR = {2: 400_000, 3: 800_000}, {2: 0.02, 3: 0.15}
AT_ONCE = 200_000


def machine(wheels: Wheels, order: list[int]) -> Machine:
    """The wheels with their joints in an order: both bearings, then the meshes; the first bearing is driven."""
    m = Machine(length=abs(wheels.apart))
    places = [0j, wheels.apart]
    for at in places:
        m.body(at.real, at.imag)
    law = "normal" if wheels.normal else "uniform"
    numbers: dict[int, int] = {}
    for own in order:
        if own < 2:
            at = (places[own].real, places[own].imag)
            numbers[own] = m.joint("revolute", (GROUND, at), (own,))
            continue
        mesh = wheels.meshes[own - 2]
        at = (mesh.eccentric.real, mesh.eccentric.imag)
        told = {"radii": list(mesh.radii), "teeth": list(mesh.teeth)}
        told |= {"crossed": True} if mesh.belt else {"pressure_angle": mesh.pressure}
        numbers[own] = m.joint("belt" if mesh.belt else "gear", (0, at), (1, at), **told)
    m.drive(numbers[0])
    m.output(1)
    for own in range(2 + len(wheels.meshes)):
        if own < 2:
            if wheels.bearings[own]:
                m.source("clearance", {"disc": {"radius": wheels.bearings[own]}}, law=law, joint=numbers[own])
        else:
            mesh = wheels.meshes[own - 2]
            m.source("clearance", (mesh.low, mesh.high), law=law, joint=numbers[own])
    return m


def specimens(wheels: Wheels, order: list[int], samples: int = SAMPLES) -> np.ndarray:
    """As :meth:`helpers.oracles.flanks.Wheels.kept` gives them."""
    m = machine(wheels, order)
    core, drives = m.core(), np.zeros((1, 1))
    found = core.random(drives, core.trace(drives)["poses"], samples, 5, np.array([0.5]), keep=True)
    assert (found["kept_status"] == OK).all()
    flanks = len(wheels.meshes)
    return np.hstack([found["kept_errors"], found["kept_parameters"][:, -flanks:]])


def deviations(ours: np.ndarray, expected: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Differences of means and variances of all columns and of some directions, in standard errors."""
    scale = expected.std(axis=0)
    scale[scale == 0.0] = 1.0  # of a rigid bearing
    ways = np.vstack([np.eye(len(scale)), rng.normal(size=(4, len(scale)))])
    found = []
    for part in (ours / scale @ ways.T, expected / scale @ ways.T):
        values = np.hstack([part, part**2])
        found.append((values.mean(axis=0), values.var(axis=0) / len(values)))
    (a, va), (b, vb) = found
    moving = vb > 1e-30
    return np.asarray((a - b)[moving] / np.sqrt(va + vb)[moving])


def compared(
    seed: int, samples: int = SAMPLES, proposed: dict[int, int] = PROPOSED, near: dict[int, float] = NEAR
) -> tuple[float, int]:
    """The largest deviation in standard errors over two orders of the joints, and how many specimens were kept."""
    wheels, rng = drawn(seed), np.random.default_rng(seed)
    count = len(wheels.meshes)
    blocks = proposed[count] * samples // SAMPLES // AT_ONCE
    least = near[count] / (3.0 if wheels.normal else 1.0)
    expected = np.vstack([wheels.kept(AT_ONCE, least, rng) for _ in range(blocks)])
    orders = [list(range(count + 2)), [1, *range(count + 1, 1, -1), 0]]
    worst = max(np.abs(deviations(specimens(wheels, order, samples), expected, rng)).max() for order in orders)
    return float(worst), len(expected)
