"""The boundary of a workspace for programs that draw or print: DXF, and STL in space.

In DXF every kind of bound is a layer: closed lines are cut where the bound changes, in space every triangle is a face.
The largest disc or ball and the box have layers of their own. A binary STL is 80 bytes, the number of triangles, and 50
bytes for each: its normal, its corners as 32-bit numbers, and two bytes that mean nothing.
"""

import itertools
from io import StringIO
from typing import Any

import numpy as np

from jointplay.analyses.workspace.lines import lines
from jointplay.errors import InputError
from jointplay.result import Result

from .drafting import COLOURS, FORBIDDEN, UNITS
from .drawing import ezdxf

NO_SURFACE = "a region in a plane has no surface: .stl is for space; .dxf has its boundary"
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])


def boundary_to_dxf(result: Result) -> bytes:
    """The boundary of a workspace as a drawing in DXF, in the unit of the result.

    Raises
    ------
    JointplayError
        When ezdxf is not installed.
    """
    document = ezdxf().new("R2010")
    document.header["$INSUNITS"] = UNITS[result.unit("vertex")]
    names = [*result.labels("bound"), "disc", "box"]
    for number, name in enumerate(names):
        document.layers.add(str(name).translate(FORBIDDEN), color=number % COLOURS + 1)
    space = document.modelspace()
    points = result.get("vertex")
    if points.shape[1] == 2:
        for word, line in lines(result):
            space.add_lwpolyline(line.tolist(), dxfattribs={"layer": word.translate(FORBIDDEN)})
    else:
        bounds = result.get("vertex_bound")
        for facet in result.get("facet").tolist():
            look = {"layer": str(bounds[facet[0]]).translate(FORBIDDEN)}
            space.add_3dface(points[facet].tolist(), dxfattribs=look)
    _add_inscribed(space, result)
    stream = StringIO()
    document.write(stream)
    return stream.getvalue().encode()


def _add_inscribed(space: Any, result: Result) -> None:
    centre, radius = result.get("disc_centre"), float(result.get("disc_radius"))
    low, high = result.get("box_low"), result.get("box_high")
    if not np.isfinite(radius):
        return
    if len(centre) == 2:
        space.add_circle(tuple(centre.tolist()), radius, dxfattribs={"layer": "disc"})
    else:
        # A ball is three circles.
        for normal in np.eye(3).tolist():
            there = ezdxf().math.OCS(normal).from_wcs(tuple(centre.tolist()))
            space.add_circle(there, radius, dxfattribs={"layer": "disc", "extrusion": normal})
    corners = np.array(list(itertools.product(*zip(low, high, strict=True))))
    for a, b in itertools.combinations(corners, 2):
        if np.count_nonzero(a != b) == 1:
            space.add_line(tuple(a.tolist()), tuple(b.tolist()), dxfattribs={"layer": "box"})


def boundary_to_stl(result: Result) -> bytes:
    """The boundary of a workspace in space as a binary STL, in the unit of the result.

    Raises
    ------
    InputError
        When the region is flat.
    """
    corners = result.get("vertex")[result.get("facet")]
    if corners.shape[2] != 3:
        raise InputError(NO_SURFACE, key="output")
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)
    triangles = np.zeros(len(corners), dtype=TRIANGLE)
    triangles["normal"], triangles["corners"] = normal, corners
    head = b"jointplay workspace".ljust(80, b" ")
    return head + np.array([len(corners)], dtype="<u4").tobytes() + triangles.tobytes()
