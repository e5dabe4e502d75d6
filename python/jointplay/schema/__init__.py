"""The mechanism file of format 1: its shape, its JSON Schema, and messages for what does not fit.

Only what a table shows by itself is checked here; names that must exist elsewhere in the file are checked where the
mechanism is compiled.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError
from pydantic.json_schema import models_json_schema

from jointplay.errors import InputError, shown, suggestion
from jointplay.units import ANGLES

from .bodies import Body, BodyTable, SpatialBody
from .clearances import (
    BallClearance,
    BeltClearance,
    FlankClearance,
    GuideClearance,
    JournalClearance,
    LockedAngle,
    PlateClearance,
    PrismaticClearance,
    RadialClearance,
    RevoluteClearance,
    SleeveClearance,
    SlotClearance,
)
from .couplings import BeltKeys, Coupling, GearKeys, Mesh, Screw
from .expressions import LONGEST, NotAnExpression, Variables, is_variable, resolved
from .file import Dimension, Drive, LoadTable, MechanismFile, OutputTable, PlanarFile
from .grid import GridRange
from .joints import JointTable
from .kinds import with_coordinate
from .messages import located
from .placements import Place, PlacementTable, SpatialPlacementTable
from .places import along_the_path
from .spatial_file import SpatialFile, SpatialStart
from .spatial_joints import SpatialJoint, Universal
from .springs import SpringTable
from .stiffness import Stiffness
from .values import NAME, ToleranceLaw, ToleranceTable, is_number

__all__ = [
    "NAME",
    "BallClearance",
    "BeltClearance",
    "BeltKeys",
    "Body",
    "BodyTable",
    "Coupling",
    "Dimension",
    "Drive",
    "FlankClearance",
    "GearKeys",
    "GridRange",
    "GuideClearance",
    "JointTable",
    "JournalClearance",
    "LoadTable",
    "LockedAngle",
    "MechanismFile",
    "Mesh",
    "OutputTable",
    "Place",
    "PlacementTable",
    "PlanarFile",
    "PlateClearance",
    "PrismaticClearance",
    "RadialClearance",
    "RevoluteClearance",
    "Screw",
    "SleeveClearance",
    "SlotClearance",
    "SpatialBody",
    "SpatialFile",
    "SpatialJoint",
    "SpatialPlacementTable",
    "SpatialStart",
    "SpringTable",
    "Stiffness",
    "ToleranceLaw",
    "ToleranceTable",
    "Universal",
    "along_the_path",
    "json_schema",
    "validate",
    "with_coordinate",
]

#: the two kinds of file, by the value of `space`; without one a mechanism is planar
FILES: dict[str, type[MechanismFile]] = {"planar": PlanarFile, "spatial": SpatialFile}

#: what a JSON Schema says about a value without restricting it
ABOUT = ("description", "default", "title", "examples")
#: any text but a number
PLAIN_NUMBER = (
    r"^(?!\s*[+-]?(\d[\d_]*\.?[\d_]*|\.\d+)([eE][+-]?\d+)?\s*$)"
    r"(?!\s*[+-]?([nN][aA][nN]|[iI][nN][fF]([iI][nN][iI][tT][yY])?)\s*$).*\S"
)
EXPRESSION = {
    "Expression": {
        "type": "string",
        "description": "an expression in variables, such as 2 * a + 10",
        "pattern": PLAIN_NUMBER,
        "maxLength": LONGEST,
    }
}

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
    space = raw.get("space", "planar")
    if not isinstance(space, str) or space not in FILES:
        problem = f"{shown(space)} is not valid here; {suggestion(str(space), FILES)}"
        raise InputError(problem, file=file, key="space")
    variables = _variables(raw, file)
    try:
        return resolved(raw, variables, FILES[space].model_validate, file)
    except ValidationError as error:
        key, problem = located(error, raw)
        raise InputError(problem, file=file, key=key) from None


def _variables(raw: Mapping[str, Any], file: str) -> Variables:
    """The variables of a file; what is no table of numbers and texts is left for the model to refuse."""
    given, units = raw.get("variables"), raw.get("units")
    angle = units.get("angle", "deg") if isinstance(units, Mapping) else "deg"
    is_value = lambda value: isinstance(value, str) or is_number(value)  # noqa: E731
    if not (isinstance(given, Mapping) and all(map(is_variable, given)) and all(map(is_value, given.values()))):
        given = {}
    try:
        return Variables(given, ANGLES.get(angle, 1.0) if isinstance(angle, str) else 1.0)
    except NotAnExpression as problem:
        raise InputError(str(problem), file=file, key=f"variables.{problem.name}") from None


def json_schema() -> dict[str, Any]:
    """The JSON Schema of the mechanism file, with which editors complete and check it.

    Examples
    --------
    >>> [entry["$ref"] for entry in json_schema()["oneOf"]]
    ['#/$defs/PlanarFile', '#/$defs/SpatialFile']
    """
    models = [(model, "validation") for model in FILES.values()]
    _, definitions = models_json_schema(models, by_alias=True)  # type: ignore[arg-type]
    files = [{"$ref": f"#/$defs/{model.__name__}"} for model in FILES.values()]
    definitions = _tidy(definitions)
    definitions["$defs"] = {name: _with_expressions(node) for name, node in definitions["$defs"].items()} | EXPRESSION
    schema = {"title": "jointplay mechanism, format 1", "type": "object", "oneOf": files, **definitions}
    return {"$schema": DIALECT, **schema}


def _with_expressions(node: Any) -> Any:
    """An expression stands wherever a number may, whole numbers apart."""
    if isinstance(node, list):
        return [_with_expressions(v) for v in node]
    if not isinstance(node, dict):
        return node
    if node.get("type") != "number":
        return {k: _with_expressions(v) for k, v in node.items()}
    number = {k: v for k, v in node.items() if k not in ABOUT}
    about = {k: v for k, v in node.items() if k in ABOUT}
    return {"anyOf": [number, {"$ref": "#/$defs/Expression"}], **about}


def _tidy(node: Any) -> Any:
    """TOML has no null, so a default of null only says that a key may be left out; names are as their pattern says."""
    if isinstance(node, dict):
        if "patternProperties" in node:
            node = {**node, "additionalProperties": False}
        return {k: _tidy(v) for k, v in node.items() if not (k == "default" and v is None)}
    if isinstance(node, list):
        return [_tidy(v) for v in node]
    return node
