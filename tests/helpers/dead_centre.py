"""A slider-crank at its dead centre, where the error of the drive moves the slider by its square only."""

import numpy as np

import jointplay as jp
from jointplay.basics.arrays import Floats

CRANK, ROD = 50.0, 100.0


def at_dead_centre(guides: int, angle: float, more: str = "") -> jp.Mechanism:
    """The slider, in so many guides, at 0 or 180 degrees of the crank, whose drive has an error of 5 degrees."""
    text = f"""
        format = 1
        units = {{ length = "mm", angle = "deg" }}
        drives.q = {{ joint = "A", values = [{angle}], error = 5 }}
        output = {{ body = "slider", at = [0, 0] }}
        start = {{ slider = {{ x = {ROD + CRANK * np.cos(np.deg2rad(angle))} }} }}
        joints.A = {{ type = "revolute", on = {{ ground = [0, 0], crank = [0, 0] }} }}
        joints.B = {{ type = "revolute", on = {{ crank = [{CRANK}, 0], rod = [0, 0] }} }}
        joints.C = {{ type = "revolute", on = {{ rod = [{ROD}, 0], slider = [0, 0] }} }}
        {more}
    """
    for k in range(guides):
        sides = ", ".join(f"{body} = {{ at = [0, {30 * k}], axis = [1, 0] }}" for body in ("ground", "slider"))
        text += f'joints.G{k} = {{ type = "prismatic", on = {{ {sides} }} }}\n'
    return jp.loads(text)


def moved_from_dead_centre(angle: float, error: float | Floats) -> Floats:
    """How far the slider is from where it should be, by an error of the drive in degrees."""
    q, at = np.deg2rad(angle + np.asarray(error)), np.deg2rad(angle)
    return np.asarray(CRANK * (np.cos(q) - np.cos(at)) + np.sqrt(ROD**2 - (CRANK * np.sin(q)) ** 2) - ROD)
