"""A mechanism that is being drawn: its text, what it makes so far, and what is missing for an answer."""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from jointplay.analyses.nominal import Nominal
from jointplay.errors import InputError, listed
from jointplay.file import document, toml
from jointplay.file.schema import validate
from jointplay.model.mechanism import Mechanism, read_at
from jointplay.model.mobility import examine
from jointplay.model.patterns import written_out

from .board import GROUND, BodyPoses, Json, bodies_of, free_of, told
from .session import Session

#: where the file of a line is said
LINE = re.compile(r"line (\d+)")
#: what stands for the joints of a text that has none
STUB = {"type": "fixed", "bodies": [GROUND, "body"]}
#: what an empty drawing begins with
EMPTY = """\
# Drawn on the board of jointplay studio.

format = 1
title  = "drawing"
space  = "planar"
units  = { length = "mm", angle = "deg", force = "N" }
"""


@dataclass(frozen=True)
class Draft:
    """A text on the board."""

    text: str
    #: its tables; empty where it is no TOML
    raw: Mapping[str, Any]
    #: what it makes, with an output of our own where it names none
    m: Mechanism | None = None
    #: what answers questions; None where something is missing
    session: Session | None = None
    #: what is missing for an answer, in ``text``, and in ``do`` what would mend it
    missing: tuple[Json, ...] = ()
    #: what is wrong with the text: ``text``, ``key`` and ``line``
    problem: Json | None = None

    def board(self, before: BodyPoses) -> Json:
        """What a page draws of it, with poses of bodies that are not known otherwise."""
        at = None
        if self.session is not None:
            path = self.session.path
            known = np.flatnonzero(np.isfinite(path.poses).all(axis=(1, 2)))
            at = path.at(int(known[len(known) // 2])) if len(known) else None
        if at is None and self.m is not None:
            m = self.m.first
            guess = m.guess[None]
            rest = np.zeros((1, len(m.drives)))
            at = Nominal(rest, guess, m.core.output(guess), np.zeros(1, dtype=np.uint8))
        board = told(self.raw, None if self.m is None else self.m.first, at, before)
        if not has_output(self.raw):
            drawn = board["scene"]
            board["scene"] = {**drawn, "shapes": [shape for shape in drawn["shapes"] if shape["kind"] != "output"]}
        return {**board, "missing": list(self.missing)}


def read(text: str, name: str, path: str | os.PathLike[str] = "") -> Draft:
    """What a text makes, be it complete or not.

    Parameters
    ----------
    name : str
        Of the file, in messages.
    path : path-like
        Where the file stands: what it includes is beside it.
    """
    raw: Mapping[str, Any] = {}
    try:
        raw = toml.parse(text, file=name)
        if "include" in raw:
            whole = toml.joined(raw, os.fspath(path), name).tables
            raw = {**{key: whole[key] for key in toml.SHARED if key in whole}, **raw}
        return _read(text, raw, name, os.fspath(path))
    except InputError as error:
        return Draft(text, raw, problem=_problem(text, error))


def _problem(text: str, error: InputError) -> Json:
    found = LINE.search(error.problem)
    line = int(found[1]) if found else document.line_of(text, error.key)
    return {"text": str(error), "key": error.key, "line": line}


def _read(text: str, raw: Mapping[str, Any], name: str, path: str) -> Draft:
    if not raw.get("joints") and "patterns" not in raw and "include" not in raw:
        at = [0, 0, 0] if raw.get("space") == "spatial" else [0, 0]
        _checked({**raw, "joints": {"J": {**STUB, "at": at}}}, name)
        first = "join a bar to the ground or to another bar" if free_of(raw) else "draw a bar, or begin with a template"
        return Draft(text, raw, missing=(_says(f"There is no joint yet: {first}."),))
    is_asked = has_output(raw)
    own = raw if "include" in raw else _checked(raw, name)
    whole = raw if is_asked else {**raw, "output": _some_output(own)}
    try:
        loose = _loose(raw)
        if loose:
            return Draft(text, raw, missing=loose)
        m = read_at(text, path, name) if is_asked else Mechanism(whole, name)
    except InputError as error:
        bars = {body: len(_joints_of(raw, body)) for body in free_of(raw)}
        open_ends = [body for body, count in bars.items() if count == 1]
        # Something speaks of a bar that is on no joint.
        alone = [body for body, count in bars.items() if not count and body in error.key.split(".")]
        if not (open_ends or alone):
            raise
        # What is wrong otherwise is said when the bar has its pin.
        validate(written_out(dict(whole), name).data, name)
        if open_ends:
            says = f"One end of {listed(open_ends)} is free: put a pin or the output there."
        else:
            says = f"{listed(alone)} has no joint yet: join it to the rest."
        return Draft(text, raw, missing=(_says(says),))
    missing = [*_motions(m)]
    if not is_asked:
        missing.append(_says("There is no output yet: which point matters?", tool="output"))
    if missing:
        return Draft(text, raw, m, missing=tuple(missing))
    return Draft(text, raw, m, Session(m), tuple(_advice(m)))


def _checked(raw: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """The tables with their patterns written out, when each is what it should be."""
    stands = {} if "output" in raw or "outputs" in raw else {"output": {"body": GROUND}}
    found: Mapping[str, Any] = written_out({**raw, **stands}, name).data
    validate(dict(found), name)
    return found


def _joints_of(raw: Mapping[str, Any], body: str) -> list[str]:
    return [name for name, table in raw.get("joints", {}).items() if body in bodies_of(table)]


def has_output(raw: Mapping[str, Any]) -> bool:
    """Whether a text says which point matters, or a file that it includes may."""
    return bool("output" in raw or raw.get("outputs") or "include" in raw)


def _some_output(raw: Mapping[str, Any]) -> Json:
    """What stands for the output: a body that would hang loose without it, if there is one, at a joint of it."""
    bodies = dict.fromkeys(b for table in raw["joints"].values() for b in bodies_of(table) if b != GROUND)
    body = next((b for b in bodies if len(_joints_of(raw, b)) == 1), next(iter(bodies), GROUND))
    # A joint of two points is none.
    at = [name for name in _joints_of(raw, body) if raw["joints"][name].get("type") not in ("gear", "belt")]
    return {"body": body, **({"at": at[0]} if at else {})}


def _says(text: str, **do: Any) -> Json:
    return {"text": text, "do": do or None}


def _loose(raw: Mapping[str, Any]) -> tuple[Json, ...]:
    """Bodies that no joints connect with the ground."""
    if "patterns" in raw or "include" in raw:
        return ()
    joined = [set(bodies_of(table)) for table in raw["joints"].values() if isinstance(table, Mapping)]
    known = {GROUND}
    while more := [bodies for bodies in joined if bodies & known and not bodies <= known]:
        known = known.union(*more)
    loose = [body for body in dict.fromkeys(b for bodies in joined for b in sorted(bodies)) if body not in known]
    if not loose:
        return ()
    return (_says(f"Nothing holds {listed(loose)} to the ground: put a pin on it.", tool="ground"),)


def _motions(m: Mechanism) -> list[Json]:
    """Free motions, each with a joint that could be driven."""
    found = examine(m.first)
    if not found.motions:
        return []
    told = []
    for motion in found.motions:
        names = [name.split("/")[0] for name in motion.joints]
        # Motors stand on the ground where they can.
        grounded = [name for name in names if name in m.data.joints and GROUND in m.data.joints[name].names]
        joint = (grounded or names or [""])[0]
        count = "One motion" if len(found.motions) == 1 else f"{len(found.motions)} motions"
        verb = "has" if len(found.motions) == 1 else "have"
        told.append(_says(f"{count} {verb} no drive: drive {joint}?", gesture="drive", joint=joint))
    return told[:1]


def _advice(m: Mechanism) -> list[Json]:
    """What an answer would be empty without."""
    found = []
    if not m.sources:
        found.append(_says("There is no clearance and no tolerance yet: nothing is off.", tool="select"))
    is_limited = m.limits.forces or m.data.limits.given()
    if not (is_limited or any(output.limits.given() for output in m.data.outputs.values())):
        found.append(_says("There is no limit yet: what is acceptable?", tool="limits"))
    return found
