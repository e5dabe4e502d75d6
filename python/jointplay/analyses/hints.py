"""Numbers that look as if another one was meant. A hint is no refusal: such a mechanism may be right."""

import math
import re
from collections.abc import Iterator

import numpy as np

from jointplay.core.compile import ANGULAR
from jointplay.file.schema import PlanarFile
from jointplay.model.mechanism import Mechanism

#: a clearance above this share of the shortest link at its joint
LARGE = 0.1
#: largest bodies, in millimetres and metres, that are rarely meant
SMALLEST_IN_MM, LARGEST_IN_M = 1.0, 50.0
#: what a number is off that was typed with two decimals
ROUGH = 0.005
#: a link that is so small beside all others may be in another unit
THOUSANDTH = (2e-4, 4e-3)
#: a list of numbers in which a comma is not followed by a blank, and another one is
MIXED = re.compile(r"\[[^\[\]]*\d,\d[^\[\]]*, [^\[\]]*\]|\[[^\[\]]*, [^\[\]]*\d,\d[^\[\]]*\]")
COMMENT = re.compile("#.*")
#: no material is stiffer, N/m^2
STIFFEST = 2e12
#: whole angles that are degrees, in a file in radians
DEGREES = (30, 45, 60, 90, 120, 135, 150, 180, 270, 360, 720)


def hints(m: Mechanism) -> list[str]:
    """What may be in another unit than the file says, or there twice, in sentences."""
    return [*_commas(m), *_angles(m), *_lengths(m), *_clearances(m), *_moduli(m), *_lost_motion(m)]


def _commas(m: Mechanism) -> Iterator[str]:
    """A list such as ``[0,5, 30]``, in which one comma has no blank behind it and others have one."""
    found = MIXED.search(COMMENT.sub("", m.written))
    if found:
        yield f"{found[0]} has {found[0].count(',') + 1} values: decimals have a point, such as 0.5."


def _angles(m: Mechanism) -> Iterator[str]:
    starts = _start_angles(m)
    drives = [] if m.drive_values is None else _driven_angles(m)
    if m.units.angle_name == "rad":
        for key, value in (*starts, *drives):
            if abs(value) in DEGREES:
                yield f"{key} = {value:g} looks like degrees, but the file is in radians (units.angle)."
                return
    turned = [abs(value) for _, value in starts if value != 0.0]
    small = turned and max(turned) <= 2.0 * math.pi and max(turned) > 0.5
    if m.units.angle_name != "deg":
        return
    if len(turned) > 1 and small and all(value % 0.5 for value in turned):
        yield "All angles of [start] are below 7: they look like radians, but the file is in degrees (units.angle)."
    elif drives and max(abs(value) for _, value in drives) <= 2.0 * math.pi + ROUGH:
        for key, value in drives:
            # 1.57 is a quarter of a turn to those who count in radians, and nothing to others.
            if any(abs(abs(value) - k * math.pi / 12) < ROUGH for k in range(3, 25)):
                yield f"{key} = {value:g} looks like radians, but the file is in degrees (units.angle)."
                return


def _start_angles(m: Mechanism) -> list[tuple[str, float]]:
    if not isinstance(m.data, PlanarFile):
        return []
    angles = ((name, start.angle) for name, start in m.data.start.items())
    return [(f"start.{name}.angle", float(angle)) for name, angle in angles if angle is not None]


def _driven_angles(m: Mechanism) -> list[tuple[str, float]]:
    assert m.drive_values is not None
    values = m.drive_values / m.drive_factors
    turning = [d for d, joint in enumerate(m.drive_joints) if m.joint_kinds[joint] in ANGULAR]
    return [(f"drives.{m.drives[d]}", float(value)) for d in turning for value in values[[0, -1], d].round(9)]


def _spans(m: Mechanism) -> dict[int, list[tuple[int, np.ndarray]]]:
    """Joints on every body with their places, the ground among them."""
    found: dict[int, list[tuple[int, np.ndarray]]] = {}
    for k, ends in enumerate(m.joint_points):
        for point in (m.points[end] for end in ends):
            found.setdefault(point.body, []).append((k, np.array(point.at)))
    return found


def _lengths(m: Mechanism) -> Iterator[str]:
    every = [[at for _, at in places] for places in _spans(m).values()]
    largest = max((float(np.ptp(at, axis=0).max()) for at in every), default=0.0)
    yield from _thousandth(m)
    unit = m.units.length_name
    if unit == "mm" and 0.0 < largest < SMALLEST_IN_MM * 1e-3:
        size = f"{largest / 1e-3:.3g} mm"
        yield f"The largest body is {size}: lengths look like metres, but the file is in mm (units.length)."
    if unit == "m" and largest > LARGEST_IN_M:
        size = f"{largest:.3g} m"
        yield f"The largest body is {size}: lengths look like millimetres, but the file is in m (units.length)."


def _thousandth(m: Mechanism) -> Iterator[str]:
    """A link that is a thousand times smaller or larger than all others."""
    sizes = {}
    for body, places in _spans(m).items():
        span = float(np.ptp([at for _, at in places], axis=0).max())
        if span > 0.0 and body >= 0:
            sizes[m.bodies[body]] = span
    if len(sizes) < 3:
        return
    least, less, *_ = ordered = sorted(sizes.values())
    more, most = ordered[-2:]
    for name, own in sizes.items():
        # Of all others; of equal ones there is another.
        low, high = (less if own == least else least), (more if own == most else most)
        if any(THOUSANDTH[0] < factor < THOUSANDTH[1] for factor in (own / high, low / own)):
            length, unit = m.units.length, m.units.length_name
            yield (
                f"{name} is {own / length:.3g} {unit} long and the others are {low / length:.3g} to"
                f" {high / length:.3g} {unit}: is one of them in another unit?"
            )
            return


def _clearances(m: Mechanism) -> Iterator[str]:
    links_of: dict[int, list[float]] = {}
    for places in _spans(m).values():
        # A joint may be on a body twice; its first place counts.
        for joint, here in dict(reversed(places)).items():
            apart = (float(np.linalg.norm(at - here)) for _, at in places)
            links_of.setdefault(joint, []).extend(length for length in apart if length > 1e-9 * m.length)
    for _, joint, play in m.round_plays:
        links = links_of.get(joint, [])
        if links and play > LARGE * min(links):
            radius, link = play / m.units.length, min(links) / m.units.length
            yield (
                f"The radial clearance of {m.joints[joint]} is {radius:.3g} {m.units.length_name}, above a tenth of a"
                f" link ({link:.3g} {m.units.length_name}): is it in another unit?"
            )


def _moduli(m: Mechanism) -> Iterator[str]:
    for name, body in m.data.bodies.items():
        if body.E is not None and body.E * m.units.force / m.units.length**2 > STIFFEST:
            unit = f"{m.units.force_name}/{m.units.length_name}^2"
            yield f"bodies.{name}.E = {body.E:g} {unit} is stiffer than any material: is it in Pa?"


def _lost_motion(m: Mechanism) -> Iterator[str]:
    for name, drive in m.data.drives.items():
        for play in drive.backlashes.values():
            if drive.error is not None and drive.error.high in (play.width, play.width / 2.0, play.plus) and play.width:
                yield (
                    f"drives.{name} has an error of {drive.error.high:g} and a backlash of {play.width:g}: lost motion"
                    " counts once, as backlash."
                )
                break
