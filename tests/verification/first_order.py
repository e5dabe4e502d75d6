"""What follows from sensitivities: they come from a closure of their own, sets and variances from their definitions."""

from __future__ import annotations

import numpy as np

from oracles import statistics, variances
from oracles.cones import Linearised, cross
from oracles.core_spec import MM, columns, unit
from oracles.sets import Source
from oracles.supports import support

from . import coupled, spatial
from .subject import Array, Check, Found, Subject

DIRECTIONS = 40_000
LAWS = ("uniform", "boundary", "normal")


def is_known(s: Subject) -> bool:
    return s.determinate and (s.is_linkage or coupled.is_coupled(s) or spatial.is_known(s))


def slopes(s: Subject, k: int) -> Array:
    """Displacement of the output per parameter, [3 or 6, parameter], without those of sizes, which are zero."""
    if s.is_linkage:
        return _of_linkage(s, k)
    if s.planar:
        train, path = coupled.at(s, k)
        return np.asarray(train.gradient(train.output, path[k], s.at.drives[k], np.zeros(train.n_parameters)).T)
    return _in_space(s, k)


def _of_linkage(s: Subject, k: int) -> Array:
    link, q, drives = s.linkage(k)
    found = np.zeros((3, sum(len(source["centre"]) for source in s.spec["sources"])))
    own, _ = link.sensitivity(q, drives)
    where = columns(s.spec)
    for label, column in zip(link.labels, own.T, strict=True):
        found[:, where[label]] = column * unit(link, label) / [MM, MM, 1.0]
    return found


def _in_space(s: Subject, k: int) -> Array:
    """From the relative velocities at the joints: all that is locked or driven is given, the twists follow."""
    closure = Linearised(s.spec, s.at.poses[k])
    matrix, n = np.vstack([closure.rows, closure.driven]), len(closure.locked)
    right, direct = [], []
    for source in s.spec["sources"]:
        own = np.zeros((len(source["centre"]), len(matrix)))
        shift = np.zeros((len(source["centre"]), 6))
        if source["kind"] == "clearance":
            rows = [i for i, (joint, _) in enumerate(closure.locked) if joint == source["joint"]]
            own[range(len(rows)), rows] = 1.0
        elif source["kind"] == "drive":
            own[0, n + source["drive"]] = 1.0
        else:
            own[0], shift[0] = _longer(closure, s, source)
        right.append(own)
        direct.append(shift)
    # What the output does not show, as the turn of a rod about its own line, is not decided.
    twists = np.linalg.lstsq(matrix, np.concatenate(right).T, rcond=1e-10)[0]
    return np.asarray(closure.output() @ twists + np.concatenate(direct).T)


def _longer(closure: Linearised, s: Subject, source: dict) -> tuple[Array, Array]:
    """What a longer dimension asks of the joints at its end, and the shift of an output there."""
    (body, start), (_, end) = (closure.place(source[key]) for key in ("from", "to"))
    along = (end - start) / np.linalg.norm(end - start)
    moved = {source["to"], *source.get("together", [])}
    asked = np.zeros(len(closure.rows) + len(closure.driven))
    for row, (j, name) in enumerate([*closure.locked, *closure.drives]):
        joint = s.spec["joints"][j]
        sign = (joint["first"] in moved) - (joint["second"] in moved)
        if sign and name in spatial.TRANSLATIONS:
            asked[row] = sign * spatial.direction(closure, j, name) @ along
    output = np.concatenate([along, np.zeros(3)]) if s.spec["output"]["point"] in moved else np.zeros(6)
    return asked, output
