"""A map on disk, written chunk by chunk, that is taken up where a killed run left it.

The map is a Zarr group. Beside its arrays a journal is kept, in this order for every chunk: the values, then the
journal's entry of the chunk, then the position. Each file of the journal appears as a whole or not at all, so that a
run that ends anywhere is repeated from its last position with the same outcome. A `.nc` is made from such a group, in
a hidden folder beside it, when all chunks are done.
"""

from __future__ import annotations

import json
import os
import shutil
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.errors import InputError
from jointplay.result import Result, Variable

from .netcdf import fingerprint_of, to_netcdf
from .plan import DIMENSIONS, Array, Entry, Plan, Region

if TYPE_CHECKING:
    import zarr

EXTENSIONS = (".zarr", ".nc")
JOURNAL = ".journal"
POSITION = "position.json"
#: attribute by which a map is recognised
FINGERPRINT = "fingerprint"


def open_store(path: Path, plan: Plan, *, overwrite: bool) -> ChunkStore:
    """The store of a map that goes to a file, new or as an earlier run left it.

    Raises
    ------
    InputError
        When the path cannot be written, or has something else than this map and is not to be overwritten.
    """
    _check_path(path)
    part = path if path.suffix == ".zarr" else path.with_name(f".{path.name}.part")
    # What is finished counts; what is left of it in a part was about to be removed.
    there = next((p for p in (path, part) if p.exists()), None)
    if there is not None and _fingerprint(there) != plan.fingerprint:
        if not overwrite:
            problem = "holds something else than this map; --overwrite (overwrite=True) replaces it"
            raise InputError(problem, file=os.fspath(there))
        for old in {path, part}:
            _remove(old)
    return ChunkStore(path, part, plan)


def _check_path(path: Path) -> None:
    if path.suffix not in EXTENSIONS:
        raise InputError(f"a map is written as {' or '.join(EXTENSIONS)}", file=os.fspath(path))
    if not path.parent.is_dir():
        raise InputError(f"there is no folder '{path.parent}' to write it to", file=os.fspath(path))


def _fingerprint(path: Path) -> str:
    if path.is_file():
        return fingerprint_of(path)
    try:
        return str(json.loads((path / ".zattrs").read_text(encoding="utf-8")).get(FINGERPRINT, ""))
    except (OSError, ValueError):
        return ""


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


class ChunkStore:
    """Keeps a map in a file.

    Parameters
    ----------
    path : Path
        The file, or the folder of a Zarr group.
    part : Path
        The group that is worked in; the same for a Zarr group.
    plan : Plan
        Layout.
    """

    def __init__(self, path: Path, part: Path, plan: Plan) -> None:
        self.path, self.part, self.plan = path, part, plan
        self._journal = part / JOURNAL
        self._group: zarr.Group | None = None
        self.position = self._read_position()

    @property
    def is_complete(self) -> bool:
        """Whether an earlier run has finished it."""
        return self.path.exists() and (self.part != self.path or not self._journal.exists())

    def begin(self, first: Result) -> None:
        """Make room for the whole map, under another name until all of it is there."""
        if self.part.exists():
            return
        import zarr

        new = self.part.with_name(f".{self.part.name}.new")
        _remove(new)
        loose = [name for name, v in first.coords.items() if v.dims != (name,)]
        attributes = {**first.attrs, FINGERPRINT: self.plan.fingerprint, "incomplete": "not all chunks are done"}
        group = zarr.open_group(new, mode="w", zarr_format=2)
        group.attrs.put({key: _plain(v) for key, v in attributes.items()} | {"coordinates": " ".join(loose)})
        for name, variable in {**first.coords, **first.data}.items():
            self._add(group, name, variable)
        # Readers then look for nothing else in the folder, also while the map is not complete.
        zarr.consolidate_metadata(new, zarr_format=2)
        (new / JOURNAL).mkdir()
        new.replace(self.part)

    def _add(self, group: zarr.Group, name: str, variable: Variable) -> None:
        texts = {"units": variable.units, "long_name": variable.long_name}
        array = group.create_array(
            name,
            shape=self.plan.full_shape(name, variable),
            chunks=tuple(max(size, 1) for size in self.plan.chunk_shape(name, variable)),
            dtype=variable.values.dtype,
            # What has a fill value is read as missing where it is that: right for numbers, not for counts.
            fill_value=np.nan if variable.values.dtype.kind == "f" else None,
            attributes={DIMENSIONS: list(variable.dims)} | {key: text for key, text in texts.items() if text},
        )
        if not self.plan.has_nodes(name, variable):
            array[...] = variable.values

    @property
    def group(self) -> zarr.Group:
        """The group that is worked in."""
        if self._group is None:
            import zarr

            self._group = zarr.open_group(self.part, mode="r+", zarr_format=2, use_consolidated=False)
        return self._group

    def put(self, region: Region, part: Result) -> None:
        """Keep what has a value per node."""
        for name, variable in {**part.coords, **part.data}.items():
            if self.plan.has_nodes(name, variable):
                self.replace(name, region, variable.values)

    def values(self, name: str, region: Region) -> Array:
        """Values of a variable in a part of the grid."""
        return np.array(self._array(name)[region])

    def replace(self, name: str, region: Region, values: Array) -> None:
        """Change values of a variable in a part of the grid."""
        self._array(name)[region] = values

    def _array(self, name: str) -> Any:
        return self.group[name]

    def entry(self, number: int) -> Entry | None:
        """What the journal holds of a chunk."""
        path = self._journal / f"{number}.npz"
        if not path.exists():
            return None
        with np.load(path) as arrays:
            return dict(arrays)

    def put_entry(self, number: int, entry: Entry) -> None:
        """Write the journal's entry of a chunk."""
        new = self._journal / ".new.npz"
        np.savez(new, allow_pickle=False, **entry)
        new.replace(self._journal / f"{number}.npz")

    def advance(self, position: tuple[int, int]) -> None:
        """Move on: everything before this position is on disk."""
        new = self._journal / ".new.json"
        new.write_text(json.dumps(position), encoding="utf-8")
        new.replace(self._journal / POSITION)
        self.position = position

    def _read_position(self) -> tuple[int, int]:
        try:
            number, done = json.loads((self._journal / POSITION).read_text(encoding="utf-8"))
        except OSError:
            return (1, 0)
        return (int(number), int(done))

    def finish(self) -> None:
        """Complete the group, and make a NetCDF file of it if one is asked."""
        import zarr

        self.group.attrs.put({key: v for key, v in self.group.attrs.asdict().items() if key != "incomplete"})
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # the journal is not a part of the group
            complete = zarr.consolidate_metadata(self.part, zarr_format=2)
        if self.part != self.path:
            to_netcdf(complete, self.path, self.plan)
        self.clean()

    def clean(self) -> None:
        """Remove what only the work needed; the position last, so that the rest is not missed."""
        if self.part != self.path:
            _remove(self.part)
        elif self._journal.exists():
            for file in sorted(self._journal.iterdir(), key=lambda file: file.name == POSITION):
                file.unlink()
            self._journal.rmdir()


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
