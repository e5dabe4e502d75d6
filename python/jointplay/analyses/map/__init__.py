"""`map`: a question asked at every node of a grid of drives or of output poses."""

from __future__ import annotations

import hashlib
import inspect
import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointplay.analyses.cluster import Here, Workers, connected
from jointplay.analyses.nominal import Interrupted, Progress
from jointplay.analyses.questions import check, computation
from jointplay.basics.progress import watched
from jointplay.basics.typed import typed
from jointplay.core.compile import Grid
from jointplay.errors import InputError, in_range
from jointplay.file.schema.values import spaced
from jointplay.model.mechanism import Mechanism
from jointplay.questions import QUESTIONS
from jointplay.result import SEVERAL, Result, quantity, to_dataset, version

from .answering import OWN, ChunkAsking, MapQuestion, axis_names, drive_names, unassembled
from .lattice import Lattice
from .run import Work
from .store import MemoryStore, StorePlan, open_store

if TYPE_CHECKING:
    import xarray as xr

    from jointplay.analyses.cluster import Scheduler

#: of the largest map: some ten gigabytes where only the error is kept
MOST_NODES = 10**9
#: parameters of a question on which its numbers do not depend, or that the map gives
NO_OPTIONS = ("m", "at", "progress", "threads", "offset", "scheduler")


class Stopped(KeyboardInterrupt):
    """Ctrl-C while a map was written; the words say what is there and how it goes on."""


@typed
def map(
    m: Mechanism,
    question: str = "loaded",
    grid: Mapping[str, Any] | None = None,
    *,
    path: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    chunk: int | None = None,
    scheduler: Scheduler | None = None,
    **options: Any,
) -> xr.Dataset:
    """Ask a question at every node of a grid of drives or of output poses.

    Parameters
    ----------
    m : Mechanism
    question : str
        Such as ``worst``; `jointplay map --help` lists all that can be asked.
    grid : mapping, optional
        In place of the file's ``[grid]``, in file units: by drive or by component of the output a table
        ``{"from": -100, "to": 100, "count": 201}``, a sequence of values, or a number that holds it. One to three axes.
    path : path-like, optional
        A `.zarr` or `.nc` to which every chunk is written when it is done. Run again, an unfinished map continues
        where it stopped. Without it the map is made in memory.
    overwrite : bool
        Whether something else at the path is replaced.
    chunk : int, optional
        Nodes that are computed at a time; memory grows with it.
    scheduler : distributed.Client or str, optional
        A Dask client, or the address of a scheduler, whose workers are asked in place of this process. They write their
        chunks themselves, in a folder that all machines share. The result has the same bits; the attribute `retried`
        says how many tasks had to be begun again, if any.
    **options
        Of the question, such as ``samples`` or ``offsets``; ``details=False`` of ``loaded`` makes large maps several
        times faster and smaller.

    Returns
    -------
    xarray.Dataset
        The variables of the question over the axes of the grid, with `status` per node; on a grid of output poses the
        drives are coordinates. `contact_change` (for ``loaded``): whether a contact changes sides between the node and
        the next one along the axis `across`. `singular_crossing`: at which part of the way to that one the mechanism
        becomes singular. `leaves_range`: with ranges of drives or joints in the file, which of them leaves its range.
        With a path the dataset is read from the file when it is used.

    Raises
    ------
    InputError
        When there is no grid, it does not fit the mechanism, or the path holds something else; when the scheduler does
        not answer, or a worker does not see the path or is not like this process.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("five-bar"))
    >>> result = jp.map(m, grid={"x": [-40, 0, 40], "y": [150, 190]})
    >>> result.error.sel(component="y").values.round(3)
    array([[-0.083, -0.066],
           [-0.091, -0.07 ],
           [-0.087, -0.069]])
    """
    made = compute(m, question, grid, path=path, overwrite=overwrite, chunk=chunk, scheduler=scheduler, **options)
    if made is not None:
        return to_dataset(made)
    assert path is not None
    return open_map(path)


def open_map(path: str | os.PathLike[str]) -> xr.Dataset:
    """A map on disk as a dataset that reads from there what is used of it."""
    import xarray as xr

    if Path(path).suffix == ".nc":
        return xr.open_dataset(path, engine="h5netcdf")
    return xr.open_dataset(path, engine="zarr", chunks=None)


@watched
def compute(
    m: Mechanism,
    question: str = "loaded",
    grid: Mapping[str, Any] | None = None,
    *,
    path: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    chunk: int | None = None,
    progress: Progress | None = None,
    scheduler: Scheduler | None = None,
    **options: Any,
) -> Result | None:
    """The light form of `map`; None when the map goes to a file.

    Raises
    ------
    Interrupted
        On Ctrl-C, with the part of a map in memory that is done.
    Stopped
        On Ctrl-C, when the map goes to a file.
    """
    if overwrite and path is None:
        raise InputError("goes with a path: in memory there is nothing to replace", key="overwrite")
    grid_of, ask = _prepared(m, question, grid, options)
    if chunk is not None:
        in_range(chunk, "chunk", "a number of nodes", 1, MOST_NODES)
    nodes = math.prod(grid_of.shape)
    if nodes > MOST_NODES:
        raise InputError(f"{nodes:.3g} nodes; up to {MOST_NODES:.0e} are possible", file=m.file, key="grid")
    lattice = Lattice(grid_of, chunk or QUESTIONS[question].chunk)
    asking = ChunkAsking(ask, lattice, drive_names(ask.m, grid_of, unassembled(ask.m, ask)))
    with connected(scheduler) as workers:
        return _made(asking, path, workers, overwrite=overwrite, progress=progress)


def _made(
    asking: ChunkAsking,
    path: str | os.PathLike[str] | None,
    workers: Here | Workers,
    *,
    overwrite: bool,
    progress: Progress | None,
) -> Result | None:
    """The map in memory; None where it goes to a file."""
    lattice, ask = asking.lattice, asking.ask
    fingerprint = _fingerprint(ask.whole, ask.question, lattice, ask.options)
    plan = StorePlan(axis_names(lattice.grid, asking.names), lattice.shape, lattice.chunk, fingerprint)
    store = MemoryStore(plan) if path is None else open_store(Path(path), plan, overwrite=overwrite)
    try:
        if not isinstance(store, MemoryStore) and store.is_complete():
            store.clean()
            return None
        Work(asking, store, workers).run(progress)
    except KeyboardInterrupt:
        done = min(store.position[1], len(lattice)) if store.position[0] == 1 else len(lattice)
        words = f"interrupted after {done} of {len(lattice)} chunks"
        if path is not None:
            raise Stopped(f"{words}, which are kept; the same command continues from there") from None
        if done == 0 or not isinstance(store, MemoryStore):
            raise KeyboardInterrupt from None
        part = store.result
        raise Interrupted(Result(part.coords, part.data, {**part.attrs, "incomplete": words})) from None
    except OSError as error:
        if path is None:
            raise
        problem = f"cannot be written: {error.strerror or error}; the same command continues with what is done"
        raise InputError(problem, file=os.fspath(path)) from None
    finally:
        store.close()
    return store.result if isinstance(store, MemoryStore) else None


def check_variable(
    m: Mechanism, question: str, grid: Mapping[str, Any] | None, options: Mapping[str, Any], variable: str
) -> None:
    """Refuse before the work what is to be drawn of a map that will not have it.

    Raises
    ------
    InputError
        When there is no such variable, or its labels do not pick one number per node.
    """
    _, ask = _prepared(m, question, grid, options)
    if variable.partition(".")[0] in OWN:
        return
    found = unassembled(ask.m, ask)
    for dim in (dim for dim in SEVERAL if dim in found.sizes):
        found = found.isel(dim, 0)
    quantity(found, variable)


def _prepared(
    m: Mechanism, question: str, grid: Mapping[str, Any] | None, options: Mapping[str, Any]
) -> tuple[Grid, MapQuestion]:
    """The grid, and the question of the mechanism that has it."""
    check(question, options, "map")
    if grid is not None:
        m = m.with_({"grid": dict(grid)})
        # A map is the same however its grid was written.
        m = m.with_({"grid": {name: _said(axis.nodes) for name, axis in (m.data.grid or {}).items()}})
    ask = MapQuestion(m, question, options)
    if ask.m.grid is None:
        problem = "say what is mapped: a [grid] in the file, grid={...}, or --grid x=-100:100:201"
        raise InputError(problem, file=m.file, key="grid")
    return ask.m.grid, ask


def _said(nodes: Sequence[float]) -> object:
    """The values along an axis in the shortest form."""
    if len(nodes) == 1:
        return nodes[0]
    if tuple(nodes) == spaced(nodes[0], nodes[-1], len(nodes)):
        return {"from": nodes[0], "to": nodes[-1], "count": len(nodes)}
    return {"values": list(nodes)}


def _fingerprint(m: Mechanism, question: str, lattice: Lattice, options: Mapping[str, Any]) -> str:
    """What has to be the same for a map to go on: all that its numbers and labels depend on, however it was written."""
    assert m.grid is not None
    known = inspect.signature(computation(question, "map")).parameters
    said = {
        "mechanism": [m.title, m.spec(), m.bodies, m.joints, m.drives, m.sources, m.parameters, vars(m.units)],
        "start": [m.start_drives] if m.drive_values is None else [m.start_drives, m.drive_values[0]],
        "grid": vars(m.grid),
        "limits": {name: dict(v) if isinstance(v, Mapping) else v for name, v in vars(m.limits).items()},
        "question": question,
        "options": {name: options.get(name, known[name].default) for name in sorted(known) if name not in NO_OPTIONS},
        "chunk": lattice.chunk,
        "version": version(),
    }
    if m.outputs or m.load_cases:
        said["several"] = [
            [part.of, part.spec(), [*part.limits.bounds(part.quantities).ravel()]] for part in m.every_part
        ]
    text = json.dumps(said, sort_keys=True, default=lambda v: v.tolist() if hasattr(v, "tolist") else str(v))
    return hashlib.sha256(text.encode()).hexdigest()
