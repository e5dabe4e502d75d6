"""What a result is of: the mechanism with all changes, the options of the question, and the day.

A result that is saved can be asked again, and whoever reads it knows what it speaks of: `jointplay.load` of its file
gives the mechanism back.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from jointplay.file.carried import LETTERS, TEXT
from jointplay.model.mechanism import Mechanism, plain

from .structure import Attribute, Result

if TYPE_CHECKING:
    import xarray as xr


#: bits of a whole number that is written in decimal digits
LONG = 64


def today() -> str:
    """The date in UTC, or that of SOURCE_DATE_EPOCH, by which programs that pack files make them reproducible."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    moment = datetime.fromtimestamp(int(epoch), UTC) if epoch.isdigit() else datetime.now(UTC)
    return moment.date().isoformat()


@dataclass(frozen=True)
class Origin:
    """What a result was computed of."""

    #: one, or those that were compared
    mechanisms: tuple[Mechanism, ...]
    #: of the question, by name, also those that were left out
    options: Mapping[str, Any]
    #: the date
    created: str = field(default_factory=today)

    def attributes(self) -> dict[str, str]:
        """The same as attributes of a dataset or a file."""
        found: dict[str, str] = {}
        for m, suffix in zip(self.mechanisms, LETTERS if len(self.mechanisms) > 1 else ("",), strict=False):
            found |= {f"{TEXT}{suffix}": m.complete_text, f"{TEXT}_hash{suffix}": m.hash}
        known = {name: _numbers(value) for name, value in self.options.items()}
        options = json.dumps(plain(known), ensure_ascii=False, default=str)
        return {**found, "options": options, "created": self.created}


def _numbers(value: Any) -> Any:
    """An option as it is; of the result of `loaded`, which may be handed on, its offsets; in hex what is very long."""
    if isinstance(value, int) and value.bit_length() > LONG:
        return hex(value)
    return value["offset"] if hasattr(value, "data_vars") else value


def attributes(result: Result) -> dict[str, Attribute]:
    """All attributes of a result, with what it is of."""
    return {**result.attrs, **(result.origin.attributes() if result.origin is not None else {})}


def label(result: Result | xr.Dataset) -> str:
    """``mechanism 3f2a9c1b``, or all that were compared; nothing where it is not known."""
    if isinstance(result, Result) and result.origin is not None:
        hashes = [m.hash for m in result.origin.mechanisms]
    else:
        names = [f"{TEXT}_hash{suffix}" for suffix in ("", *LETTERS)]
        hashes = [str(result.attrs[name]) for name in names if name in result.attrs]
    return f"mechanism {' | '.join(hashes)}" if hashes else ""
