"""Tables that the program knows, put into the pages while they are built: commands, keys of the file, variables.

A page has a comment in the place of a table:

* ``<!-- commands -->``: every command and what it does;
* ``<!-- options -->``: the options that several commands have;
* ``<!-- command: error -->``: usage, help, options and examples of a command;
* ``<!-- keys: Gear, Rack; without: on, bodies -->``: the keys of tables of the mechanism file, by the names that the
  JSON Schema gives these tables; ``only:`` in place of ``without:`` names those that are listed;
* ``<!-- variables: loaded; without: worst -->``: the variables of a result, without those of another one.
"""

import re
from collections import Counter
from collections.abc import Callable, Container, Iterable, Mapping
from functools import cache
from typing import Any

import typer

import jointplay as jp
from jointplay.cli.commands import program
from jointplay.file.schema import json_schema

MARK = re.compile(r"^<!-- (?P<what>commands|options|command|keys|variables)(?:: (?P<which>[^>]*?))? -->$", re.MULTILINE)
#: an option that so many commands explain in the same words is explained once
SHARED = 4
#: what Markdown would take for more than a letter
SPECIAL = re.compile(r"([\\*_<>$|{}])")
#: a table with more keys than these is not written out where it may stand
FEW = 4
#: tables of the file that have a section of their own on the page
SECTIONS = {
    "ToleranceTable": "[tolerance](#tolerances)",
    "LawTable": "[law](#laws)",
    "Expression": "",
    "Temperature": "`{ deviation, tolerance, law }`",
}


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table in Markdown; columns in which no row says anything are left out."""
    names, lines = list(head), [list(row) for row in rows]
    kept = [k for k, name in enumerate(names) if k == 0 or any(line[k] for line in lines)]
    shown = [[names[k] for k in kept], ["---"] * len(kept), *([line[k] for k in kept] for line in lines)]
    return "\n".join(f"| {' | '.join(line)} |" for line in shown) + "\n"


def plain(text: str) -> str:
    """A text as Markdown that says no more than it; what it sets in backticks stays code.

    >>> plain("joints.*.clearance, see `a_b`")
    'joints.\\\\*.clearance, see `a_b`'
    """
    parts = text.split("`")
    shown = [SPECIAL.sub(r"\\\1", part) if k % 2 == 0 else f"`{part}`" for k, part in enumerate(parts)]
    return "".join(shown).replace("\n", " ")


def code(text: object) -> str:
    """A word of a program. (Within one, bars end no cell of a table.)"""
    return f"`{text}`"


# --- commands --------------------------------------------------------------------------------------------------------


@cache
def command_line() -> dict[str, Any]:
    """The commands by name."""
    commands: dict[str, Any] = vars(typer.main.get_command(program()))["commands"]
    return commands


def options(command: str) -> list[Any]:
    """The options of a command."""
    return [p for p in command_line()[command].params if p.param_type_name == "option"]


def _key(option: Any) -> tuple[str, str]:
    return option.opts[0], option.help


@cache
def shared() -> list[tuple[str, str]]:
    """Options that several commands explain in the same words."""
    counted = Counter(_key(option) for name in command_line() for option in options(name))
    return [key for key, count in counted.items() if count >= SHARED]


def _choices(option: Any) -> list[str]:
    """What an option can be. (Newer versions of typer have no types of click.)"""
    described = getattr(option, "type", None) or option.type_descriptor
    return [str(getattr(choice, "value", choice)) for choice in getattr(described, "choices", None) or ()]


def _names(option: Any) -> str:
    first, *others = (*option.opts, *option.secondary_opts)
    value = option.metavar or "|".join(_choices(option))
    flag = getattr(option, "is_flag", False)
    return ", ".join([code(f"{first} {value}" if value and not flag else first), *map(code, others)])


def _default(option: Any) -> str:
    value = getattr(option.default, "value", option.default)
    said = "default" in option.help or "left out" in option.help
    if option.secondary_opts:
        return code((option.opts if value else option.secondary_opts)[0])
    return "" if said or option.is_flag or value is None or callable(value) else code(value)


def commands() -> str:
    """Every command and the first line of its help."""
    rows = (
        [f"[`{name}`](#{name})", plain(command.help.partition("\n")[0])] for name, command in command_line().items()
    )
    return table(("command", "what it does"), rows)


def shared_options() -> str:
    """The options that several commands have."""
    everything = {_key(option): option for name in command_line() for option in options(name)}
    return table(("option", "meaning"), ([_names(everything[key]), plain(key[1])] for key in shared()))


def command(name: str) -> str:
    """Usage, help, options and examples of a command."""
    found = command_line()[name]
    given = [(p.metavar or p.name.upper(), p.required) for p in found.params if p.param_type_name == "argument"]
    arguments = " ".join(name if required or name[0] == "[" else f"[{name}]" for name, required in given)
    own = [option for option in options(name) if _key(option) not in shared()]
    others = [option for option in options(name) if _key(option) in shared()]
    paragraphs = [plain(" ".join(part.split())) for part in found.help.split("\n\n")]
    parts = [f"`jointplay {name}{' ' * bool(arguments)}{arguments}`: {paragraphs[0][:1].lower()}{paragraphs[0][1:]}"]
    parts += paragraphs[1:]
    if own:
        rows = ([_names(option), _default(option), plain(option.help)] for option in own)
        parts.append(table(("option", "default", "meaning"), rows))
    if others:
        said = (code(o.opts[0]) + (f" ({_default(o)})" if _default(o) else "") for o in others)
        parts.append(f"[Shared options](#options-of-several-commands), with their defaults: {', '.join(said)}.")
    examples = found.epilog.partition("Examples:\n")[2]
    parts.append("```text\n" + "\n".join(f"$ {line.strip()}" for line in examples.splitlines()) + "\n```")
    return "\n\n".join(parts) + "\n"


# --- keys of the mechanism file --------------------------------------------------------------------------------------


@cache
def definitions() -> dict[str, Any]:
    """The tables of the file by name, as the JSON Schema has them."""
    found: dict[str, Any] = json_schema()["$defs"]
    return found


#: keys of joints whose value is a table of their kind
OF_JOINTS = ("clearance", "stiffness", "wear", "friction")


@cache
def users() -> dict[tuple[str, str], list[str]]:
    """The types of joints that have a table as `clearance`, `stiffness`, `wear` or `friction`."""
    found: dict[tuple[str, str], list[str]] = {}
    for definition in definitions().values():
        properties = definition.get("properties", {})
        kind = properties.get("type", {}).get("const")
        for key in OF_JOINTS:
            for name in re.findall(r"#/\$defs/(\w+)", str(properties.get(key, ""))) if kind else ():
                if kind not in found.setdefault((key, name), []):
                    found[key, name].append(kind)
    return found


def _types(name: str) -> list[str]:
    """The types of joints that a table is of."""
    own = definitions()[name].get("properties", {}).get("type", {}).get("const")
    of = next(filter(None, (users().get((key, name)) for key in OF_JOINTS)), [])
    return [own] if own else of or ["space" if name.startswith("Spatial") else "plane"]


def value(schema: Mapping[str, Any]) -> str:
    """What may stand at a key.

    >>> value({"anyOf": [{"type": "number"}, {"type": "array", "items": {"type": "string"}}]})
    'number or list of texts'
    """
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        if name in SECTIONS:
            return SECTIONS[name]
        inside = definitions()[name].get("properties", {})
        return code(f"{{ {', '.join(inside)} }}") if len(inside) <= FEW else "table"
    if "const" in schema or "enum" in schema:
        return ", ".join(code(f'"{x}"' if isinstance(x, str) else x) for x in schema.get("enum", [schema.get("const")]))
    for key in ("anyOf", "oneOf"):
        if key in schema:
            said = dict.fromkeys(filter(None, map(value, schema[key])))
            return " or ".join(said)
    kind = schema.get("type")
    if kind == "array" and "prefixItems" in schema:
        inner = set(map(value, schema["prefixItems"]))
        return (
            f"{len(schema['prefixItems'])} numbers" if inner == {"number"} else f"list of {len(schema['prefixItems'])}"
        )
    if kind == "array":
        inner = value(schema.get("items", {}))
        return f"list of {inner}s" if inner in ("number", "text", "whole number") else "list"
    if kind == "object":
        inner = next(iter(schema.get("patternProperties", {}).values()), {})
        return "tables by name" if value(inner) in ("", "table") else f"by name: {value(inner)}"
    return {"string": "text", "boolean": "`true`, `false`", "integer": "whole number", "number": "number"}.get(
        str(kind), ""
    )


def _given(key: str, definition: Mapping[str, Any]) -> str:
    if key in definition.get("required", ()):
        return "required"
    default = definition["properties"][key].get("default")
    if default in (None, {}, [], "") or (isinstance(default, list) and not any(default)):
        return ""
    return code(
        str(default).lower()
        if isinstance(default, bool)
        else f'"{default}"'
        if isinstance(default, str)
        else f"{default:g}"
    )


def keys(names: list[str], chosen: Callable[[str], bool], sections: Container[str] = ()) -> str:
    """The keys of tables of the file; of several tables those that mean the same share a row.

    A key leads to the section of its name, if the page has one.
    """
    rows: dict[tuple[str, str, str, str], list[str]] = {}
    every = list(dict.fromkeys(kind for name in names for kind in _types(name)))
    for name in names:
        definition = definitions()[name]
        for key, schema in definition["properties"].items():
            if chosen(key):
                slug = key.replace("_", "-")
                shown = f"[{code(key)}](#{slug})" if slug in sections else code(key)
                row = (shown, value(schema), _given(key, definition), plain(schema["description"]))
                rows.setdefault(row, []).extend(_types(name))
    several = len(every) > 1 and any(set(of) != set(every) for of in rows.values())
    lines = [
        [key, (", ".join(map(code, dict.fromkeys(of))) if set(of) != set(every) else "all") if several else "", *rest]
        for (key, *rest), of in rows.items()
    ]
    return table(("key", "for", "value", "default", "meaning"), lines)


# --- variables of results --------------------------------------------------------------------------------------------


def _four_bar(**changes: Any) -> jp.Mechanism:
    return jp.loads(jp.examples.text("four-bar", {"limits.position": "1"})).with_(
        {"drives.theta1.values": [22.7, 43.83]} | changes
    )


def _cases() -> jp.Mechanism:
    return jp.loads(jp.examples.text("slider-crank-cases"))


def _strained() -> jp.Mechanism:
    return jp.loads(jp.examples.text("x-braced-square"))


def _press() -> jp.Mechanism:
    return jp.loads(jp.examples.text("press")).with_({"drives.angle.count": 3})


def _steps() -> jp.Mechanism:
    return _four_bar(**{"assembly.steps": [["crank"], ["coupler", "rocker"]]})


#: variables that the questions share; they are explained once
COMMON = ("nominal", "limit", "limit_met", "margin")
#: results that have, together, every variable of a question
RESULTS: dict[str, Callable[[], list[Any]]] = {
    "region": lambda: [jp.region(_four_bar(), directions=4)],
    "sensitivity": lambda: [jp.sensitivity(_four_bar())],
    "check": lambda: [jp.check(_four_bar()), jp.check(_strained())],
    "solve": lambda: [jp.solve(_four_bar()), jp.solve(_path())],
    "singularities": lambda: [jp.singularities(_four_bar())],
    "given": lambda: [jp.given(_four_bar()), jp.given(_strained())],
    "loaded": lambda: [
        jp.loaded(_four_bar()),
        jp.loaded(_running()),
        *(jp.loaded(_four_bar(**{"joints.J1.friction": {"torque": 1.0}}), approach=a) for a in ("forward", "rest")),
        jp.loaded(_cases()),
        jp.loaded(_strained()),
        jp.loaded(_fits()),
    ],
    "worst": lambda: [jp.worst(_four_bar()), jp.worst(_strained())],
    "certified": lambda: [jp.worst(_four_bar(), certify=True, parts=2)],
    "random": lambda: [
        jp.random(_four_bar(), samples=2000, indices=True, rare=True, contact="scattered", keep=1),
        jp.random(_fits(), samples=2000),
        jp.random(_strained(), samples=200),
    ],
    "forces": lambda: [
        jp.forces(_four_bar()),
        jp.forces(_four_bar(), "given"),
        jp.forces(_four_bar(**{"limits.reactions.J3": 50}), "random", samples=100),
    ],
    "compensate": lambda: [jp.compensate(_four_bar()), jp.compensate(_four_bar(), "worst")],
    "compare": lambda: [jp.compare(_four_bar(**{"limits.reactions.J3": 50}), jp.loads(jp.examples.text("p3r")))],
    "allow": lambda: [jp.allow(_four_bar()), jp.allow(_four_bar(), "random", probability=0.9, samples=100)],
    "life": lambda: [jp.life(_four_bar(**{"joints.J3.wear": {"growth": 1e-6}, "limits.position": 5.0}))],
    "workspace": lambda: [jp.workspace(jp.loads(jp.examples.text("serial-2r")), {"x": [0, 200, 400], "y": [0, 200]})],
    "plan": lambda: [jp.plan(_pushed(), 2, sigma={"length": 0.1, "angle": 0.1})],
    "diagnose": lambda: [jp.diagnose(_pushed(), _under_loads(), sigma={"length": 0.1})],
    "verify": lambda: [jp.verify(_pushed(), _under_loads(side=True), sigma={"length": 0.1})],
    "calibrate": lambda: [_calibrated(frame="unknown"), _calibrated(zeroed=("x",)), _calibrated(first=1)],
    "allocate": lambda: [
        jp.allocate(_press(), curve=[1.0]),
        jp.allocate(_press(), "random", probability=0.9, samples=512),
    ],
    "structural": lambda: [jp.structural(_four_bar(target={"line": {"fit": True}}))],
    "design": lambda: [
        jp.design(_four_bar(), {"output.at.0": [149, 150]}, aim, evaluations=2, points=2)
        for aim in ("size", ["size", "worst_position"], {"size": 1.0, "worst_position": 1.0})
    ],
    "map": lambda: [jp.map(_four_bar(), grid={"theta1": [30.0, 40.0]})],
    "assemble": lambda: [
        jp.assemble(_steps()),
        jp.assemble(_steps(), "worst"),
        jp.assemble(_steps(), "random", samples=20),
    ],
}


def _path() -> jp.Mechanism:
    return jp.loads(jp.examples.text("five-bar", {"limits.joints": "{ A = [0, 180] }"}))


def _pushed() -> jp.Mechanism:
    """A five-bar that is pushed and pulled."""
    loads = {"push": [{"force": [0, -60]}], "pull": [{"force": [0, 60]}]}
    return jp.loads(jp.examples.text("five-bar")).with_({"load_cases": loads, "limits.position": 0.1})


def _under_loads(*, side: bool = False) -> dict[str, Any]:
    """What is read of it there, twice from either side."""
    times = 4 if side else 1
    there = {case: jp.loaded(_pushed()).sel(load_case=case) for case in ("push", "pull")}
    table = {"configuration": [0, 1] * 2 * times, "load_case": (["push"] * 2 + ["pull"] * 2) * times}
    for name in ("x", "y"):
        values = [(own.nominal + own.error).sel(component=name).values[:2] for own in there.values()]
        table[name] = [value + 1e-3 * k for k in range(times) for own in values for value in own]
    return table | ({"side": (["forward"] * 4 + ["backward"] * 4) * 2} if side else {})


def _calibrated(first: int = 9, **options: Any) -> Any:
    """Of the first readings of a five-bar; a single one determines sums only."""
    m = jp.loads(jp.examples.text("five-bar"))
    there = jp.solve(m).isel(configuration=slice(first))
    table = {name: there[name].values for name in m.drives}
    table |= {name: there.nominal.sel(component=name).values for name in ("x", "y")}
    return jp.calibrate(m, table, sigma={"length": 0.1}, **options)


def _running() -> jp.Mechanism:
    return jp.loads(jp.examples.text("press-running")).with_({"drives.crank.rotor_inertia": 1})


def _fits() -> jp.Mechanism:
    return jp.loads(jp.examples.text("four-bar-fits"))


@cache
def known(question: str) -> dict[str, tuple[str, str]]:
    """The variables of a question: their dimensions and what they are."""
    found: dict[str, tuple[str, str]] = {}
    for result in RESULTS[question]():
        extra = {"output", "load_case", *str(result.attrs.get("grid", "")).split(", ")}
        for name, variable in result.data_vars.items():
            dims = ", ".join(code(dim) for dim in variable.dims if dim not in extra)
            found.setdefault(str(name), (dims, variable.attrs["long_name"]))
    return found


def variables(question: str, without: list[str]) -> str:
    """The variables of a question."""
    left_out = {name for other in without for name in known(other)}.union(COMMON)
    rows = ([code(name), dims, plain(words)] for name, (dims, words) in known(question).items() if name not in left_out)
    return table(("variable", "dimensions", "meaning"), rows)


# --- pages -----------------------------------------------------------------------------------------------------------


def _list(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]


def made(what: str, which: str, sections: Container[str]) -> str:
    """What stands in the place of a comment, on a page with these sections."""
    names, *conditions = which.split(";")
    said = dict(part.strip().split(": ", 1) for part in conditions)
    if what == "commands":
        return commands()
    if what == "options":
        return shared_options()
    if what == "command":
        return command(which)
    if what == "variables":
        return variables(names, _list(said.get("without", "")))
    only, without = _list(said.get("only", "")), _list(said.get("without", ""))
    linked = sections if names.endswith("File") else ()
    return keys(_list(names), lambda key: (not only or key in only) and key not in without, linked)


def expanded(markdown: str) -> str:
    """A page with its tables."""
    sections = {title.lower().replace(" ", "-") for title in re.findall(r"^#+ (.+)$", markdown, re.MULTILINE)}
    return MARK.sub(lambda found: made(found["what"], found["which"] or "", sections), markdown)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Tables in place of the comments."""
    return expanded(markdown)
