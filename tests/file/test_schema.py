"""The JSON Schema, with which editors complete and check a mechanism file."""

import subprocess
import sys
import tomllib
from typing import Any

import jsonschema
import pytest

from jointplay import examples
from jointplay.file.schema import json_schema

TEXTS = {name: examples.text(name) for name in examples.names()}
VALIDATOR = jsonschema.Draft202012Validator(json_schema())


def test_it_is_a_json_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(json_schema())


@pytest.mark.parametrize("name", examples.names())
def test_it_takes_the_examples(name: str) -> None:
    VALIDATOR.validate(tomllib.loads(TEXTS[name]))


def require_refused(name: str, path: tuple[str | int, ...], value: Any) -> None:
    """With another value an example is none that the schema takes."""
    data = tomllib.loads(TEXTS[name])
    VALIDATOR.validate(data)
    table: Any = data
    for key in path[:-1]:
        table = table[key]
    table[path[-1]] = value
    assert not VALIDATOR.is_valid(data)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("joints", "J1", "clearance"), {"radail": 1}),
        (("joints", "J1", "clearance"), {"radial": 1, "diametral": 2}),
        (("joints", "J1", "clearance"), {"radial": -1}),
        (("joints", "J1", "type"), "revolut"),
        (("joints", "J1", "on", "ground"), [0]),
        (("joints", "J 1"), {"type": "revolute"}),
        (("units", "length"), "inch"),
        (("format",), 2),
        (("outptu",), {}),
        (("dimensions", "l2", "tolerance"), "0.2"),
        (("variables",), {"a": [1]}),
        (("variables",), 3),
        (("variables",), {"3a": 1}),
        (("variables",), {"sqrt": 1}),
        (("variables",), {"a-b": 1}),
        (("drives", "theta1", "count"), 1),
        (("joints", "J1", "stiffness"), 5),
        (("joints", "J1", "stiffness"), {}),
        (("joints", "J1", "stiffness"), {"radail": 5}),
        (("joints", "J1", "stiffness"), {"axial": 5}),
        (("bodies",), {"coupler": {"stiffness": 0}}),
        (("bodies",), {"coupler": {"stiffness": 1, "E": 1, "area": 1}}),
        (("bodies",), {"coupler": {"area": 1}}),
        (("bodies",), {"coupler": {"torsion": 1}}),
        (("joints", "J1", "position"), {"ground": {}}),
        (("joints", "J1", "position"), {"ground": {"z": 1}}),
        (("joints", "J1", "position"), {"ground": {"diameter": -1}}),
        (("joints", "J1", "position"), {"ground": 0.1}),
        (("links",), {"l": {"body": "coupler", "between": ["J2", "J3"]}}),
        (("links",), {"l": {"body": "coupler", "between": ["J2", "J3"], "rz": 1}}),
    ],
)
def test_it_refuses_what_the_program_refuses(path: tuple[str, ...], value: Any) -> None:
    require_refused("four-bar", path, value)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("space",), "planar"),
        (("joints", "leg1", "type"), "pin_in_slot"),
        (("joints", "leg1", "clearance", "width"), 0),
        (("joints", "leg1", "on", "lower1"), [0, 0]),
        (("joints", "base1", "axes"), [[0, 0, 1]]),
        (("path", "angle"), [0]),
        (("output", "at"), [0, 0]),
        (("loads", 0, "moment"), 1),
        (("joints", "leg1", "stiffness"), {"tilt": [1, 2, 3]}),
        (("bodies",), {"lower1": {"torsion": 1}}),
        (("bodies",), {"lower1": {"E": 1, "inertia": [1]}}),
    ],
)
def test_it_refuses_what_there_is_not_in_space(path: tuple[str | int, ...], value: Any) -> None:
    require_refused("3-upu", path, value)


@pytest.mark.parametrize("name", ["a", "a_1", "_b", "länge", "rod2", "pitch", "sinus"])
def test_it_takes_the_names_of_variables(name: str) -> None:
    VALIDATOR.validate({**tomllib.loads(TEXTS["four-bar"]), "variables": {name: 1}})


def test_the_json_schema_knows_every_key_and_explains_it() -> None:
    schema = json_schema()
    tables = [table for table in schema["$defs"].values() if table["type"] == "object"]
    assert {"radial", "diametral", "law"} <= set(schema["$defs"]["RevoluteClearance"]["properties"])
    assert {"radial", "axial", "length", "law"} <= set(schema["$defs"]["BearingClearance"]["properties"])
    assert "from" in schema["$defs"]["Drive"]["properties"]
    for table in tables:
        assert table["additionalProperties"] is False
        for key, entry in table["properties"].items():
            assert entry.get("description"), key
    assert "null" not in str(schema)


def test_every_key_of_the_examples_is_in_the_json_schema() -> None:
    known = {key for table in json_schema()["$defs"].values() for key in table.get("properties", {})}
    named = {"joints", "drives", "dimensions", "bodies", "start", "on", "runout", "outputs", "load_cases", "costs"}
    named |= {"patterns", "values", "variables", "grid", "vary"}

    def keys(node: Any, names: bool = False) -> set[str]:
        if isinstance(node, list):
            return set().union(*map(keys, node))
        if not isinstance(node, dict):
            return set()
        below = [keys(value, key in named and not names) for key, value in node.items()]
        return set().union(set() if names else set(node), *below)

    for text in TEXTS.values():
        assert keys(tomllib.loads(text)) <= known


def test_the_schema_is_light_to_import() -> None:
    code = "import sys, jointplay.file.schema; print(*sorted({name.partition('.')[0] for name in sys.modules}))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"numpy", "xarray", "pandas", "scipy", "tomlkit"} & set(run.stdout.split())
