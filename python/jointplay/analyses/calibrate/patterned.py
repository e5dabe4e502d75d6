"""Changes of single copies of a pattern, as a table of values that differ from copy to copy.

[patterns.leg.values]
Lu_deviation = [0.01, -0.02, 0.004]

[patterns.leg.dimensions.Lu]
deviation = "Lu_deviation"
"""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism
from jointplay.model.patterns import written_out

#: what is the same in both forms of a file, but for rounding
SAME = 1e-9


def in_patterns(m: Mechanism, changes: Mapping[str, object], built: Mechanism) -> Mechanism | None:
    """The mechanism with changes that are those of its patterns written out; None where patterns cannot have them.

    Parameters
    ----------
    m : Mechanism
        With its patterns.
    changes : mapping
        Values by the keys of the file without patterns.
    built : Mechanism
        The changed mechanism without patterns, which it has to be.
    """
    try:
        found = m.with_(_Patterned(m).of(changes))
    except InputError:
        return None
    return found if _is(found, built) else None


def _is(found: Mechanism, built: Mechanism) -> bool:
    """Whether both have the same deviations and scatter."""
    if found.parameters != built.parameters:
        return False
    numbers = ((one.centre, *one.core.parameter_moments()) for one in (found, built))
    pairs = zip(*numbers, strict=True)
    return all(np.allclose(a, b, rtol=SAME, atol=SAME * float(np.abs(b).max(initial=0.0))) for a, b in pairs)


class _Patterned:
    """Gathers what copies have, by the key of their pattern."""

    def __init__(self, m: Mechanism) -> None:
        self.origins = written_out(dict(m.raw), m.file).origins
        self.counts = {name: int(table["count"]) for name, table in m.raw["patterns"].items() if "count" in table}
        self.counts |= {
            name: max(map(len, (v for v in table["values"].values() if isinstance(v, list))), default=1)
            for name, table in m.raw["patterns"].items()
            if "count" not in table and "values" in table
        }
        self.changes: dict[str, object] = {}

    def of(self, changes: Mapping[str, object]) -> dict[str, object]:
        """The same changes by keys of patterns."""
        gathered: dict[str, dict[int, object]] = {}
        for key, value in changes.items():
            parts = tuple(key.split("."))
            for length in range(len(parts), 0, -1):
                if parts[:length] in self.origins:
                    head, number = self.origins[parts[:length]]
                    gathered.setdefault(".".join((head, *parts[length:])), {})[number] = value
                    break
            else:
                self.changes[key] = value
        for key, values in gathered.items():
            pattern = key.split(".")[1]
            every = [values.get(number) for number in range(1, self.counts[pattern] + 1)]
            self.changes[key] = self._told(pattern, key, every)
        return self.changes

    def _told(self, pattern: str, key: str, every: list[Any]) -> Any:
        """What the pattern says where its copies have these values; a name where they differ."""
        first = next((value for value in every if value is not None), None)
        if isinstance(first, Mapping):
            tables = [value or {} for value in every]
            return {word: self._told(pattern, f"{key}.{word}", [table.get(word) for table in tables]) for word in first}
        if isinstance(first, list):
            lists = [value or [0.0] * len(first) for value in every]
            return [self._told(pattern, f"{key}.{k}", [one[k] for one in lists]) for k in range(len(first))]
        if not isinstance(first, float) or all(value == first for value in every):
            return first
        _, _, _, *rest = key.split(".")
        name = re.sub(r"\W", "_", "_".join(rest))
        self.changes[f"patterns.{pattern}.values.{name}"] = [0.0 if value is None else value for value in every]
        return name
