"""What the server keeps for a page: the mechanism it has opened, and what has been found of it.

A question comes with all that it depends on: values of the sliders, drive values, output, load case. What is kept
besides only saves work, so that pages cannot disturb each other, and a lost answer is asked for again.
"""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from jointplay.analyses.nominal import Nominal, at_drives, bounded, nominal
from jointplay.basics.arrays import Floats
from jointplay.core.compile import ANGULAR
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism

from .knobs import Knob, knobs

#: mechanisms of which a page's answers are kept
KEPT = 4
#: the largest number that a page sends
FARTHEST = 1e12
#: turns, or widths of its range, that a drive may be beyond its values in the file: all of the way there is traced
TURNS = 10
T = TypeVar("T")


class Cancelled(Exception):
    """The page has asked something newer."""


@dataclass(frozen=True)
class PageQuestion:
    """What a page asks about."""

    #: number of the position of all sliders; a larger one is newer
    serial: int = 0
    #: values of the sliders that have been moved, by key
    values: Mapping[str, float] = field(default_factory=dict)
    #: in units of the file
    drives: tuple[float, ...] = ()
    #: which answer is drawn
    question: str = "worst"
    #: `output`, `load_case`: chosen ones, where there are several
    output: str | None = None
    load_case: str | None = None
    #: offsets for `given`, by parameter, in units of the file
    offsets: Mapping[str, float] = field(default_factory=dict)

    @staticmethod
    def of(told: Mapping[str, Any]) -> PageQuestion:
        """From what a page sends.

        Raises
        ------
        InputError
            When it is something else than a page of ours sends.
        """
        try:
            return PageQuestion(
                int(told.get("serial", 0)),
                {str(key): float(value) for key, value in dict(told.get("values", {})).items()},
                tuple(float(value) for value in told.get("drives", ())),
                str(told.get("question", "worst")),
                str(told["output"]) if told.get("output") else None,
                str(told["load_case"]) if told.get("load_case") else None,
                {str(key): float(value) for key, value in dict(told.get("offsets", {})).items()},
            )
        except (TypeError, ValueError, OverflowError):
            raise InputError("this is not what the page asks") from None


class Session:
    """The mechanism of a page.

    Parameters
    ----------
    m : Mechanism
        As it was opened.

    Raises
    ------
    InputError
        When it has too few or too many drives, or no configurations.
    """

    def __init__(self, m: Mechanism) -> None:
        self.m = m
        self.path = nominal(m.first)
        self.knobs: dict[str, Knob] = {knob.key: knob for knob in knobs(m)}
        self._lock = threading.Lock()
        self._newest = 0
        self._kept: OrderedDict[object, Any] = OrderedDict()

    def begin(self, asked: PageQuestion) -> Callable[[int, int], None]:
        """Note a question; gives what its work calls between its steps.

        Raises
        ------
        Cancelled
            When something newer has been asked.
        """
        with self._lock:
            self._newest = max(self._newest, asked.serial)

        def check(_done: int = 0, _of: int = 0) -> None:
            if asked.serial < self._newest:
                raise Cancelled

        check()
        return check

    def changed(self, values: Mapping[str, float]) -> Mechanism:
        """The mechanism with sliders at some values.

        Raises
        ------
        InputError
            When a value is not possible.
        """
        changes: dict[str, object] = {}
        for key, value in values.items():
            if key not in self.knobs:
                raise InputError("there is no slider for this", key=key)
            # What a slider says that is back in its place is in the file already, in words of its own.
            if value != self.knobs[key].value:
                changes |= self.knobs[key].changes(value)
        return self.m.with_(changes) if changes else self.m

    def mechanism(self, asked: PageQuestion) -> Mechanism:
        """The mechanism that is asked about: with one output, in one load case."""
        key = (tuple(sorted(asked.values.items())), asked.output, asked.load_case)
        return self.kept(("mechanism", key), lambda: self._chosen(asked))

    def _chosen(self, asked: PageQuestion) -> Mechanism:
        m = self.changed(asked.values)
        output = asked.output or next(iter(m.outputs), None)
        return m.only(output, asked.load_case or next(iter(m.load_cases), None))

    def along(self, m: Mechanism) -> Nominal:
        """The configurations of the file. Sizes and loads, which sliders change, do not move the nominal mechanism."""
        return self.path if m.of == self.m.first.of else self.kept(("path", m.of), lambda: nominal(m))

    def kept(self, key: object, make: Callable[[], T]) -> T:
        """What is known by a key, or is made now."""
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]  # type: ignore[no-any-return]
        made = make()
        with self._lock:
            self._kept[key] = made
            while len(self._kept) > KEPT * 3:
                self._kept.popitem(last=False)
        return made


def placed(m: Mechanism, path: Nominal, drives: tuple[float, ...]) -> tuple[Nominal, int]:
    """The mechanism at drive values, followed from the nearest configuration of its path; and which one that is.

    Raises
    ------
    InputError
        When there are not as many values as drives, or one is too far from those of the file.
    """
    if len(drives) != len(m.drives):
        raise InputError(f"needs {len(m.drives)} values, not {len(drives)}", key="drives")
    for k, value in enumerate(drives):
        low, high = _reach(m, path, k)
        # What is not a number is refused as well.
        if not low <= value <= high:
            raise InputError(f"{m.drives[k]} is from {low:.6g} to {high:.6g} here, not {value:g}", key="drives")
    known = np.flatnonzero(np.isfinite(path.poses).all(axis=(1, 2)))
    if not len(m.drives):
        return path.first(1), 0
    wanted = np.array([drives]) * m.drive_factors
    if not len(known):
        return bounded(m, at_drives(m, wanted)), 0
    spread = np.ptp(path.drives[known], axis=0)
    scale = np.where(spread > 0.0, spread, 1.0)
    nearest = int(known[np.linalg.norm((path.drives[known] - wanted) / scale, axis=1).argmin()])
    if np.allclose(path.drives[nearest], wanted, rtol=0.0, atol=1e-12 * np.abs(scale)):
        return path.at(nearest), nearest
    return bounded(m, _traced(m, path.drives[nearest], path.poses[nearest], wanted)), nearest


def _reach(m: Mechanism, path: Nominal, k: int) -> tuple[float, float]:
    """The least and the largest value that a drive may be asked for, in units of the file."""
    known = np.append(path.drives[:, k], m.start_drives[k])
    low, high = np.nanmin(known), np.nanmax(known)
    turns = m.joint_kinds[m.drive_joints[k]] in ANGULAR
    beyond = TURNS * (2.0 * math.pi if turns else max(high - low, m.length))
    factor = m.drive_factors[k]
    return float((low - beyond) / factor), float((high + beyond) / factor)


def _traced(m: Mechanism, start: Floats, poses: Floats, drives: Floats) -> Nominal:
    """The mechanism at drive values that are reached from a configuration."""
    rows = np.concatenate([start[None], drives])
    found = m.core.trace(rows, np.ascontiguousarray(poses))
    return Nominal(drives, found["poses"][1:], found["output"][1:], found["status"][1:])
