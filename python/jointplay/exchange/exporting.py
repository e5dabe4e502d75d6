"""`export`: a mechanism or the boundary of a workspace in a foreign format, by extension."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from jointplay.basics import files
from jointplay.basics.typed import typed
from jointplay.errors import InputError, listed
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, from_dataset

from .contacts import to_mjcf
from .drafting import to_dxf
from .outlines import boundary_to_dxf, boundary_to_stl
from .placing import to_placements

if TYPE_CHECKING:
    import xarray as xr

ModelWriter = Callable[[Mechanism, int], str]

DRAWING, TABLE = ".dxf", ".csv"
#: by extension, in small letters
WRITERS: Mapping[str, ModelWriter] = MappingProxyType({".xml": to_mjcf, ".mjcf": to_mjcf, DRAWING: to_dxf})
#: the same of the boundary of a workspace
BOUNDARIES: Mapping[str, Callable[[Result], bytes]] = MappingProxyType(
    {DRAWING: boundary_to_dxf, ".stl": boundary_to_stl}
)


@typed
def export(
    m: Mechanism | Result | xr.Dataset,
    path: str | os.PathLike[str],
    *,
    configuration: int | None = None,
    offsets: Mapping[str, Any] | None = None,
    deviations: Mapping[str, Any] | None = None,
    question: str | None = None,
    magnify: float = 1.0,
) -> None:
    """Write a mechanism, or the boundary of a workspace, in a foreign format.

    As `.xml` or `.mjcf` it is a model of MuJoCo, whose joints are contacts with the clearances of the mechanism: for a
    study of its dynamics. It has to be a mechanism of rigid bodies without couplings.

    As `.dxf` it is a drawing (needs the extra `dxf`): a layer for each body, pins as circles, guides as centre lines,
    the output with its path. `read` makes the same mechanism of it where it is planar and has pins, guides and slots.

    As `.csv` it is a table of the places of all bodies in all configurations, for a macro that puts the parts of an
    assembly there: position in mm and quaternion in the axes of the ground, and where the file starts them (`start`).

    A result of `workspace` is written as `.dxf`, with a layer for everything that bounds it, or in space as `.stl`.

    Parameters
    ----------
    m : Mechanism or xarray.Dataset
    path : path-like
        A file, which is replaced if it is there.
    configuration : int, optional
        The configuration in which the drives are held or that is drawn, from 0, which is the one if left out. A table
        has all of them.
    offsets, deviations : mapping, optional
        As for `given`: the mechanism is drawn where they displace it, so that it can be measured in a program for CAD.
        Of drawings and tables only.
    question : {"worst", "loaded"}, optional
        Of tables: the places in the worst case of the position, or under the loads.
    magnify : float, optional
        Of tables: factor on the displacements from the nominal places.

    Raises
    ------
    InputError
        When the format is not known or cannot have such a mechanism, or the file cannot be written.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("four-bar"))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "four-bar.xml")
    ...     jp.export(m, path)
    ...     path.read_text().count('class="pin"')
    5
    """
    place = Path(path)
    kind = place.suffix.lower()
    if not isinstance(m, Mechanism):
        boundary(m if isinstance(m, Result) else from_dataset(m), place)
        return
    if kind not in (*WRITERS, TABLE):
        problem = f"'{kind}' is not the extension of a format that is written; known: {listed([*WRITERS, TABLE])}"
        raise InputError(problem, file=os.fspath(path))
    if kind == TABLE and configuration is not None:
        raise InputError("a table has all configurations", file=os.fspath(path), key="configuration")
    if kind != TABLE and (question is not None or magnify != 1.0):
        key = "magnify" if question is None else "question"
        raise InputError("is of tables of places, .csv", file=os.fspath(path), key=key)
    files.require_writable(place)
    given = None if offsets is None and deviations is None else (offsets or {}, deviations or {})
    if kind == TABLE:
        text = to_placements(m, given, question, magnify)
    elif given is None:
        text = WRITERS[kind](m, configuration or 0)
    elif kind == DRAWING:
        text = to_dxf(m, configuration or 0, given)
    else:
        problem = "a model of MuJoCo has its clearances as contacts; offsets are drawn in a .dxf"
        raise InputError(problem, file=os.fspath(path), key="offsets")
    files.put(text.encode(), place)


def boundary(result: Result, path: Path) -> None:
    """Write the boundary of a workspace.

    Raises
    ------
    InputError
        When it is another result, or cannot be written there.
    """
    kind = path.suffix.lower()
    if result.attrs.get("question") != "workspace":
        raise InputError("is not the result of workspace; `save` writes every result", key="m")
    if kind not in BOUNDARIES:
        raise InputError(f"'{kind}' is not a format of a boundary; known: {listed(BOUNDARIES)}", file=os.fspath(path))
    files.put(BOUNDARIES[kind](result), files.require_writable(path))
