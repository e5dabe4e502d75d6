"""The same mechanism drawn elsewhere: the axes of the ground and those of every body turned and shifted."""

import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]


class Elsewhere:
    """Of a specification as the core takes it.

    Parameters
    ----------
    spec : mapping
        Nothing on the ground may be displaced; clearances of pins in the plane have round sets.
    rng : Generator
    far : float
        Shifts, in characteristic lengths.
    turns : bool
        Whether the axes are turned as well.
    """

    def __init__(self, spec: Any, rng: np.random.Generator, far: float, turns: bool = True) -> None:
        self.spec = copy.deepcopy(dict(spec))
        self.planar = spec["space"] == "planar"
        self.n = len(spec["guess"])
        #: of the ground, then of the bodies: rotations that turn vectors of the drawing, and shifts
        self.turns = [self._turn(rng) if turns else Rotation.identity() for _ in range(self.n + 1)]
        if self.planar:
            # There the angles of pins count from the axes of the bodies.
            self.turns = [self.turns[0]] * (self.n + 1)
        self.shifts = far * spec["length"] * rng.uniform(-1, 1, (self.n + 1, 3)) * ([1, 1, 0] if self.planar else 1.0)
        self._write()

    def _turn(self, rng: np.random.Generator) -> Rotation:
        return Rotation.from_euler("z", rng.uniform(-3, 3)) if self.planar else Rotation.random(random_state=rng)

    def _vector(self, body: int, v: Any) -> list[float]:
        return [float(x) for x in self.turns[body + 1].apply(v)]

    def _place(self, body: int, at: Any) -> list[float]:
        return [float(x) for x in self.turns[body + 1].apply(at) + self.shifts[body + 1]]

    def _write(self) -> None:
        spec = self.spec
        bodies = [point["body"] for point in spec["points"]]
        for point in spec["points"]:
            point["at"] = self._place(point["body"], point["at"])
        for joint in spec["joints"]:
            for end in ("first", "second"):
                for of in ("axis", "side"):
                    if f"{of}_{end}" in joint:
                        joint[f"{of}_{end}"] = self._vector(bodies[joint[end]], joint[f"{of}_{end}"])
        for load in spec.get("loads", []):
            body = load.get("axes", -1)
            load["force"], load["moment"] = (self._vector(body, load[k]) for k in ("force", "moment"))
        of_displacement = [bodies[displacement["points"][0]] for displacement in spec.get("displacements", [])]
        for body, displacement in zip(of_displacement, spec.get("displacements", []), strict=True):
            displacement["about"] = self._place(body, displacement["about"])
        for source in spec.get("sources", []):
            if "ways" in source:
                body = of_displacement[source["displacement"]]
                source["ways"] = [[self._vector(body, v) for v in way] for way in source["ways"]]
            for moved in source.get("moves", []):
                moved["rate"] = self._vector(bodies[moved["point"]], moved["rate"])
        spec["guess"] = self.there(np.array(spec["guess"], dtype=float)[None])[0].tolist()

    def there(self, poses: Floats) -> Floats:
        """Poses of all bodies as they are drawn there."""
        ground, found = self.turns[0], np.array(poses, dtype=float)
        for body, (turn, shift) in enumerate(zip(self.turns[1:], self.shifts[1:], strict=True)):
            own = found[:, body]
            before = self._rotations(own)
            after = ground * before * turn.inv()
            size = 2 if self.planar else 3
            at = np.zeros((len(own), 3))
            at[:, :size] = own[:, :size]
            at = ground.apply(at) + self.shifts[0] - after.apply(shift)
            own[:, :size] = at[:, :size]
            if self.planar:
                own[:, 2] += ground.as_euler("xyz")[2] - turn.as_euler("xyz")[2]
            else:
                own[:, 3:] = after.as_quat()[:, [3, 0, 1, 2]]
        return found

    def _rotations(self, own: Floats) -> Rotation:
        if self.planar:
            return Rotation.from_rotvec(np.outer(own[:, 2], [0.0, 0.0, 1.0]))
        return Rotation.from_quat(np.where(np.isfinite(own[:, [4, 5, 6, 3]]), own[:, [4, 5, 6, 3]], 1.0))

    def places(self, poses: Floats) -> tuple[Floats, Floats]:
        """Places of all points of bodies in poses of there, as the drawing has them, and rotations of the bodies."""
        inverse = self.turns[0].inv()
        rotations = [inverse * self._rotations(poses[:, body]) * turn for body, turn in enumerate(self.turns[1:])]
        found = []
        for point in self.spec["points"]:
            body, at = point["body"], np.array(point["at"])
            if body >= 0:
                size = 2 if self.planar else 3
                place = self._rotations(poses[:, body]).apply(at)
                place[:, :size] += poses[:, body, :size]
                found.append(inverse.apply(place - self.shifts[0]))
        return np.array(found), np.array([rotation.as_matrix() for rotation in rotations])

    def back(self, errors: Floats) -> Floats:
        """Errors of the output there (last axis: components), or any vectors, in the axes of the drawing."""
        turned = np.array(errors, dtype=float)
        flat = turned.reshape(-1, turned.shape[-1])
        inverse = self.turns[0].inv()
        if self.planar:
            flat[:, :2] = inverse.apply(np.pad(flat[:, :2], ((0, 0), (0, 1))))[:, :2]
        else:
            flat[:, :3], flat[:, 3:] = inverse.apply(flat[:, :3]), inverse.apply(flat[:, 3:])
        return turned
