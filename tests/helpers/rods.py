"""A rod between two balls, with a rocker and with a slider."""

import jointplay as jp
from helpers.builders import spatial


def _rod_and_rocker() -> jp.Mechanism:
    b = spatial()
    shaft = {"at": [0, 0, 0], "axis": [0, 0, 1], "side": [1, 0, 0]}
    b.revolute("crank", ground=shaft, crank=shaft)
    b.spherical("hook", crank=(30, 0, 0), coupler=(0, 0, 0), clearance=jp.radial(0.2))
    b.spherical("ball", coupler=(176, 0, 0), rocker=(0, 0, 100), clearance=jp.radial(0.1))
    bearing = {"axis": [1, 0, 0], "side": [0, 0, 1]}
    b.revolute("rocker", ground={"at": [130, 0, -60], **bearing}, rocker={"at": [0, 0, 0], **bearing})
    b.start("rocker", rotation=[20, 0, 0])
    b.drive("theta", joint="crank", from_=0, to=330, count=12)
    b.output(body="rocker", at="ball")
    b.load(force=(2, 5, -10))
    b.dimension("coupler", body="coupler", between=["hook", "ball"], tolerance=0.05)
    return b.mechanism()


RSSR = _rod_and_rocker()


def rod_and_slider(drive: str, b: jp.Builder, **driven: object) -> jp.Builder:
    """A crank about z, a rod between two balls, a slider along x beside and below; mm, degrees and N."""
    b.revolute(
        "shaft",
        ground={"at": [0, 0, 0], "axis": [0, 0, 1]},
        crank={"at": [0, 0, 0], "axis": [0, 0, 1]},
        clearance=jp.radial(0.02, axial=0.03, length=30),
    )
    b.spherical("A", crank=(40, 0, 10), rod=(0, 0, 0), clearance=jp.radial(0.015))
    b.spherical("B", rod=(120, 0, 0), slider=(0, 0, 0), clearance=jp.radial(0.015))
    b.prismatic(
        "guide",
        ground={"at": [0, 15, -30], "axis": [1, 0, 0], "side": [0, 1, 0]},
        slider={"at": [0, 0, 0], "axis": [1, 0, 0], "side": [0, 1, 0]},
        clearance=jp.gap(0.03, length=60, width=30, height=20),
    )
    b.start("slider", x=150, y=15, z=-30)
    b.drive(drive, joint="shaft", values=[30, 75], **driven)
    b.output(body="slider", at=(50, -20, 10))
    b.load(force=(-200, 30, 40))
    return b
