"""Paths, drive values and tables of followers from columns of a table in the folder of the mechanism.

A column may say its unit behind its name, ``x [mm]``; without one its numbers are in the unit of the file.
"""

from collections.abc import Mapping, Sequence
from typing import Any, TypeGuard

from jointplay.basics import units
from jointplay.core.compile.drives import COMPONENTS, LENGTHS
from jointplay.errors import InputError, listed, not_known, shown
from jointplay.file.columns import Columns, Tables, split
from jointplay.file.schema import space_of, with_coordinate

#: what says where values are from, and what says them
REFERENCE, VALUES = ("csv", "column", "time"), ("values", "times", "from", "to", "count")
#: seconds per unit of a column of times
TIMES = {"s": 1.0, "ms": 1e-3}


def filled_in(raw: dict[str, Any], path: str, file: str) -> dict[str, Any]:
    """The tables of a file with the values of the tables that its path and its drives name.

    Parameters
    ----------
    raw : dict
        The tables as they were read. What changes is copied.
    path : str
        The file: the tables are in the same folder.
    file : str
        Its name in messages.

    Raises
    ------
    InputError
        When a file or a column is not there, a value is no number, or a unit is not that of the column.
    """
    reader = _PathReader(raw, path, file)
    found = dict(raw)
    targets = raw.get("path")
    components = COMPONENTS[space_of(raw, file)]
    # What gives values as well is refused where the table is checked.
    if _refers(targets) and not set(targets) & set(components):
        found["path"] = reader.targets(targets, components)
    return reader.with_motions(found, raw.get("joints"), ())


def _refers(table: object) -> TypeGuard[Mapping[str, Any]]:
    return isinstance(table, Mapping) and "csv" in table


class _PathReader:
    def __init__(self, raw: Mapping[str, Any], path: str, file: str) -> None:
        self.tables = Tables(path, file)
        own = raw.get("units")
        self.units = own if isinstance(own, Mapping) else {}

    def targets(self, table: Mapping[str, Any], components: Sequence[str]) -> dict[str, Any]:
        """The path with its values."""
        columns = self.tables.beside(table["csv"], "path.csv")
        names = {split(word)[0]: word for word in columns.header}
        asked = [component for component in components if component in names]
        if not asked:
            problem = f"the first row has none of {listed(components)}, but {listed(columns.header)}"
            raise InputError(problem, file=columns.name, key="path.csv")
        rest = {key: value for key, value in table.items() if key != "csv"}
        return rest | {name: self._values(columns, names[name], name in LENGTHS, "path.csv") for name in asked}

    def with_motions(self, tables: dict[str, Any], outside: Any, above: tuple[str, ...]) -> dict[str, Any]:
        """Tables, of the file or of a pattern, with the values of their drives and followers."""
        joints = {**_table(outside), **_table(tables.get("joints"))}
        made: dict[str, Any] = {}
        for section, read in (("drives", self._drive), ("followers", self._follower)):
            entries = tables.get(section)
            if isinstance(entries, Mapping):
                keys = {name: ".".join((*above, section, str(name))) for name in entries}
                made[section] = {name: read(name, entry, joints, keys[name]) for name, entry in entries.items()}
        patterns = tables.get("patterns")
        if isinstance(patterns, Mapping) and not above:
            made["patterns"] = {
                name: self.with_motions(dict(part), joints, ("patterns", str(name)))
                if isinstance(part, Mapping)
                else part
                for name, part in patterns.items()
            }
        return tables | made

    def _follower(self, _: str, follower: Any, joints: Any, key: str) -> Any:
        names = follower.get("columns") if _refers(follower) else None
        if not isinstance(names, list) or len(names) != 2 or set(follower) & {"at", "values", "polynomial"}:
            return follower
        columns = self.tables.beside(follower["csv"], f"{key}.csv")
        words = {split(word)[0]: word for word in columns.header}
        found = {}
        for place, (name, given, joint) in enumerate(zip(names, ("at", "values"), ("follows", "joint"), strict=True)):
            word = name if name in columns.header else words.get(name)
            if word is None:
                problem = not_known(str(name), "a column of its first row", columns.header)
                raise InputError(problem, file=columns.name, key=f"{key}.columns.{place}")
            is_length = _kind(joints, follower.get(joint)) not in with_coordinate("angle")
            found[given] = self._values(columns, word, is_length, f"{key}.columns.{place}")
        return {k: v for k, v in follower.items() if k not in ("csv", "columns")} | found

    def _drive(self, name: str, drive: Any, joints: Any, key: str) -> Any:
        if not _refers(drive) or set(drive) & set(VALUES):
            return drive
        columns = self.tables.beside(drive["csv"], f"{key}.csv")
        wanted = drive.get("column", name)
        words = {split(word)[0]: word for word in columns.header}
        word = wanted if wanted in columns.header else words.get(wanted) if isinstance(wanted, str) else None
        if word is None:
            problem = not_known(str(wanted), "a column of its first row", columns.header)
            raise InputError(problem, file=columns.name, key=f"{key}.column")
        moved = drive.get(
            "joint", next(iter(drive["joints"]), None) if isinstance(drive.get("joints"), Mapping) else None
        )
        is_length = _kind(joints, moved) not in with_coordinate("angle")
        values = self._values(columns, word, is_length, f"{key}.column")
        found = {**{k: v for k, v in drive.items() if k not in REFERENCE}, "values": values}
        return found if "time" not in drive else found | {"times": self._times(columns, drive["time"], f"{key}.time")}

    def _times(self, columns: Columns, name: Any, key: str) -> list[float]:
        """A column of times in seconds."""
        words = {split(word)[0]: word for word in columns.header}
        word = name if name in columns.header else words.get(name) if isinstance(name, str) else None
        if word is None:
            problem = not_known(str(name), "a column of its first row", columns.header)
            raise InputError(problem, file=columns.name, key=key)
        unit = split(word)[1] or "s"
        if unit not in TIMES:
            problem = f"the unit of column {shown(word)}: {not_known(unit, 'a unit of time', TIMES)}"
            raise InputError(problem, file=columns.name, key=key)
        return [value * TIMES[unit] for value in columns.numbers(word, key, whole=True)]

    def _values(self, columns: Columns, word: str, is_length: bool, key: str) -> list[float]:
        """A column in the units of the file."""
        values = columns.numbers(word, key, whole=True)
        if not values:
            raise InputError(f"column {shown(word)} has no values", file=columns.name, key=key)
        unit = split(word)[1]
        known = units.LENGTHS if is_length else units.ANGLES
        own = self.units.get("length", "mm") if is_length else self.units.get("angle", "deg")
        if not unit or own not in known:
            return values
        if unit not in known:
            what = "a length" if is_length else "an angle"
            problem = f"the unit of column {shown(word)}: {not_known(unit, f'a unit of {what}', known)}"
            raise InputError(problem, file=columns.name, key=key)
        # The same unit leaves every digit as it is.
        return values if unit == own else [value * known[unit] / known[own] for value in values]


def _kind(joints: Any, name: object) -> Any:
    """The type of a joint of the file by the name of it, or of one of its riders."""
    joint = joints.get(str(name).partition("/")[0]) if isinstance(joints, Mapping) else None
    return joint.get("type") if isinstance(joint, Mapping) else None


def _table(node: Any) -> Mapping[str, Any]:
    return node if isinstance(node, Mapping) else {}
