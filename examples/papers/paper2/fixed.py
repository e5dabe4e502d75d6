"""A single link that is fixed: equations (1) to (5), and where its end really goes.

    delta_B = delta_A + Gamma                                           the pin's two centres               (1)
    delta_C = delta_B + dl (cos phi, sin phi)                           the far end                    (3), (4)
    delta_C = delta_B + dl (cos, sin)(phi + theta) + turned end         with an error theta of the angle    (5)

Turning a link by theta moves its end along the chord, which is across the middle direction:

    turned end = 2 l sin(theta / 2) (-sin, cos)(phi + theta / 2)
"""

from dataclasses import dataclass

import numpy as np

import jointplay as jp

from . import published
from .published import CLEARANCE, Floats

#: the inner panel's length and deviation, on a cabin that is off as Table 1 says; the angle is chosen to show (5)
(LENGTH, DEVIATION), BASE = published.lengths()["AF"], np.array([0.0, published.lengths()["AB"][1]])
PHI = 60.0
GAMMA = CLEARANCE * np.array([0.6, 0.8])
THETAS = (1.0, -1.0)


@dataclass(frozen=True)
class Fixed:
    """Position errors, mm, by the error of the angle in degrees."""

    #: of the link's own centre at its base: by (1), by jointplay
    near: tuple[Floats, Floats]
    #: of its far end with the right angle: by (4), by jointplay
    straight: tuple[Floats, Floats]
    #: `printed`, `across`, `exact`: of its far end: by (5) as printed, with the end turned across the link, by
    #: jointplay
    printed: dict[float, Floats]
    across: dict[float, Floats]
    exact: dict[float, Floats]

    def longer(self, errors: dict[float, Floats], theta: float) -> float:
        """How much longer than it is a link would be whose end is off by so much."""
        vector = LENGTH * direction(0.0) + errors[theta] - self.near[0]
        return float(np.linalg.norm(vector)) - LENGTH - DEVIATION


def direction(theta: float) -> Floats:
    """Of the link when its angle is off by so many degrees."""
    return np.array([np.cos(np.radians(PHI + theta)), np.sin(np.radians(PHI + theta))])


def link(theta: float) -> jp.Mechanism:
    """The link on the cabin, asked about its far end."""
    cabin = np.array([0.0, published.lengths()["AB"][0]])
    b = jp.Builder(space="planar", units={"length": "mm", "angle": "deg", "force": "N"})
    b.fixed("foot", bodies=["ground", "cabin"], at=(0, 0))
    play = jp.radial(CLEARANCE)
    b.fixed("B", bodies=["cabin", "link"], at=cabin, clearance=play, angle={"deviation": theta})
    b.dimension("cabin", body="cabin", between=["foot", "B"], deviation=BASE[1])
    b.dimension("link", body="link", between=["B", "output"], deviation=DEVIATION)
    b.output(body="link", at=cabin + LENGTH * direction(0.0))
    return b.mechanism()


def error(m: jp.Mechanism) -> Floats:
    """Position error of the output with the pin in its place of the play."""
    found = jp.given(m, {"B": GAMMA.tolist()}).error.isel(configuration=0)
    return np.asarray(found.sel(component=["x", "y"]).values)


def fixed() -> Fixed:
    """A link with the right angle, and with angles that are off to both sides."""
    near = BASE + GAMMA
    long = {theta: near + DEVIATION * direction(theta) for theta in (0.0, *THETAS)}
    phi, off = np.radians(PHI), {theta: float(np.radians(theta)) for theta in THETAS}
    chord = {
        theta: 2.0 * LENGTH * np.sin(t / 2.0) * np.array([-np.sin(phi + t / 2.0), np.cos(phi + t / 2.0)])
        for theta, t in off.items()
    }
    pin = link(0.0).with_({"output.at": "B", "dimensions.link": None})
    return Fixed(
        near=(near, error(pin)),
        straight=(long[0.0], error(link(0.0))),
        printed={theta: long[theta] + published.turned_end(LENGTH, phi, t) for theta, t in off.items()},
        across={theta: long[theta] + chord[theta] for theta in THETAS},
        exact={theta: error(link(theta)) for theta in THETAS},
    )
