"""The manual is complete: every key, command, option, result variable, public name and example has its place in it.

Looked at are the pages as they are built, with the tables that the program makes of itself.
"""

import importlib
import inspect
import pkgutil
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer
from numpydoc.validate import validate

import jointplay as jp
from helpers.hooks import hook
from jointplay import _core, examples
from jointplay.cli.commands import program
from jointplay.file.schema import json_schema

DOCS = Path(__file__).resolve().parents[2] / "docs"
#: what numpydoc must find nothing to say about; see numpydoc.validate.ERROR_MSGS
CHECKS = {
    "GL05",
    "GL06",
    "GL07",
    "GL08",
    "SS01",
    "SS03",
    "PR01",
    "PR02",
    "PR03",
    "PR05",
    "PR06",
    "PR10",
    "RT02",
    "YD01",
}


@cache
def page(name: str) -> str:
    return str(hook("reference").expanded((DOCS / name).read_text(encoding="utf-8")))


def code_words(name: str) -> set[str]:
    """Words that a page sets as code, in running text and in blocks."""
    text = page(name)
    spans = re.findall(r"`([^`\n]+)`", text) + re.findall(r"```\w*[^\n]*\n(.*?)```", text, re.DOTALL)
    return {word for span in spans for word in re.findall(r"-{0,2}[A-Za-z_][\w-]*", span)}


# --- the mechanism file ----------------------------------------------------------------------------------------------


def schema_keys(node: Any) -> Iterator[str]:
    if isinstance(node, dict):
        properties = node.get("properties", {})
        if isinstance(properties, dict):
            yield from properties
        for value in node.values():
            yield from schema_keys(value)
    elif isinstance(node, list):
        for value in node:
            yield from schema_keys(value)


@pytest.mark.parametrize("key", sorted(set(schema_keys(json_schema()))))
def test_every_key_of_the_file_is_explained(key: str) -> None:
    assert key in code_words("file-format.md")


# --- the command line ------------------------------------------------------------------------------------------------


def command_line() -> dict[str, Any]:
    """The commands by name. (Newer versions of typer carry their own click, so that its types have no fixed home.)"""
    commands: dict[str, Any] = vars(typer.main.get_command(program()))["commands"]
    return commands


def options(command: str) -> set[str]:
    parameters = [p for p in command_line()[command].params if p.param_type_name == "option"]
    return {name for p in parameters for name in (*p.opts, *p.secondary_opts)}


def section(name: str, heading: str) -> str:
    """The part of a page under a heading, up to the next one of its rank or above."""
    match = re.search(rf"^(#+) .*{re.escape(heading)}.*$", page(name), re.MULTILINE)
    assert match, f"{name} has no section {heading!r}"
    rest = page(name)[match.end() :]
    end = re.search(rf"^#{{1,{len(match[1])}}} ", rest, re.MULTILINE)
    return rest[: end.start()] if end else rest


@pytest.mark.parametrize("command", sorted(command_line()))
def test_every_command_has_a_section_that_names_its_options_and_no_others(command: str) -> None:
    code = " ".join(re.findall(r"`([^`]+)`", section("commands.md", command)))
    there = set(re.findall(r"(?<![\w-])--?[a-z][a-z-]*", code))
    assert {option for option in options(command) if option.startswith("--")} - {"--help"} <= there
    assert there <= options(command) | {"--help"}


@pytest.mark.parametrize("command", sorted(command_line()))
def test_every_command_and_option_says_what_it_does(command: str) -> None:
    assert command_line()[command].help
    params = command_line()[command].params
    silent = [p.name for p in params if not getattr(p, "help", None)]
    assert not silent
    # What the words give as the default is not printed once more.
    worded = [p for p in params if "[default: " in (getattr(p, "help", None) or "")]
    twice = [p.name for p in worded if isinstance(p.default, int | float | str) and not p.is_flag and p.show_default]
    assert not twice


def test_the_first_page_lists_every_command() -> None:
    listed = re.search(
        r"^`jointplay --help` lists them.*$", (DOCS.parent / "README.md").read_text("utf-8"), re.MULTILINE
    )
    assert listed
    assert set(command_line()) <= set(re.findall(r"`([a-z]+)`", listed[0]))


# --- the results -----------------------------------------------------------------------------------------------------


SHORT = {"drives.theta1.values": [22.7, 43.83]}
RESULTS: dict[str, Callable[[jp.Mechanism], Any]] = {
    "check": jp.check,
    "solve": jp.solve,
    "singularities": jp.singularities,
    "given": jp.given,
    "loaded": jp.loaded,
    "worst": jp.worst,
    "sensitivity": jp.sensitivity,
    "random": lambda m: jp.random(m, samples=200, indices=True),
    "compensate": jp.compensate,
    "compare": lambda m: jp.compare(m, jp.loads(examples.text("p3r"))),
    "sweep": lambda m: jp.sweep(m, "joints.*.clearance.radial", [0.1, 0.2]),
    "forces": jp.forces,
    "forces random": lambda m: jp.forces(m, "random", samples=100),
    "allow": jp.allow,
    "life": lambda m: jp.life(m.with_({"joints.J3.wear": {"growth": 1e-6}, "limits.position": 5.0})),
    "workspace": lambda _: jp.workspace(jp.loads(examples.text("serial-2r")), {"x": [0, 200, 400], "y": [0, 200]}),
    "allow random": lambda m: jp.allow(m, "random", samples=400),
    "calibrate": lambda m: jp.calibrate(
        m, {"configuration": [0, 1], "angle": [35.0, 53.0]}, sigma={"angle": 1.0}, free={"theta1": 0.1}, hold_out=0.5
    ),
    "map": lambda m: jp.map(m, grid={"theta1": [30.0, 40.0]}),
    "assemble": jp.assemble,
    "assemble worst": lambda m: jp.assemble(m, "worst"),
    "assemble random": lambda m: jp.assemble(m, "random", samples=20),
}
#: what is explained on a page of its own, or on two
ELSEWHERE = {
    "assemble": ("assembly.md",),
    "calibrate": ("questions.md", "calibration.md"),
    "life": ("questions.md", "running.md"),
    "map": ("questions.md", "map.md"),
    "workspace": ("questions.md", "workspace.md"),
}
ORDER = {"assembly.steps": [["crank"], ["coupler", "rocker"]]}


@pytest.mark.parametrize("question", RESULTS)
def test_every_variable_dimension_and_attribute_of_a_result_is_explained(question: str) -> None:
    result = RESULTS[question](jp.loads(examples.text("four-bar", {"limits.position": "1"})).with_(SHORT | ORDER))
    named = {str(name) for name in (*result.data_vars, *result.dims, *result.attrs)}
    pages = ELSEWHERE.get(question.split()[0], ("questions.md",))
    missing = sorted(named.difference(*map(code_words, pages)))
    assert not missing


def test_variables_that_only_some_mechanisms_have_are_explained() -> None:
    m = jp.loads(examples.text("five-bar", {"limits.joints": "{ A = [0, 180] }"}))
    missing = sorted({str(name) for name in jp.solve(m).data_vars} - code_words("questions.md"))
    assert not missing


def test_every_status_is_explained() -> None:
    table = re.findall(r"^\| `(\w+)` \|", section("questions.md", "What all results share"), re.MULTILINE)
    assert set(_core.STATUSES) <= set(table)


# --- the Python interface --------------------------------------------------------------------------------------------


def public_names() -> list[str]:
    """Public functions and classes; neither modules nor the version."""
    return [n for n in sorted(jp.__all__) if inspect.isroutine(getattr(jp, n)) or inspect.isclass(getattr(jp, n))]


@pytest.mark.parametrize("name", public_names())
def test_every_public_name_is_in_the_manual(name: str) -> None:
    home = getattr(jp, name).__module__
    assert re.search(rf"^::: {re.escape(home)}\.{name}$", page("api.md"), re.MULTILINE)


@pytest.mark.parametrize(
    "name",
    [
        "error", "blame", "sweep", "histogram", "correction", "nearness", "distance", "allow", "life", "allocate",
        "workspace", "cost_curve", "map", "mechanism", "assembly", "pareto", "reactions",
    ],
)  # fmt: skip
def test_every_figure_is_in_the_manual(name: str) -> None:
    assert name in jp.plot.__all__
    assert f"::: {getattr(jp.plot, name).__module__}.{name}\n" in page("api.md")


def public_objects() -> Iterator[str]:
    """Dotted names of the public functions, classes, methods and properties."""
    for name in public_names():
        value = getattr(jp, name)
        dotted = f"{value.__module__}.{name}"
        yield dotted
        if inspect.isclass(value):
            for member, attribute in vars(value).items():
                if not member.startswith("_") and (inspect.isroutine(attribute) or isinstance(attribute, property)):
                    yield f"{dotted}.{member}"


@pytest.mark.parametrize("dotted", list(public_objects()))
def test_public_docstrings_follow_numpydoc(dotted: str) -> None:
    found = [f"{code}: {text}" for code, text in validate(dotted)["errors"] if code in CHECKS]
    assert not found


def test_help_has_types_by_their_names() -> None:
    """Where annotations are evaluated, help lists all that a `NumbersLike` may be in place of this name."""
    for value in (getattr(jp, name) for name in public_names()):
        methods = [getattr(value, name) for name in dir(value)] if inspect.isclass(value) else []
        for function in filter(inspect.isfunction, [value, *methods]):
            assert "numpy" not in str(inspect.signature(function)), function.__qualname__


def modules() -> list[str]:
    found = [name for _, name, _ in pkgutil.walk_packages(jp.__path__, "jointplay.")]
    # The compiled module is described by its stub; __main__ runs the command.
    return [name for name in found if name not in ("jointplay._core", "jointplay.__main__")]


@pytest.mark.parametrize("name", modules())
def test_every_module_and_everything_public_in_it_has_a_docstring(name: str) -> None:
    module = importlib.import_module(name)
    own = [v for v in vars(module).values() if getattr(v, "__module__", None) == name and hasattr(v, "__name__")]
    silent = [v.__name__ for v in own if not v.__name__.startswith("_") and not inspect.getdoc(v)]
    assert module.__doc__
    assert not silent


# --- the examples ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", examples.names())
def test_every_example_is_on_the_page_of_examples(name: str) -> None:
    assert f"`{name}`" in page("examples.md")


# --- the whole -------------------------------------------------------------------------------------------------------


def test_files_that_the_page_on_the_design_names_exist() -> None:
    there = {path.name for folder in ("crates", "python", "tests") for path in (DOCS.parent / folder).rglob("*.*")}
    named = {name.rpartition("/")[2] for name in re.findall(r"`([\w/-]+\.(?:rs|py|pyi|js))`", page("design.md"))}
    assert named
    assert named <= there


def test_a_reader_has_an_end_in_sight() -> None:
    pages = [*DOCS.rglob("*.md"), *(DOCS.parent / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md"))]
    assert sum(len(path.read_text(encoding="utf-8").split()) for path in pages) <= 60_000
