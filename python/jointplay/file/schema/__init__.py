"""The mechanism file of format 1: its shape, its JSON Schema, and messages for what does not fit.

Only what a table shows by itself is checked here; names that must exist elsewhere in the file are checked where the
mechanism is compiled.
"""

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic.json_schema import models_json_schema

from jointplay.errors import InputError, shown, suggestion

from .bodies import BodyTable, PlanarBody, SpatialBody, wrong_with
from .clearances import (
    BallClearance,
    BearingKeys,
    BeltClearance,
    FlankClearance,
    GapClearance,
    GuideClearance,
    JournalClearance,
    LockedAngle,
    PlateClearance,
    PrismaticClearance,
    RadialClearance,
    RevoluteClearance,
    RunOut,
    SizedClearance,
    SleeveClearance,
    SlotClearance,
)
from .costs import Choice, Cost
from .couplings import BeltKeys, Coupling, CrossedGear, GearKeys, Mesh, Screw
from .design import DesignTable, Variation
from .deviations import DH, AxisDeviation, ComponentDeviation, LinkTable, PlanarPosition, SpatialPosition, Zone
from .drives import Backlash
from .expressions import LONGEST, NotAnExpression, Variables
from .file import MechanismFile, PlanarFile, SpatialFile
from .followers import Follower
from .friction import Friction
from .grid import GridRange
from .joints import JointTable
from .kinds import with_coordinate
from .laws import Deviating, LawName, LawTable, ToleranceLaw, law_in_core, limits_of
from .limits import Bounds
from .messages import located
from .pattern_tables import COPY, HEADS, PARTS, PatternHead, PatternTable
from .placements import PlacementKeys, PlacementTable, SpatialPlacementTable
from .places import along_the_path
from .sizes import Machined
from .spatial_joints import SpatialJoint, Universal
from .spatial_tables import SpatialStart
from .springs import SpringTable
from .stiffness import Stiffness
from .tables import Dimension, Drive, LoadTable, OutputTable, variables_of
from .target import TargetDwell, TargetFunction, TargetTable
from .values import NAME, ToleranceTable
from .wear import Wear

__all__ = [
    "COPY",
    "DH",
    "HEADS",
    "NAME",
    "PARTS",
    "AxisDeviation",
    "Backlash",
    "BallClearance",
    "BearingKeys",
    "BeltClearance",
    "BeltKeys",
    "BodyTable",
    "Bounds",
    "Choice",
    "ComponentDeviation",
    "Cost",
    "Coupling",
    "CrossedGear",
    "DesignTable",
    "Deviating",
    "Dimension",
    "Drive",
    "FlankClearance",
    "Follower",
    "Friction",
    "GapClearance",
    "GearKeys",
    "GridRange",
    "GuideClearance",
    "JointTable",
    "JournalClearance",
    "LawName",
    "LawTable",
    "LinkTable",
    "LoadTable",
    "LockedAngle",
    "Machined",
    "MechanismFile",
    "Mesh",
    "NotAnExpression",
    "OutputTable",
    "PatternHead",
    "PatternTable",
    "PlacementKeys",
    "PlacementTable",
    "PlanarBody",
    "PlanarFile",
    "PlanarPosition",
    "PlateClearance",
    "PrismaticClearance",
    "RadialClearance",
    "RevoluteClearance",
    "RunOut",
    "Screw",
    "SizedClearance",
    "SleeveClearance",
    "SlotClearance",
    "SpatialBody",
    "SpatialFile",
    "SpatialJoint",
    "SpatialPlacementTable",
    "SpatialPosition",
    "SpatialStart",
    "SpringTable",
    "Stiffness",
    "TargetDwell",
    "TargetFunction",
    "TargetTable",
    "ToleranceLaw",
    "ToleranceTable",
    "Universal",
    "Variables",
    "Variation",
    "Wear",
    "Zone",
    "along_the_path",
    "checked",
    "json_schema",
    "law_in_core",
    "limits_of",
    "space_of",
    "validate",
    "variables_of",
    "with_coordinate",
    "wrong_with",
]

T = TypeVar("T", bound=BaseModel)

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
    space = space_of(raw, file)
    try:
        variables = Variables(*variables_of(raw))
    except NotAnExpression as problem:
        raise InputError(str(problem), file=file, key=f"variables.{problem.name}") from None
    return checked(raw, variables, FILES[space], file)


def space_of(raw: Mapping[str, Any], file: str) -> str:
    """Whether a file is in the plane or in space.

    Raises
    ------
    InputError
        When it says something else.
    """
    space = raw.get("space", "planar")
    if not isinstance(space, str) or space not in FILES:
        problem = f"{shown(space)} is not valid here; {suggestion(str(space), FILES)}"
        raise InputError(problem, file=file, key="space")
    return space


def checked(raw: dict[str, Any], variables: Variables, model: type[T], file: str) -> T:
    """Data as a model, with numbers for its expressions.

    Raises
    ------
    InputError
        Naming the first mistake.
    """
    try:
        return model.model_validate(raw, context=variables)
    except ValidationError as error:
        key, problem = located(error, raw)
        raise InputError(problem, file=file, key=key) from None


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
