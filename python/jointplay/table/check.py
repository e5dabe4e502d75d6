"""What a mechanism is made of, in tables."""

from __future__ import annotations

from jointplay.compile import LENGTHS
from jointplay.result import Result

from .layout import Column, Table, fixed, words

WORDS = {"pin_in_slot": "pin in slot"}


def overview(result: Result) -> list[Table]:
    """Joints, sources of error, drives, and how it all can move."""
    tables = [_joints(result)]
    if "source" in result.coords:
        tables.append(_sources(result))
    tables.append(_mobility(result))
    return tables


def _joints(result: Result) -> Table:
    names = result.labels("joint")
    driven = result.get("driven_joint").tolist() if "driven_joint" in result.data else []
    drives = dict(zip(driven, result.labels("drive") if driven else [], strict=True))
    columns = [
        words("joint", names),
        words("type", [WORDS.get(kind, kind) for kind in result.get("joint_kind").tolist()]),
        words("carried by", result.get("first_body").tolist()),
        words("rides on it", result.get("second_body").tolist()),
    ]
    if drives:
        columns.append(words("driven by", [drives.get(name, "") for name in names]))
    return Table(f"{len(result.labels('body'))} bodies, {len(names)} joints", tuple(columns))


def _sources(result: Result) -> Table:
    names = result.labels("source")
    sizes = tuple(f"{value:.4g}" for value in result.get("size").tolist())
    units = result.coords["source_unit"].values.tolist()
    columns = (
        words("source", names),
        words("kind", result.coords["source_kind"].values.tolist()),
        Column("up to", "", sizes),
        words("unit", units),
    )
    return Table(f"{len(names)} sources of error", columns)


def _mobility(result: Result) -> Table:
    frame = result.labels("component")
    guess = result.get("guess")
    columns = [words("body", result.labels("body"))]
    for k, name in enumerate(frame):
        places = 3 if name in LENGTHS else 2
        unit = result.unit("guess", component=name)
        columns.append(Column(name, unit, tuple(fixed(float(v), places) for v in guess[:, k])))
    assembled = (
        "It goes together near its start." if result.attrs["assembled"] else "It does not go together near its start."
    )
    words_ = str(result.attrs["mobility"])
    count = int(result.attrs["configurations"])
    notes = (f"{words_[0].upper()}{words_[1:]}.", assembled, f"{count} configuration{'s' * (count != 1)}.")
    return Table("Start, from which it is assembled", tuple(columns), notes)
