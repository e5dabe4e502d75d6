"""The one mechanism type: read from a file, checked, immutable. Analyses are functions of it."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Mapping
from dataclasses import fields
from functools import cached_property
from typing import Any, cast

import numpy as np

from jointplay import _core, toml
from jointplay.compile import Compiled, compile_file
from jointplay.errors import InputError, not_known
from jointplay.schema import validate
from jointplay.schema.keys import change, expand, value_at
from jointplay.spec import Spec
from jointplay.typed import typed


def in_core(spec: Spec) -> _core.Mechanism:
    """A mechanism in the compiled core.

    Raises
    ------
    ValueError
        When the core refuses it.
    """
    return _core.Mechanism(json.dumps(dict(spec), allow_nan=False))


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

    Raises
    ------
    InputError
        When the data is not a valid mechanism.
    """

    raw: Mapping[str, Any]

    @typed
    def __init__(self, raw: Mapping[str, Any], file: str = "<data>") -> None:
        toml.check_depth(raw, file=file)
        plain: dict[str, Any] = _plain(raw)
        compiled = compile_file(validate(plain, file), file)
        # The class is frozen; this is where it is made.
        vars(self).update({f.name: getattr(compiled, f.name) for f in fields(compiled)}, raw=plain)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a mechanism is immutable; with_() gives a copy with another {name}")

    @property
    def title(self) -> str:
        """The file's title."""
        return self.data.title

    @cached_property
    def core(self) -> _core.Mechanism:
        """The mechanism in the compiled core, made when first needed."""
        try:
            return in_core(self.core_spec)
        except ValueError as error:
            raise InputError(str(error), file=self.file) from error

    def core_at(self, configuration: int) -> _core.Mechanism:
        """The mechanism in the compiled core under the loads of a configuration, where these change along the path.

        Parameters
        ----------
        configuration : int
            Number of the configuration, from 0.
        """
        if not self.loads.along or configuration == 0:
            return self.core
        return in_core({**self.core_spec, "loads": self.loads.at(configuration)})

    def under_loads_of(self, configuration: int) -> Mechanism:
        """A copy on which the loads of a configuration act in all of them; itself where they do not change.

        Parameters
        ----------
        configuration : int
            Number of the configuration, from 0.
        """
        loads = self.raw.get("loads", ())
        steady = {f"loads.{k}.{name}": loads[k][name][configuration] for k, name in self.loads.changing}
        return self.with_(steady) if steady else self

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
            (``loads.0.force``). None removes a value.
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

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Mechanism) and _canonical(self.raw) == _canonical(other.raw)

    def __hash__(self) -> int:
        return hash(_canonical(self.raw))

    def __reduce__(self) -> tuple[object, ...]:
        return (Mechanism, (dict(self.raw), self.file))

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
    raw = copy.deepcopy(dict(m.raw))
    for key, value in changes.items():
        toml.check_depth(value, file=m.file, key=key)
    reached = change(raw, {key: _plain(value) for key, value in changes.items()}, m.file)
    return Mechanism(raw, m.file), reached


@typed
def load(path: str | os.PathLike[str]) -> Mechanism:
    """Read a mechanism file.

    Parameters
    ----------
    path : path-like
        A TOML file, see the manual for its keys.

    Raises
    ------
    InputError
        When it cannot be read or is not a valid mechanism; the message names file, key, value and what would be valid.
    """
    name, content = toml.read(path)
    raw = _tables(content, name)
    return Mechanism(toml.joined(raw, os.fspath(path), name) if "include" in raw else raw, name)


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
    return Mechanism(_tables(text, name), name)


def _tables(text: str, name: str) -> dict[str, Any]:
    if not text.strip():
        raise InputError("is empty; `jointplay new` lists mechanisms to start from", file=name)
    return toml.parse(text, file=name)


def _plain(value: object) -> Any:
    """A copy of a value as TOML would give it: numpy arrays and scalars, tuples and mappings become plain ones."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items() if v is not None}
    if isinstance(value, list | tuple | range):
        return [_plain(v) for v in value]
    return value


def _canonical(raw: Mapping[str, Any]) -> str:
    return json.dumps(raw, sort_keys=True, default=str)


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
