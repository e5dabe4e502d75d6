"""A map on disk, written chunk by chunk, that is taken up where a killed run left it.

The map is a Zarr group. Beside its arrays a journal is kept, in this order for every chunk: the values, then the
journal's entry of the chunk, then the position. Each file of the journal appears as a whole or not at all, so that a
run that ends anywhere is repeated from its last position with the same outcome. An entry has the lengths and checksums
of the chunk's files, and what is taken up is compared with them; a complete group keeps them all. A `.nc` is made from
such a group, in a hidden folder beside it, when all chunks are done.
"""

from __future__ import annotations

import io
import json
import os
import uuid
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.analyses.map.lattice import Block
from jointplay.basics.arrays import Array
from jointplay.basics.files import remove_folder, require_writable, said_of
from jointplay.errors import InputError
from jointplay.result import Attribute, Result, Variable

from .checks import Damaged, Stamps, put_sealed, sealed, stamp, sync_folder
from .lock import Lock
from .netcdf import fingerprint_of, to_netcdf
from .plan import DIMENSIONS, Entry, StorePlan
from .writer import JOURNAL, RUN, Writer

if TYPE_CHECKING:
    import zarr

EXTENSIONS = (".zarr", ".nc")
#: files of the journal: how far the work is, what is written once, and the chunks that are written for another time
POSITION, STATIC, PENDING = "position", "static", "pending"
#: what a complete group was when it was written; only then is there such a file
MANIFEST = ".checksums"
#: files of the group that change when it is completed
ATTRIBUTES = (".zattrs", ".zmetadata")
#: attribute by which a map is recognised
FINGERPRINT = "fingerprint"
#: key of the stamps in the journal's entry of a chunk
STAMPS = "stamps"


def open_store(path: Path, plan: StorePlan, *, overwrite: bool) -> ChunkStore:
    """The store of a map that goes to a file, new or as an earlier run left it. It is locked until it is closed.

    Raises
    ------
    InputError
        When the path cannot be written, another run works on it, or it has something else than this map and is not to
        be overwritten.
    """
    if path.suffix not in EXTENSIONS:
        raise InputError(f"a map is written as {' or '.join(EXTENSIONS)}", file=os.fspath(path))
    place = require_writable(path, folder=path.suffix == ".zarr")
    if place.exists() and not place.is_file() and not place.is_dir():
        raise InputError("is a stream; a map needs a file", file=os.fspath(path))
    part = place if path.suffix == ".zarr" else place.with_name(f".{place.name}.part")
    with said_of(path):
        lock = Lock(place)
    try:
        with said_of(path):
            # What is finished counts; what is left of it in a part was about to be removed.
            there = next((p for p in (place, part) if p.exists()), None)
            if there is not None and _fingerprint(there) != plan.fingerprint:
                if not overwrite:
                    problem = "holds something else than this map; --overwrite (overwrite=True) replaces it"
                    raise InputError(problem, file=os.fspath(path if there == place else there))
                for old in {place, part}:
                    _remove(old)
            return ChunkStore(path, place, part, plan, lock, overwrite=overwrite)
    except BaseException:
        lock.release()
        raise


def _fingerprint(path: Path) -> str:
    if path.is_file():
        return fingerprint_of(path)
    try:
        return str(json.loads((path / ".zattrs").read_text(encoding="utf-8")).get(FINGERPRINT, ""))
    except (OSError, ValueError, AttributeError, RecursionError):
        return ""


def _remove(path: Path) -> None:
    """Remove a file or a folder, if there is one."""
    if path.is_dir() and not path.is_symlink():
        remove_folder(path)
    else:
        path.unlink(missing_ok=True)


class ChunkStore:
    """Keeps a map in a file.

    Parameters
    ----------
    name : Path
        What messages call it.
    path : Path
        The file, or the folder of a Zarr group.
    part : Path
        The group that is worked in; the same for a Zarr group.
    plan : Plan
        Layout.
    lock : Lock
        Keeps other runs away; released when the store is closed.
    overwrite : bool
        Whether a damaged map is made anew.
    """

    def __init__(self, name: Path, path: Path, part: Path, plan: StorePlan, lock: Lock, *, overwrite: bool) -> None:
        self.name, self.path, self.part, self.plan = name, path, part, plan
        self._lock, self._overwrite = lock, overwrite
        self._journal = part / JOURNAL
        self._writer = Writer(part, plan)
        self._pending: set[int] = set()
        self.position = (1, 0)

    def close(self) -> None:
        """Let other runs work on it; other processes that still write for this one stop."""
        (self._journal / RUN).unlink(missing_ok=True)
        self._lock.release()

    def writer(self) -> Writer | None:
        """What writes chunks from other processes, as soon as there is room for them."""
        if not self.part.exists():
            return None
        run = uuid.uuid4().hex
        (self._journal / RUN).write_text(run, encoding="ascii")
        return Writer(self.part.resolve(), self.plan, run)

    def is_complete(self) -> bool:
        """Whether an earlier run has finished it; all of it is read for this.

        Raises
        ------
        Damaged
            When it is not as it was written, and is not to be overwritten.
        """
        if self.part != self.path:
            return self.path.exists()
        if not (self.path / MANIFEST).exists():
            return False
        try:
            self._compare(self._stamps(self.path / MANIFEST))
        except Damaged:
            if not self._overwrite:
                raise
            _remove(self.part)
            return False
        return True

    def resume(self, order: Sequence[int]) -> tuple[int, int]:
        """The position from which the work goes on; the chunks before it, in this order, are as they were written.

        Raises
        ------
        Damaged
            When they are not, and the map is not to be overwritten.
        """
        if not self.part.exists():
            return self.position
        try:
            self.position = self._read_position()
            number, done = self.position
            self._compare(self._stamps(self._journal / STATIC))
            self._pending = self._read_pending()
            for chunk in order[:done] if number == 1 else order:
                if not self._entry_path(chunk).exists():
                    raise self._damaged(f"the journal has no entry of chunk {chunk}")
            for chunk in order:
                if chunk not in self._pending and self._entry_path(chunk).exists():
                    self._compare(self._read_entry(chunk)[1])
        except Damaged:
            if not self._overwrite:
                raise
            _remove(self.part)
            self.position, self._pending = (1, 0), set()
        return self.position

    def _damaged(self, what: str) -> Damaged:
        return Damaged(f"is damaged: {what}; --overwrite (overwrite=True) makes it anew", file=os.fspath(self.name))

    def _compare(self, stamps: Stamps) -> None:
        for name, known in stamps.items():
            found = stamp(self.part / name)
            if found != known:
                what = "is missing" if found is None else "is not as it was written"
                raise self._damaged(f"{name} {what}")

    def _sealed(self, path: Path) -> bytes:
        try:
            return sealed(path)
        except FileNotFoundError:
            raise self._damaged(f"{path.relative_to(self.part)} is missing") from None
        except ValueError:
            raise self._damaged(f"{path.relative_to(self.part)} is not as it was written") from None

    def _stamps(self, path: Path) -> Stamps:
        return _stamps_of(self._sealed(path))

    def _read_position(self) -> tuple[int, int]:
        number, done = json.loads(self._sealed(self._journal / POSITION))
        return (int(number), int(done))

    def _read_pending(self) -> set[int]:
        path = self._journal / PENDING
        return {int(number) for number in json.loads(self._sealed(path))} if path.exists() else set()

    def begin(self, first: Result) -> None:
        """Make room for the whole map, under another name until all of it is there."""
        if self.part.exists():
            return
        new = self.part.with_name(f".{self.part.name}.new")
        _remove(new)
        try:
            self._make(new, first)
            new.replace(self.part)
        except BaseException:
            _remove(new)
            raise
        sync_folder(self.part.parent)

    def _make(self, new: Path, first: Result) -> None:
        """The group without its chunks, and its journal."""
        import zarr

        loose = [name for name, v in first.coords.items() if v.dims != (name,)]
        attributes = {**first.attrs, FINGERPRINT: self.plan.fingerprint, "incomplete": "not all chunks are done"}
        group = zarr.open_group(new, mode="w", zarr_format=2)
        group.attrs.put({key: _plain(v) for key, v in attributes.items()} | {"coordinates": " ".join(loose)})
        for name, variable in {**first.coords, **first.data}.items():
            self._add(group, name, variable)
        # Readers then look for nothing else in the folder, also while the map is not complete.
        zarr.consolidate_metadata(new, zarr_format=2)
        files = [file.relative_to(new).as_posix() for file in sorted(new.rglob("*")) if file.is_file()]
        static = {name: stamp(new / name, sync=True) for name in files if name not in ATTRIBUTES}
        (new / JOURNAL).mkdir()
        put_sealed(json.dumps(static).encode(), new / JOURNAL / STATIC)
        put_sealed(json.dumps(self.position).encode(), new / JOURNAL / POSITION)

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

    def announce(self, number: int) -> None:
        """Say that a chunk will be put: if it was before, its values may be old or new until its entry follows."""
        if number not in self._pending and self._entry_path(number).exists():
            self._pending.add(number)
            self._put_pending()

    def put(self, number: int, region: Block, part: Result, entry: Entry) -> None:
        """Keep what has a value per node of a chunk, then what the journal says of it."""
        self.announce(number)
        self.record(number, entry, self._writer.write(region, part))

    def values(self, name: str, region: Block) -> Array:
        """Values of a variable in a part of the grid."""
        return np.array(self._writer.array(name)[region])

    def replace(self, number: int, name: str, region: Block, values: Array) -> None:
        """Change values of a variable in a part of a chunk."""
        # A run that was killed may have written them without saying so in the journal.
        if number not in self._pending and np.array_equal(values, self.values(name, region)):
            return
        entry, stamps = self._read_entry(number)
        self.announce(number)
        self.record(number, entry, {**stamps, **self._writer.replace(name, region, values)})

    def _put_pending(self) -> None:
        if self._pending:
            put_sealed(json.dumps(sorted(self._pending)).encode(), self._journal / PENDING)
        else:
            (self._journal / PENDING).unlink(missing_ok=True)

    def _entry_path(self, number: int) -> Path:
        return self._journal / f"{number}.npz"

    def entry(self, number: int) -> Entry | None:
        """What the journal holds of a chunk."""
        return self._read_entry(number)[0] if self._entry_path(number).exists() else None

    def _read_entry(self, number: int) -> tuple[Entry, Stamps]:
        with np.load(io.BytesIO(self._sealed(self._entry_path(number)))) as arrays:
            entry = dict(arrays)
        return entry, _stamps_of(entry.pop(STAMPS).tobytes())

    def record(self, number: int, entry: Entry, stamps: Stamps) -> None:
        """Keep what the journal says of a chunk whose values are written."""
        content = io.BytesIO()
        written = np.frombuffer(json.dumps(stamps).encode(), dtype=np.uint8)
        np.savez(content, allow_pickle=False, **{STAMPS: written, **entry})
        put_sealed(content.getvalue(), self._entry_path(number))
        if number in self._pending:
            self._pending.remove(number)
            self._put_pending()

    def advance(self, position: tuple[int, int]) -> None:
        """Move on: everything before this position is on disk."""
        put_sealed(json.dumps(position).encode(), self._journal / POSITION)
        self.position = position

    def finish(self, attributes: Mapping[str, Attribute]) -> None:
        """Complete the group with further attributes, and make a NetCDF file of it if one is asked."""
        import zarr

        own = self._writer.group.attrs
        own.put({key: v for key, v in own.asdict().items() if key != "incomplete"} | dict(attributes))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # the journal is not a part of the group
            complete = zarr.consolidate_metadata(self.part, zarr_format=2)
        if self.part != self.path:
            to_netcdf(complete, self.path, self.plan)
        else:
            stamps = self._stamps(self._journal / STATIC)
            for number in range(self.plan.count):
                stamps |= self._read_entry(number)[1]
            stamps |= {name: stamp(self.part / name, sync=True) for name in ATTRIBUTES}
            put_sealed(json.dumps(stamps).encode(), self.part / MANIFEST)
        self.clean()

    def clean(self) -> None:
        """Remove what only the work needed."""
        _remove(self.part if self.part != self.path else self._journal)


def _stamps_of(content: bytes) -> Stamps:
    return {name: known and (known[0], known[1]) for name, known in json.loads(content).items()}


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
