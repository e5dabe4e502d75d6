"""Poses of a parallel robot with its platform put anywhere, singular or not, without its drives.

Targets and an orientation hold the platform; the joints then place the legs. The rows may depend on one another, as
they do in a robot that only translates, so that the start's least-squares assembly is used, not the closure.
"""

import json

import numpy as np
from numpy.typing import NDArray

import jointplay as jp
from jointplay import _core

Array = NDArray[np.float64]

AXES = {"axis_first": [1, 0, 0], "axis_second": [1, 0, 0], "side_first": [0, 1, 0], "side_second": [0, 1, 0]}


def placed(m: jp.Mechanism, positions: Array) -> Array:
    """Poses of all bodies with the output point at positions (metres) and the output body as it is drawn."""
    spec = m.spec() | {"loads": [], "sources": []}
    output, origin, joints = spec["output"]["point"], len(spec["points"]), len(spec["joints"])
    spec["points"].append({"body": -1, "at": [0, 0, 0]})
    ends = {"first": origin, "second": output} | AXES
    spec["joints"] += [{"kind": "target"} | ends, {"kind": "orientation"} | ends]
    spec["drives"] = [{"joint": joints, "component": component} for component in "xyz"]
    core = _core.Mechanism(json.dumps(spec))
    found = [core.assemble(np.ascontiguousarray(p)) for p in positions]
    assert max(each["residual"] for each in found) < 1e-12
    return np.array([each["poses"] for each in found])
