"""The typed methods of `jointplay.model.builder`, written from the JSON Schema of the mechanism file.

`python tests/helpers/signatures.py` writes the two files again after a change of the schema;
`tests/model/test_builder.py` says when that is due. A table of the file in the plane and its counterpart in space
become one, with the keys of both.
"""

import subprocess
import sys
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from keyword import iskeyword
from pathlib import Path
from types import MappingProxyType
from typing import Any

from jointplay.file.schema import json_schema

PACKAGE = Path(__file__).resolve().parents[2] / "python" / "jointplay" / "model" / "builder"
#: characters of a line, and those before the description of a key in a method
WIDTH, WITHIN = 120, 8

Node = dict[str, Any]

#: sections of the file whose entries have names, and the method that writes one of them
NAMED = {
    "bodies": "body",
    "start": "start",
    "drives": "drive",
    "followers": "follower",
    "dimensions": "dimension",
    "links": "link",
    "springs": "spring",
    "costs": "cost",
}
#: sections that are one table
SINGLE = ("path", "assembly", "limits", "target", "design", "document")
#: sections that are a list of tables
LISTED = {"correlations": "correlation", "loads": "load"}
#: what build.py writes by hand: values, and what is both one and several
BY_HAND = (
    "title",
    "space",
    "units",
    "gravity",
    "temperature",
    "expansion",
    "friction",
    "variables",
    "grid",
    "patterns",
)
#: what a file has and data has not
OF_FILES = ("format", "include", "board")
#: what is written together with another section
BESIDE = {"output": "outputs", "loads": "load_cases"}
#: where a joint sits: behind what it is
PLACING = ("on", "bodies", "at", "axis", "side", "axes", "position", "direction")

#: the joint that says of all others what these keys are
FIRST = "revolute"
AS_BEFORE = f"As of `{FIRST}`."

NUMBER = "NumberLike"


class Signatures:
    """What the methods and their tables are made of."""

    def __init__(self) -> None:
        self.definitions: dict[str, Node] = json_schema()["$defs"]
        self.tables: dict[str, dict[str, tuple[str, str]]] = {}
        self.about: dict[str, str] = {}
        #: the keys of places as the first joint describes them
        self.placing: dict[str, tuple[str, str]] = {}

    # --- types ---

    def alternatives(self, node: Node) -> Iterator[Node]:
        for key in ("anyOf", "oneOf"):
            if key in node and "properties" not in node:
                for one in node[key]:
                    yield from self.alternatives(one)
                return
        yield node

    def type_of(self, nodes: Sequence[Node]) -> str:
        """The annotation for values that fit any of some nodes."""
        found: list[str] = []
        references: list[str] = []
        arrays: list[Node] = []
        mappings: list[Node] = []
        for node in (one for whole in nodes for one in self.alternatives(whole)):
            if "$ref" in node:
                name = node["$ref"].rpartition("/")[2]
                found += [NUMBER] if name == "Expression" else []
                references += [name] if name != "Expression" else []
            elif "enum" in node:
                found.append(f"Literal[{', '.join(map(repr, node['enum']))}]")
            elif node["type"] == "array":
                arrays += node.get("prefixItems", []) or [node["items"]]
            elif node["type"] == "object":
                pattern = [*node.get("patternProperties", {}).values()]
                mappings += pattern or [node["additionalProperties"]]
            else:
                found.append({"number": NUMBER, "integer": "Count", "string": "str", "boolean": "bool"}[node["type"]])
        if arrays:
            element = self.type_of(arrays)
            found.append({NUMBER: "NumbersLike", "NumbersLike": "RowsLike"}.get(element, f"Sequence[{element}]"))
            if element == f"{NUMBER} | NumbersLike":
                found[-1] = "NumbersLike | RowsLike"
        if mappings:
            found.append(f"Mapping[str, {self.type_of(mappings)}]")
        if references:
            found.append(self.table(tuple(dict.fromkeys(references))))
        # A number may be an expression, which is a text already.
        words = [one for one in dict.fromkeys(found) if not (one == "str" and NUMBER in found)]
        return " | ".join(dict.fromkeys(part for word in words for part in _split(word)))

    def table(self, names: tuple[str, ...]) -> str:
        """The name of the typed table that has the keys of all these."""
        name = names[-1].removeprefix("Spatial").removeprefix("Planar").removesuffix("Table") + "Dict"
        if name not in self.about:
            self.about[name] = self.definitions[names[-1]].get("description", "")
            self.tables[name] = {}
        # The same table may stand alone elsewhere, with fewer keys.
        self.tables[name] |= self.keys(names)
        return name

    def keys(self, names: Iterable[str]) -> dict[str, tuple[str, str]]:
        """Type and description of every key of some tables."""
        names = [*names]
        every = [self.definitions[name]["properties"] for name in names]
        found: dict[str, tuple[str, str]] = {}
        for key in dict.fromkeys(key for properties in every for key in properties):
            nodes = [properties[key] for properties in every if key in properties]
            descriptions = list(dict.fromkeys(node["description"] for node in nodes if "description" in node))
            has = [name for name, properties in zip(names, every, strict=True) if key in properties]
            only = f" ({_space(has[0])} only)" if len(has) < len(names) == 2 else ""
            text = "; in space: ".join(descriptions) if len(names) == 2 else descriptions[0]
            found[key] = self.type_of(nodes), text.rstrip(".") + only
        return found

    # --- what is in the file ---

    def of(self, *keys: str, pattern: bool = False) -> tuple[str, ...]:
        """Definitions that stand below a key of the file, or of a pattern, in the plane and in space."""
        found: list[str] = []
        for space in ("Planar", "Spatial"):
            node = self.definitions[f"{space}{'Pattern' if pattern else 'File'}"]
            for key in keys:
                node = node["properties"][key]
            found += _references(node)
        return tuple(dict.fromkeys(found))

    def joints(self) -> dict[str, tuple[str, ...]]:
        """The kinds of joint, each with its tables."""
        found: dict[str, tuple[str, ...]] = {}
        for name in self.of("joints"):
            kind = self.definitions[name]["properties"]["type"]["const"]
            found[kind] = (*found.get(kind, ()), name)
        return found

    # --- code ---

    def entries(self) -> str:
        """The module of the methods."""
        both = [self._joint(kind, names) for kind, names in self.joints().items()]
        both += [self._named(section, method) for section, method in NAMED.items() if section != "costs"]
        whole = [self._named("costs", "cost")]
        whole += [self._single(section) for section in SINGLE]
        whole += [self._beside("output", "output"), self._beside("loads", "load")]
        whole += [self._listed("correlations", "correlation", ())]
        copied = [self._single("limits", pattern=True), self._listed("loads", "load", ())]
        classes = {
            "Parts(Writing)": ("What the mechanism and a pattern of it are made of.", both),
            "Whole(Parts)": ("What a mechanism has as a whole.", whole),
            "Repeated(Parts)": ("What a pattern has in another way.", copied),
        }
        body = "\n\n".join(
            f'class {head}:\n    """{text}"""\n\n' + "\n\n".join(methods) for head, (text, methods) in classes.items()
        )
        names = sorted({name for name in self.tables if f"{name} |" in body or f"{name}]" in body})
        return ENTRIES.format(tables=", ".join(names), body=body)

    def written(self) -> str:
        """The module of the tables."""
        self.entries()
        self.table(self.of("units"))
        self.table(self.of("temperature"))
        self.table(self.of("grid"))
        self.table(("About", "SpatialAbout"))
        self.tables["ClearanceDict"] = {
            key: value
            for name in sorted(self.tables)
            if name.endswith("ClearanceDict")
            for key, value in self.tables[name].items()
        }
        self.about["ClearanceDict"] = "Play of a joint of any kind."
        return TABLES.format(body="\n\n".join(self._table(name) for name in self._derived()))

    def _base(self, name: str) -> str:
        """The table with the most of the keys of this one and no others, from which it is derived."""
        keys = self.tables[name].items()
        within = [one for one, own in self.tables.items() if len(own) > 1 and own.items() < keys]
        return max(within, key=lambda one: len(self.tables[one]), default="")

    def _derived(self) -> Iterator[str]:
        """All tables, each behind the one from which it is derived."""
        following: dict[str, list[str]] = {}
        for name in sorted(self.tables):
            following.setdefault(self._base(name), []).append(name)
        waiting = following[""][::-1]
        while waiting:
            name = waiting.pop()
            yield name
            waiting += following.get(name, [])[::-1]

    def _table(self, name: str) -> str:
        keys, base = self.tables[name], self._base(name)
        if any(map(iskeyword, keys)):
            inside = ", ".join(f'"{key}": "{kind}"' for key, (kind, _) in keys.items())
            return f'{name} = TypedDict("{name}", {{{inside}}}, total=False)'
        lines = [f"class {name}({base or 'TypedDict'}, total=False):", f'    """{self.about[name]}"""', ""]
        for key, (kind, text) in keys.items():
            if base and key in self.tables[base]:
                continue
            lines += [f"    {key}: {kind}", *_indented(f'"""{text[:1].upper()}{text[1:]}."""', 4)]
        return "\n".join(lines)

    def _method(
        self,
        name: str,
        heading: str,
        call: str,
        keys: dict[str, tuple[str, str]],
        first: tuple[str, str, str] | None,
        places: tuple[str, str] | None = None,
        known: Mapping[str, tuple[str, str]] = MappingProxyType({}),
    ) -> str:
        """The text of a method: its first parameter (name, type, description), its keys, and bodies by name.

        Keys that are described elsewhere already are named together.
        """
        parameters = ["self"] + ([f"{first[0]}: {first[1]}", "/"] if first else []) + ["*"]
        parameters += [f"{_word(key)}: {kind} | None = None" for key, (kind, _) in keys.items()]
        parameters += [f"**places: {places[0]}"] if places else []
        doc = [heading, "", "Parameters", "----------"]
        if first:
            optional = ", optional" if "None" in first[1] else ""
            doc += [f"{first[0]} : str{optional}", *_indented(first[2], 4, WITHIN)]
        for text, same in groupby(keys, key=lambda key: known.get(key) == keys[key] or keys[key][1]):
            words = AS_BEFORE if text is True else f"{text[:1].upper()}{text[1:]}."
            doc += [f"{', '.join(map(_word, same))} : optional", *_indented(words, 4, WITHIN)]
        if places:
            doc += ["**places", *_indented(places[1], 4, WITHIN)]
        lines = [f"def {name}({', '.join(parameters)}) -> None:", f'    """{doc[0]}']
        lines += [f"    {line}".rstrip() for line in doc[1:]]
        lines += ['    """', f"    {call}"]
        return textwrap.indent("\n".join(lines), "    ")

    def _joint(self, kind: str, names: tuple[str, ...]) -> str:
        keys = self.keys(names)
        del keys["type"]
        order = sorted(keys, key=lambda key: PLACING.index(key) if key in PLACING else -1)
        place = self.table(("PlacementTable", "SpatialPlacementTable"))
        if kind == FIRST:
            self.placing = {}
        text = self._method(
            kind,
            self.definitions[names[0]]["description"],
            f'self._joint("{kind}", locals())',
            {key: keys[key] for key in order},
            ("name", "str", "Its name."),
            (f"NumbersLike | {place}", "Its place on each body, by the name of the body: as in `on`."),
            self.placing,
        )
        if kind == FIRST:
            self.placing = {key: keys[key] for key in PLACING if key in keys}
        return text

    def _named(self, section: str, method: str) -> str:
        names = self.of(section)
        what = "body" if section in ("bodies", "start") else "source" if section == "costs" else ""
        keys = self.keys(names)
        places = ("NumbersLike | str", "Its place on each body, by the name of the body: as in `on`.")
        return self._method(
            method,
            self.definitions[names[0]]["description"].partition("\n")[0],
            f'self._named("{section}", locals())',
            keys,
            (what or "name", "str", f"Name of the {what}." if what else "Its name."),
            places if "on" in keys else None,
        )

    def _single(self, section: str, pattern: bool = False) -> str:
        names = self.of(section, pattern=pattern)
        heading = self.definitions[names[-1]]["description"]
        return self._method(section, heading, f'self._single("{section}", locals())', self.keys(names), None)

    def _listed(self, section: str, method: str, beside: tuple[str, ...]) -> str:
        names = self.of(section)
        heading = self.definitions[names[0]]["description"]
        return self._method(method, heading, f'self._listed("{section}", locals())', self.keys(names), None)

    def _beside(self, section: str, method: str) -> str:
        """What is the only one, or one of several with a name."""
        several = BESIDE[section]
        names = self.of(several)
        what = {"output": "output", "loads": "load case"}[section]
        words = {
            "output": "Its name where there are several.",
            "loads": "The load case in which it acts; in every case if left out. Without anything else, a case without"
            " loads of its own.",
        }[section]
        heading = self.definitions[names[0]]["description"] if section == "loads" else ONE_OUTPUT
        parameter = what.replace("load ", "").replace("output", "name")
        first = (parameter, "str | None = None", words)
        call = "self._load(case, locals())" if section == "loads" else "self._output(locals())"
        return self._method(method, heading, call, self.keys(names), first)


#: how `output` begins
ONE_OUTPUT = "The point whose error is asked, or one of several."


def _word(key: str) -> str:
    """A key as a parameter: Python keeps some words for itself."""
    return f"{key}_" if iskeyword(key) else key


def _space(name: str) -> str:
    return "in space" if name.startswith("Spatial") else "in the plane"


def _split(text: str) -> list[str]:
    """Alternatives of an annotation that stand outside brackets."""
    parts, depth = [""], 0
    for piece in text.split(" | "):
        parts[-1] += piece
        depth += piece.count("[") - piece.count("]")
        parts += [""] if depth == 0 else []
        if depth:
            parts[-1] += " | "
    return parts[:-1]


def _indented(text: str, by: int, within: int = 0) -> list[str]:
    return textwrap.wrap(text, WIDTH - within, initial_indent=" " * by, subsequent_indent=" " * by)


def _references(node: Any) -> Iterator[str]:
    """Names of the definitions in a node, those of numbers apart, in their order."""
    if isinstance(node, dict):
        if "$ref" in node:
            name = node["$ref"].rpartition("/")[2]
            if name != "Expression":
                yield name
        for value in node.values():
            if not isinstance(value, str):
                yield from _references(value)
    elif isinstance(node, list):
        for value in node:
            yield from _references(value)


HEAD = """Written from the schema of the file by tests/helpers/signatures.py; not by hand."""

ENTRIES = (
    '''"""The methods that write the tables of a mechanism, with their keys.

'''
    + HEAD
    + '''
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from .tables import ({tables})
from .values import Count, NumberLike, NumbersLike, RowsLike
from .writing import Writing


{body}
'''
)

TABLES = (
    '''"""The tables of a mechanism file as types: their keys, for editors and type checkers.

'''
    + HEAD
    + '''
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, TypedDict

from .values import Count, NumberLike, NumbersLike, RowsLike


{body}
'''
)


def formatted(text: str) -> str:
    """The text as ruff formats it, without imports that are not used."""
    for arguments in (["check", "--select", "F401,I001", "--fix", "--quiet"], ["format", "--quiet"]):
        run = [sys.executable, "-m", "ruff", *arguments, "--stdin-filename", str(PACKAGE / "entries.py"), "-"]
        text = subprocess.run(run, input=text, capture_output=True, text=True, check=True).stdout
    return text


def files() -> dict[Path, str]:
    """The files and what they should say."""
    signatures = Signatures()
    return {
        PACKAGE / "tables.py": formatted(signatures.written()),
        PACKAGE / "entries.py": formatted(signatures.entries()),
    }


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")
