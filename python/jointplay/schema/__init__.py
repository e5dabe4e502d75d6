"""The mechanism file of format 1: its shape, its JSON Schema, and messages for what does not fit.

Only what a table can tell by itself is checked here; names that must exist elsewhere in the file are checked where the
mechanism is compiled.
"""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from jointplay.errors import InputError

from .file import Dimension, Drive, Load, MechanismFile, Output
from .grid import GridRange
from .joints import Fixed, Joint, PinInSlot, Prismatic, Revolute
from .messages import located
from .values import NAME, PlacementTable, ToleranceLaw, ToleranceTable

__all__ = [
    "NAME",
    "Dimension",
    "Drive",
    "Fixed",
    "GridRange",
    "Joint",
    "Load",
    "MechanismFile",
    "Output",
    "PinInSlot",
    "PlacementTable",
    "Prismatic",
    "Revolute",
    "ToleranceLaw",
    "ToleranceTable",
    "json_schema",
    "validate",
]

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def validate(raw: dict[str, Any], file: str) -> MechanismFile:
    """Check data of a mechanism file.

    Parameters
    ----------
    raw : dict
        The data as read from TOML.
    file : str
        Name of the file, for messages.

    Returns
    -------
    MechanismFile
        The same data with defaults, frozen.

    Raises
    ------
    InputError
        Naming the first mistake.
    """
    try:
        return MechanismFile.model_validate(raw)
    except ValidationError as error:
        key, problem = located(error, raw)
        raise InputError(problem, file=file, key=key) from None


def json_schema() -> dict[str, Any]:
    """The JSON Schema of the mechanism file, with which editors complete and check it.

    Examples
    --------
    >>> sorted(json_schema()["required"])
    ['format', 'joints', 'output', 'units']
    """
    schema: dict[str, Any] = _tidy(MechanismFile.model_json_schema(by_alias=True, mode="validation"))
    return {"$schema": DIALECT, **schema, "title": "jointplay mechanism, format 1"}


def _tidy(node: Any) -> Any:
    """TOML has no null, so a default of null only says that a key may be left out; names are as their pattern says."""
    if isinstance(node, dict):
        if "patternProperties" in node:
            node = {**node, "additionalProperties": False}
        return {k: _tidy(v) for k, v in node.items() if not (k == "default" and v is None)}
    if isinstance(node, list):
        return [_tidy(v) for v in node]
    return node
