"""Writes the chunks of a map into its group, from any process that sees the folder."""

from __future__ import annotations

import platform
from collections.abc import Iterable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointplay.analyses.map.lattice import Block
from jointplay.basics.arrays import Array
from jointplay.errors import InputError
from jointplay.result import Result

from .checks import Stamps, stamp
from .plan import StorePlan

if TYPE_CHECKING:
    import zarr

#: folder beside the arrays of a group that is worked on
JOURNAL = ".journal"
#: file of the journal with the name of the run that works on it
RUN = "run"


class Writer:
    """Writes chunks into a group.

    Parameters
    ----------
    part : Path
        The group.
    plan : Plan
        Layout.
    run : str, optional
        The run that it writes for: it stops writing when that has ended, and says so where the group is not seen.
    """

    def __init__(self, part: Path, plan: StorePlan, run: str = "") -> None:
        self.part, self.plan, self.run = part, plan, run

    def __reduce__(self) -> tuple[object, ...]:
        return (Writer, (self.part, self.plan, self.run))

    @cached_property
    def group(self) -> zarr.Group:
        """The group."""
        import zarr

        return zarr.open_group(self.part, mode="r+", zarr_format=2, use_consolidated=False)

    def array(self, name: str) -> Any:
        """An array of the group."""
        return self.group[name]

    def write(self, region: Block, part: Result) -> Stamps:
        """Write what has a value per node of a chunk; the stamps of its files, which have reached the disk.

        Raises
        ------
        InputError
            When the group is not seen from here, or its run has ended.
        """
        variables = {**part.coords, **part.data}
        arrays = {name: v.values for name, v in variables.items() if self.plan.has_nodes(name, v)}
        for name, values in arrays.items():
            self._require_run()
            self.array(name)[region] = values
        return self.written(arrays, region)

    def replace(self, name: str, region: Block, values: Array) -> Stamps:
        """Change values of a variable in a part of a chunk; the stamp of its file."""
        self.array(name)[region] = values
        return self.written([name], region)

    def written(self, names: Iterable[str], region: Block) -> Stamps:
        """The files of a chunk of the map, which is a chunk of every array, when they have reached the disk."""
        place = [part.start // step for part, step in zip(region, self.plan.chunk, strict=True)]
        stamps: Stamps = {}
        for name in names:
            index = [*place, *[0] * (self.array(name).ndim - len(place))]
            file = f"{name}/{'.'.join(map(str, index))}"
            stamps[file] = stamp(self.part / file, sync=True)
        return stamps

    def _require_run(self) -> None:
        if not self.run:
            return
        try:
            works = (self.part / JOURNAL / RUN).read_text(encoding="ascii") == self.run
        except OSError:
            works = False
        if not works:
            problem = "is not seen by a worker on {}; a map goes to a folder that all machines share, by the same path"
            raise InputError(problem.format(platform.node()), file=str(self.part))
