"""The one mechanism type: read from a file, checked, immutable. Analyses are functions of it."""

from __future__ import annotations

import copy
import hashlib
import importlib
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, Unpack, cast

import numpy as np

from jointplay import _core
from jointplay.basics import files
from jointplay.basics.arrays import Floats
from jointplay.basics.foreign import EXTENSIONS, is_link
from jointplay.basics.typed import typed
from jointplay.core.compile import Compiled, CompiledSource, DriveMotion, Loads, compile_file
from jointplay.core.sets import grown
from jointplay.core.spec import Changes, LoadSpec, PointSpec, Spec
from jointplay.errors import InputError, not_known
from jointplay.file import carried, document, measured, toml
from jointplay.file.document import Source
from jointplay.file.schema import MechanismFile, validate
from jointplay.file.schema.keys import change, expand, value_at
from jointplay.model import motion
from jointplay.model.inertia import acting, kinematics
from jointplay.model.patterns import written_out


def in_core(spec: Spec) -> _core.Mechanism:
    """A mechanism in the compiled core.

    Raises
    ------
    ValueError
        When the core refuses it.
    """
    return _core.Mechanism(json.dumps(dict(spec), allow_nan=False))


#: what users find in a mechanism; the rest is for the analyses
PUBLIC = (
    *("bodies", "drives", "hash", "joints", "load_cases", "outputs", "parameters", "raw", "sources", "units"),
    *("only", "title", "value", "with_", "write"),
)
#: tables that say nothing of the mechanism: who approves it does not make another one of it
ASIDE = ("board", "document")
#: the same of a key of bodies
DRAWN = "outline"
#: extensions of other formats, which are known far above this layer
#: what has the order of the file
ORDERED = ("bodies", "joints", "sources", "drives", "parameters", "outputs", "load_cases", "core_spec")


#: what notebooks show of a mechanism stands far above this layer; it is found by its name when it is asked for
DISPLAY = "jointplay.show.display"


class Mechanism(Compiled):
    """A mechanism of any graph, immutable. Read one with `load` or `loads`, change a copy with `with_`.

    Two mechanisms are equal when their files have the same content.

    Parameters
    ----------
    raw : mapping
        The data of a mechanism file.
    file : str
        Its name in messages.

    Attributes
    ----------
    raw : mapping
        The data of the file, as plain tables, lists and values.
    bodies, joints, sources, drives : tuple of str
        Names. A pin with several riders counts as several joints, ``PIN/RIDER``.
    parameters : tuple of str
        Label of every clearance offset, deviation and drive error, such as ``J1.x``.
    units : Units
        Units of the file.
    hash : str
        Eight digits by which results and figures name it; the same for all files with the same mechanism,
        whatever their ``[document]`` and the outlines of their bodies say.
    outputs, load_cases : tuple of str
        Names of the outputs and of the load cases that questions are asked of; empty where the file has ``[output]``
        and no load cases, or where `only` has chosen one.

    Raises
    ------
    InputError
        When the data is not a valid mechanism.
    """

    raw: Mapping[str, Any]
    outputs: tuple[str, ...]
    load_cases: tuple[str, ...]
    #: the output and the load case that the numbers are of; empty where there is none
    of: tuple[str, str]
    _whole: MechanismFile
    #: what was chosen of the same file before
    _parts: dict[object, Mechanism]
    #: the text that it was read from, if it was
    _source: Source | None

    @typed
    def __init__(self, raw: Mapping[str, Any], file: str = "<data>") -> None:
        self._of(raw, file, None)

    def _of(
        self, raw: Mapping[str, Any], file: str, source: Source | None, part: tuple[str, str] | None = None
    ) -> None:
        """Read a file; with a `part`, an output and a load case, only that is made."""
        vars(self).update(_source=source)
        toml.check_plain(raw, file=file)
        tables: dict[str, Any] = plain(raw)
        written = written_out(tables, file)
        try:
            data = validate(written.data, file)
            if part is None:
                self._read(tables, data, file)
            else:
                self._make(tables, data, file, part, (), (), {})
        except InputError as error:
            raise written.as_the_user_wrote(error) from None

    def _read(self, tables: dict[str, Any], data: MechanismFile, file: str) -> None:
        outputs, cases = tuple(data.outputs), tuple(data.load_cases)
        self._make(tables, data, file, (next(iter(outputs), ""), ""), outputs, cases, {})
        # What is wrong with any of them is said now.
        if cases:
            loaded = [self.only(load_case=name).has_loads for name in cases]
            vars(self)["has_loads"] = any(loaded)
        for name in outputs[1:]:
            self.only(output=name)

    def _make(
        self,
        raw: Mapping[str, Any],
        whole: MechanismFile,
        file: str,
        of: tuple[str, str],
        outputs: tuple[str, ...],
        load_cases: tuple[str, ...],
        parts: dict[object, Mechanism],
    ) -> None:
        compiled = compile_file(whole, file, *of)
        # The class is frozen; this is where it is made.
        vars(self).update({f.name: getattr(compiled, f.name) for f in fields(compiled)})
        vars(self).update(raw=raw, _whole=whole, of=of, outputs=outputs, load_cases=load_cases, _parts=parts)

    @typed
    def only(self, output: str | None = None, load_case: str | None = None) -> Mechanism:
        """The mechanism with one of its outputs, or in one of its load cases, as if the file had no others.

        Parameters
        ----------
        output : str, optional
            One of `outputs`; all of them if left out.
        load_case : str, optional
            One of `load_cases`; all of them if left out. The loads of every case act as well.

        Raises
        ------
        InputError
            When the file has no such output or load case.

        Examples
        --------
        >>> from jointplay import examples
        >>> changes = {"output": None, "loads": None, "outputs.tip": {"body": "rocker"}}
        >>> m = loads(examples.text("four-bar")).with_(changes)
        >>> m.outputs, m.only(output="tip").outputs
        (('tip',), ())
        """
        for name, known, key in ((output, self.outputs, "outputs"), (load_case, self.load_cases, "load_cases")):
            if name is not None and name not in known:
                raise InputError(not_known(name, f"one of the {key.replace('_', ' ')}", known), file=self.file, key=key)
        of = (output or self.of[0], load_case or self.of[1])
        return self._part(of, self.outputs if output is None else (), self.load_cases if load_case is None else ())

    def without_load_cases(self) -> Mechanism:
        """The mechanism with the loads of every case only, for what does not depend on loads."""
        return self._part((self.of[0], ""), self.outputs, ())

    @property
    def first(self) -> Mechanism:
        """The mechanism that the numbers are of: its first output, with the loads of every case only."""
        return self._part(self.of, (), ())

    @property
    def every_part(self) -> list[Mechanism]:
        """The mechanism with each of its outputs in each of its load cases."""
        outputs, cases = self.outputs or (None,), self.load_cases or (None,)
        return [self.only(output, case) for output in outputs for case in cases]

    @property
    def names_leader(self) -> bool:
        """Whether one of several outputs is said to be the one that the path and a grid speak of."""
        return any(output.leads for output in self._whole.outputs.values())

    @property
    def leader(self) -> Mechanism:
        """The mechanism with the output that the path and a grid of positions speak of."""
        named = [name for name, output in self._whole.outputs.items() if output.leads]
        return self._part((named[0], ""), (), ()) if named and named[0] != self.of[0] else self

    def _part(self, of: tuple[str, str], outputs: tuple[str, ...], load_cases: tuple[str, ...]) -> Mechanism:
        key = (of, bool(outputs), bool(load_cases))
        if key == (self.of, bool(self.outputs), bool(self.load_cases)):
            return self
        if key not in self._parts:
            part = object.__new__(Mechanism)
            vars(part).update(_source=self._source)
            part._make(self.raw, self._whole, self.file, of, outputs, load_cases, self._parts)
            if load_cases:
                vars(part)["has_loads"] = self.has_loads
            self._parts[key] = part
        return self._parts[key]

    @property
    def chosen(self) -> tuple[str | None, str | None]:
        """The output and the load case that `only` has chosen."""
        output, load_case = self.of
        return (output or None if not self.outputs else None, load_case or None if not self.load_cases else None)

    @property
    def has_target(self) -> bool:
        """Whether the file says of every output that is asked about what it ought to do."""
        return all(self.only(output).ideal is not None for output in self.outputs or (None,))

    def __dir__(self) -> list[str]:
        return sorted(PUBLIC)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a mechanism is immutable; with_() gives a copy with another {name}")

    @property
    def title(self) -> str:
        """The file's title."""
        return self.data.title

    @property
    def start_poses(self) -> Floats:
        """Poses that the bodies start from, SI, shape (body, pose): of the file where it has them."""
        return np.asarray(self.core_spec["guess"], dtype=np.float64)

    @cached_property
    def core(self) -> _core.Mechanism:
        """The mechanism in the compiled core, made when first needed."""
        try:
            return in_core(self.core_spec)
        except ValueError as error:
            raise InputError(str(error), file=self.file) from error

    @cached_property
    def known(self) -> dict[str, Any]:
        """What has been found of it once and holds whatever is asked, by what it is."""
        return {}

    def at_rest_under(self, configuration: int) -> Mechanism:
        """The mechanism at rest under the loads of a configuration; itself where they do not change along the path.

        Parameters
        ----------
        configuration : int
            Number of the configuration, from 0.
        """
        return self._under(self.loads.at(configuration), None) if self.loads.vary else self

    def running_under(self, configuration: int, drives: Floats, placed: Floats) -> Mechanism:
        """The mechanism under the loads of a configuration and, where drives move, its inertia there.

        Parameters
        ----------
        configuration : int
            Number of the configuration, from 0: whose loads act, and whose speeds the drives have.
        drives : ndarray
            Drive values, shape (1, drive).
        placed : ndarray
            Nominal poses there, shape (1, body, pose).
        """
        if self.motion is None:
            return self.at_rest_under(configuration)
        motion = self.motion.at(configuration)
        forces = acting(self, kinematics(self, drives, placed, motion.rates), [configuration])[0]
        loads = [
            LoadSpec({**load, "force": wrench[:3], "moment": wrench[3:]})
            for load, wrench in zip(self.loads.first, forces.tolist(), strict=True)
        ]
        return self._under(loads, motion)

    def _under(self, loads: list[LoadSpec], motion: DriveMotion | None) -> Mechanism:
        """The same mechanism under loads that do not change, moving as it does in one configuration."""
        return self._copied({"loads": loads}, loads=Loads(loads), motion=motion)

    def worn(self, growth: Mapping[int, float]) -> Mechanism:
        """The mechanism with larger clearances; their sizes scatter as before, about a larger play.

        Parameters
        ----------
        growth : mapping
            By how much the radius or the gap of a clearance has grown, SI, by the index of its source.
        """
        sources = list(self.compiled_sources)
        for k, by in growth.items():
            sources[k] = sources[k].with_size(grown(sources[k].size, by))
        return self._resourced(sources)

    def held(self, offsets: Mapping[int, float]) -> Mechanism:
        """The mechanism with some of its backlash taken up: held at an offset.

        Parameters
        ----------
        offsets : mapping
            SI, by the index of the source.
        """
        sources = list(self.compiled_sources)
        for k, offset in offsets.items():
            nothing = dict.fromkeys(sources[k].size, 0.0)
            sources[k] = replace(sources[k].with_size(nothing), centre=(offset,))
        return self._resourced(sources)

    def deviating(self, u: Floats, point: int | None = None) -> Mechanism:
        """The mechanism with other known deviations, and perhaps another output point.

        Parameters
        ----------
        u : ndarray
            Of all parameters, SI.
        point : int, optional
            Its number.
        """
        sources = [
            replace(source, centre=tuple(u[self.parameter_source == k].tolist()))
            for k, source in enumerate(self.compiled_sources)
        ]
        specs = [source.as_spec for source in sources]
        copy = self._copied({"sources": specs}, compiled_sources=tuple(sources), centre=u)
        if point is not None:
            vars(copy)["core_spec"] = MappingProxyType({**copy.core_spec, "output": {"point": point}})
        return copy

    def _resourced(self, sources: Sequence[CompiledSource]) -> Mechanism:
        """The same mechanism with other sets of its sources."""
        specs = [source.as_spec for source in sources]
        return self._copied({"sources": specs}, compiled_sources=tuple(sources))

    def _copied(self, in_core: Changes, **own: object) -> Mechanism:
        """A copy with other parts in the core, and with what is kept here of them."""
        copy = object.__new__(Mechanism)
        kept = {name: value for name, value in vars(self).items() if name != "core"}
        spec = MappingProxyType({**self.core_spec, **in_core})
        vars(copy).update(kept, core_spec=spec, _parts={}, **own)
        return copy

    def varied(self, **changes: Unpack[Changes]) -> _core.Mechanism:
        """The mechanism in the compiled core with other parts.

        Parameters
        ----------
        **changes : Changes
            What takes the place of parts of the specification.
        """
        return in_core(cast("Spec", {**self.core_spec, **changes}))

    def watching(self, point: int, **changes: Unpack[Changes]) -> _core.Mechanism:
        """The mechanism in the core with another output point.

        Parameters
        ----------
        point : int
            Its number.
        **changes : Changes
            As for `varied`.
        """
        return in_core(cast("Spec", {**self.core_spec, **changes, "output": {"point": point}}))

    def moved(self, places: Mapping[int, Floats]) -> list[PointSpec]:
        """The points for `varied`, some of them at other places on their bodies.

        Parameters
        ----------
        places : mapping
            Places by the number of the point, SI, body axes.
        """
        ats = {k: point.at for k, point in enumerate(self.points)} | {k: at.tolist() for k, at in places.items()}
        return [{"body": point.body, "at": [*ats[k]]} for k, point in enumerate(self.points)]

    def spec(self) -> Spec:
        """The mechanism as the core reads it: SI units, radians, points and bodies by index. A copy."""
        return cast("Spec", copy.deepcopy(dict(self.core_spec)))

    @typed
    def value(self, key: str) -> Any:
        """The value at a dotted key of the file, in file units.

        Parameters
        ----------
        key : str
            Such as ``joints.J1.clearance.radial``. With a ``*``, all values that it matches must be equal.

        Raises
        ------
        InputError
            When the file has no such value, or values that differ.
        """
        raw = self.raw
        try:
            found = [value_at(raw, steps) for steps in expand(raw, key, self.file)]
        except (KeyError, TypeError, IndexError):
            raise InputError(_absent(raw, key), file=self.file, key=key) from None
        if any(value != found[0] for value in found):
            raise InputError("the values that it matches differ; name one of them", file=self.file, key=key)
        return copy.deepcopy(found[0])

    @typed
    def with_(self, changes: Mapping[str, object] | None = None, **more: object) -> Mechanism:
        """A changed copy, checked like a file.

        Parameters
        ----------
        changes : mapping, optional
            Values by dotted key, in file units. ``*`` stands for every entry that has the rest of the key, be it in
            other words (``joints.*.clearance.radial`` replaces ``diametral``, too), a number for an entry of a list
            (``loads.0.force``). None removes a value. What a ``*`` reached is not part of the copy: the command line
            prints it, and the attribute `reached` of a `sweep` has it.
        **more : object
            The same for keys without dots, such as ``gravity=[0, -9.81]``.

        Raises
        ------
        InputError
            When a key or a value is not valid, or a wildcard matches nothing.

        Examples
        --------
        >>> from jointplay import examples
        >>> m = loads(examples.text("four-bar"))
        >>> m.with_({"joints.*.clearance.radial": 0.2}).value("joints.J3.clearance.radial")
        0.2
        """
        return changed(self, {**(changes or {}), **more})[0]

    @typed
    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the mechanism as a file, as a whole or not at all.

        What has not changed since the file was read stays as it was typed, with comments and order. A changed value
        stands in the place of the old one, also of an expression; one that is repeated stands in its pattern. What the
        file takes from others (``include``, tables of values) stays there as long as it is found from the new
        place and has not changed; else it is written out, so that the file is complete by itself. Of what `only` has
        chosen the whole file is written.

        Parameters
        ----------
        path : path-like
            A file, which is replaced if it is there.

        Raises
        ------
        InputError
            When it cannot be written, or is a part that the file itself includes.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> from jointplay import examples
        >>> better = loads(examples.text("four-bar")).with_({"joints.J3.clearance.radial": 0.2})
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder, "better.toml")
        ...     better.write(path)
        ...     load(path) == better
        True
        """
        place = Path(path)
        beside = place.name in self._source.parts if self._source else False
        if beside and os.path.realpath(place.parent) == os.path.realpath(Path(self.file).parent):
            raise InputError(f"is a part of {self.file}; name another file", file=os.fspath(path))
        files.put(self.text(path).encode(), place)

    def text(self, path: str | os.PathLike[str]) -> str:
        """What `write` writes.

        Parameters
        ----------
        path : path-like
            Where it would stand: what the file takes from others is looked for there.
        """
        place = os.fspath(path)
        return next(text for text in document.texts(self._source, self.raw) if self._is(text, place))

    @property
    def written(self) -> str:
        """The text as it was typed, where it was read from one."""
        return self._source.text if self._source is not None else ""

    @cached_property
    def complete_text(self) -> str:
        """The text of a file that has all of the mechanism in it: changes, parts and tables of other files."""
        outputs, load_cases = tuple(self._whole.outputs), tuple(self._whole.load_cases)
        whole = self._part((next(iter(outputs), ""), ""), outputs, load_cases)
        if whole is not self:
            return whole.complete_text
        source = self._source
        if source is not None and source.raw == self.raw and toml.parse(source.text) == self.raw:
            return source.text
        return next(text for text in document.texts(source, self.raw, complete=True) if self._is(text, ""))

    @cached_property
    def hash(self) -> str:
        """Eight digits that are the same for files of the same mechanism, by which results and figures name it."""
        content = json.dumps(_canonical(_without_asides(self.raw)), sort_keys=True)
        return hashlib.sha256(content.encode()).hexdigest()[:8]

    def _is(self, text: str, path: str) -> bool:
        """Whether a text at a place is read as this mechanism."""
        try:
            read = read_at(text, path, self.file).only(*self.chosen)
        except InputError:
            return False
        # What is equal may have another order.
        return read == self and all(getattr(read, name) == getattr(self, name) for name in ORDERED)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Mechanism) and self._identity() == other._identity()

    def __hash__(self) -> int:
        return hash(self._identity())

    def _identity(self) -> tuple[object, ...]:
        return (_hashable(self.raw), *self.chosen)

    def __reduce__(self) -> tuple[object, ...]:
        return (_made, (dict(self.raw), self.file, self._source, self.of, bool(self.outputs), bool(self.load_cases)))

    def _repr_html_(self) -> str:
        """What a notebook shows where the mechanism is the value of a cell."""
        return str(importlib.import_module(DISPLAY).html(self))

    def __repr__(self) -> str:
        # Pieces of an elastic body are that body.
        bodies, joints = len(set(self.owners)), len(self.joints) - len(self.members)
        drives = len(self.drives)
        values = self.drive_values if self.drive_values is not None else self.targets
        count = 0 if values is None else len(values)
        what = self.title or self.file
        return (
            f"<jointplay.Mechanism {what!r}: {bodies} bodies, {joints} joints, {drives} drive{'s' * (drives != 1)}, "
            f"{len(self.sources)} sources, {count} configuration{'s' * (count != 1)}>"
        )


def changed(m: Mechanism, changes: Mapping[str, object]) -> tuple[Mechanism, list[str]]:
    """The copy that `Mechanism.with_` gives, and of every key with a ``*`` what it reached.

    Examples
    --------
    >>> from jointplay import examples
    >>> m = loads(examples.text("four-bar"))
    >>> changed(m, {"joints.*.clearance.radial": 0.2})[1]
    ['joints.*.clearance.radial: 4 of 4 joints']
    """
    raw, reached = _changed(m, changes)
    return _mechanism(raw, m.file, m._source).only(*m.chosen), reached


def _changed(m: Mechanism, changes: Mapping[str, object]) -> tuple[dict[str, Any], list[str]]:
    """The tables of a file with changes, and of every key with a ``*`` what it reached."""
    raw = copy.deepcopy(dict(m.raw))
    for key, value in changes.items():
        toml.check_plain(value, file=m.file, key=key)
    return raw, change(raw, {key: plain(value) for key, value in changes.items()}, m.file)


def looked_at(m: Mechanism, changes: Mapping[str, object]) -> Mechanism:
    """A changed copy for one look of a search: of one output in one load case the others of the file are not made."""
    if m.outputs or m.load_cases:
        return changed(m, changes)[0]
    found = object.__new__(Mechanism)
    found._of(_changed(m, changes)[0], m.file, m._source, m.of)
    return found


@typed
def load(path: str | os.PathLike[str]) -> Mechanism:
    """Read a mechanism file.

    Parameters
    ----------
    path : path-like
        A TOML file, see the manual for its keys; or a result in a file, which carries the mechanism that it is of.

    Raises
    ------
    InputError
        When it cannot be read or is not a valid mechanism; the message names file, key, value and what would be valid.
    """
    if carried.is_result(path):
        return loads(carried.text(path), os.fspath(path))
    suffix = Path(path).suffix.lower()
    if (linked := is_link(os.fspath(path))) or suffix in EXTENSIONS:
        what = "is a link" if linked else f"'{suffix}' is a format"
        problem = f"{what} of other programs; jointplay.read(path) or `jointplay import FILE` reads it"
        raise InputError(problem, file=os.fspath(path))
    name, content = toml.read(path)
    return read_at(content, os.fspath(path), name)


def read_at(content: str, path: str, name: str) -> Mechanism:
    """The mechanism of a text that stands at a path, where its parts are looked for, and has this name in messages."""
    raw = _tables(content, name)
    if "include" not in raw:
        raw = _filled_in(raw, path, name)
        return _mechanism(raw, name, Source(content, raw))
    joined = toml.joined(raw, path, name)
    try:
        raw = _filled_in(joined.tables, path, name)
        return _mechanism(raw, name, Source(content, raw, joined.texts))
    except InputError as error:
        raise joined.in_its_part(error) from None


def _filled_in(raw: dict[str, Any], path: str, name: str) -> dict[str, Any]:
    """With the values of the tables that a file names, in place of their names."""
    return motion.filled_in(measured.filled_in(raw, path, name), path, name)


def _mechanism(raw: Mapping[str, Any], file: str, source: Source | None) -> Mechanism:
    m = object.__new__(Mechanism)
    m._of(raw, file, source)
    return m


@typed
def loads(text: str, name: str = "<text>") -> Mechanism:
    """Read a mechanism from the text of its file.

    Parameters
    ----------
    text : str
        TOML.
    name : str
        Its name in messages.

    Raises
    ------
    InputError
        As for `load`.
    """
    raw = _tables(text, name)
    return _mechanism(raw, name, Source(text, raw))


def _tables(text: str, name: str) -> dict[str, Any]:
    if not text.strip():
        raise InputError("is empty; `jointplay new` lists mechanisms to start from", file=name)
    return toml.parse(text, file=name)


def plain(value: object) -> Any:
    """A copy of a value as TOML would give it: arrays, also of pandas and xarray, tuples and mappings become plain."""
    if hasattr(value, "__array__"):
        return np.asarray(value).tolist()
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items() if v is not None}
    if isinstance(value, list | tuple | range):
        return [plain(v) for v in value]
    if isinstance(value, Iterable) and not isinstance(value, str | bytes):
        # A set has no order, and a generator can be read once: as texts they are refused where they stand.
        return str(value)
    return value


def _hashable(value: object) -> object:
    """Values that are equal where those of files are: 1 and 1.0, tables whatever their order."""
    if isinstance(value, Mapping):
        return frozenset((key, _hashable(one)) for key, one in value.items())
    return tuple(map(_hashable, value)) if isinstance(value, list) else value


def _without_asides(tables: Mapping[str, Any]) -> dict[str, Any]:
    """What of the tables of a file, or of a pattern in it, is of the mechanism."""
    found = {key: value for key, value in tables.items() if key not in ASIDE}
    if "patterns" in found:
        found["patterns"] = {name: _without_asides(table) for name, table in found["patterns"].items()}
    if any(DRAWN in body for body in found.get("bodies", {}).values()):
        bare = {name: {k: v for k, v in body.items() if k != DRAWN} for name, body in found.pop("bodies").items()}
        # A body that has nothing else is as well without a table.
        if bodies := {name: body for name, body in bare.items() if body}:
            found["bodies"] = bodies
    return found


def _canonical(value: object) -> object:
    """Values as numbers without kinds: what is equal is written alike."""
    if isinstance(value, Mapping):
        return {key: _canonical(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_canonical(one) for one in value]
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


def _made(
    raw: Mapping[str, Any], file: str, source: Source | None, of: tuple[str, str], outputs: bool, load_cases: bool
) -> Mechanism:
    whole = _mechanism(raw, file, source)
    return whole._part(of, whole.outputs if outputs else (), whole.load_cases if load_cases else ())


def _absent(raw: Mapping[str, Any], key: str) -> str:
    here: Any = raw
    above: list[str] = []
    for part in key.split("."):
        if isinstance(here, Mapping) and part in here:
            here = here[part]
        elif isinstance(here, list) and part.isdigit():
            here = here[int(part)]
        else:
            break
        above.append(part)
    where = f" in {'.'.join(above)}" if above else ""
    known = [str(k) for k in here] if isinstance(here, Mapping) else []
    return not_known(key.split(".")[len(above)], f"given{where}", known)
