"""Where a model of MuJoCo comes to rest, its contacts made stiffer in three steps and extrapolated to rigid ones.

MuJoCo solves a contact that accelerates by a without a force as

    A f + R f = -a - k r,    k = 1 / T^2,    R = A (1 - d) / d,

with the penetration r, the time constant T and the impedance d. At rest r = a T^2 (1 - d) / d: the place of rest is a
power series in T^2. Steps of time grow with T, so that softer contacts come to rest in fewer steps.
"""

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: of contacts that are soft enough not to chatter
IMPEDANCE = 0.9
#: T^2 in units of that of the model, the softest first
SQUARES = (8.0, 4.0, 2.0)
#: steps from one look to the next, and the largest number of looks
LOOK, LOOKS = 200, 400


class NoRestError(ArithmeticError):
    """A model that is still moving."""


class Settling:
    """A model on its way to rest.

    Parameters
    ----------
    text : str
        MJCF with damping and a sensor `output`.
    still : float
        What the output may move from one look to the next at rest, in metres.
    """

    def __init__(self, text: str, still: float) -> None:
        self.text, self.still = text, still
        model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(model)
        mujoco.mj_forward(model, self.data)
        self.start = self.output()

    def output(self) -> Array:
        return np.array(self.data.sensor("output").data)

    def rest(self) -> Array:
        """Displacement of the output with rigid contacts, in metres, axes of the ground."""
        found = [self.settle(square) for square in SQUARES]
        # The value at zero of the parabola through the three.
        weights = [np.prod([x / (x - y) for x in SQUARES if x != y]) for y in SQUARES]
        return np.asarray(np.array(weights) @ np.array(found))

    def settle(self, square: float) -> Array:
        """Displacement of the output with one softness, from where the model is."""
        model, before = self._softened(square), np.array(self.data.qpos)
        self.data = mujoco.MjData(model)
        self.data.qpos = before
        mujoco.mj_forward(model, self.data)
        last = self.output()
        for _ in range(LOOKS):
            mujoco.mj_step(model, self.data, LOOK)
            now = self.output()
            if np.abs(now - last).max() < self.still:
                return now - self.start
            last = now
        raise NoRestError(f"still moves by {np.abs(now - last).max()} m")

    def _softened(self, square: float) -> mujoco.MjModel:
        model = mujoco.MjModel.from_xml_string(self.text)
        model.opt.timestep *= np.sqrt(square)
        for ref in (model.geom_solref, model.pair_solref, model.eq_solref, model.tendon_solref_lim):
            ref[:, 0] *= np.sqrt(square)
        for imp in (model.geom_solimp, model.pair_solimp, model.tendon_solimp_lim):
            imp[:, :2] = IMPEDANCE
        return model
