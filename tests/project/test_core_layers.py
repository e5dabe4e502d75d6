"""Imports of the core go one way: every layer from those below it, no circle of files, no method from above."""

import re
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

SOURCES = Path(__file__).resolve().parents[2] / "crates" / "jointplay-core" / "src"

#: each layer may import from those before it, and from its own modules; as drawn in lib.rs
LAYERS = (
    "interrupt",
    "math",
    "program",
    "clearance",
    "cone",
    "mechanism",
    "closure",
    "redundancy",
    "contact",
    "nominal",
    "questions",
)

Module = tuple[str, ...]
Texts = Mapping[Module, str]


def module_of(path: Path) -> Module:
    """``src/cone/lanes/mod.rs`` -> ``("cone", "lanes")``; ``lib.rs`` is the root, ``()``."""
    parts = path.relative_to(SOURCES).with_suffix("").parts
    return parts[:-1] if parts[-1] in ("mod", "lib") else parts


def code_of(text: str) -> str:
    """Without comments and without the unit tests at the end, which may look at anything."""
    return re.split(r"#\[cfg\(test\)\]\s*mod \w+ \{", re.sub(r"//[^\n]*", "", text))[0]


TEXTS: Texts = {
    module_of(path): code_of(path.read_text(encoding="utf-8"))
    for path in sorted(SOURCES.rglob("*.rs"))
    if path.stem != "tests"
}
MODULES = [module for module in TEXTS if module]


def leaves(tree: str, before: str = "") -> Iterator[str]:
    """The paths of a tree of imports: ``a::{b, c::{d}}`` -> ``a::b``, ``a::c::d``."""
    head, brace, inside = tree.strip().partition("{")
    if not brace:
        yield before + head.partition(" as ")[0].strip()
        return
    depth, start = 0, 0
    inside = inside.rpartition("}")[0] + ","
    for at, sign in enumerate(inside):
        depth += (sign == "{") - (sign == "}")
        if sign == "," and depth == 0:
            if inside[start:at].strip():
                yield from leaves(inside[start:at], before + head)
            start = at + 1


def paths_in(code: str) -> Iterator[str]:
    """All paths that begin with ``crate``, ``super`` or ``self``, imported or written out."""
    for found in re.finditer(r"\buse\s+((?:crate|super|self)::[^;]+);", code):
        yield from leaves(found[1])
    for found in re.finditer(r"(?<![\w:])((?:crate|super|self)(?:::\w+)+)", re.sub(r"\buse\s+[^;]+;", "", code)):
        yield found[1]


def imports(module: Module, texts: Texts) -> set[Module]:
    """The modules that a module takes names from, itself left out.

    A name that a ``mod.rs`` only hands on to those outside the core is an import from there: the file that defines a
    name is named.
    """
    used: set[Module] = set()
    for path in paths_in(texts[module]):
        parts = path.split("::")
        base: Module = () if parts[0] == "crate" else module
        while parts and parts[0] in ("crate", "super", "self"):
            base = base[:-1] if parts[0] == "super" else base
            parts = parts[1:]
        target = (*base, *parts)
        while target not in texts:
            target = target[:-1]
        used.add(target)
    return used - {module}


def from_above(texts: Texts) -> set[str]:
    """Imports that go up, as ``importer -> imported``; the root is above everything."""
    found = set()
    for module in filter(None, texts):
        allowed = LAYERS[: LAYERS.index(module[0]) + 1]
        targets = (target for target in imports(module, texts) if not target or target[0] not in allowed)
        found |= {f"{'::'.join(module)} -> {'::'.join(target) or 'lib'}" for target in targets}
    return found


def circle(texts: Texts) -> str:
    """Files that import one another in a circle, if there are any."""
    try:
        TopologicalSorter({module: imports(module, texts) for module in texts if module}).prepare()
    except CycleError as error:
        return " -> ".join("::".join(module) for module in error.args[1])
    return ""


TYPE = re.compile(r"^(?:pub(?:\([a-z]+\))? )?(?:struct|enum|trait) (\w+)", re.MULTILINE)
IMPL = re.compile(r"^impl(?:<[^{]*?>)? (?:[\w:<>', ]+ for )?(\w+)[^{]*\{\n(.*?)^\}", re.MULTILINE | re.DOTALL)
METHOD = re.compile(r"^    (?:pub(?:\([a-z]+\))? )?(?:const )?(?:async )?fn (\w+)", re.MULTILINE)


def methods_from_above(texts: Texts) -> set[str]:
    """Methods that a layer adds to a type of a layer below, called in a layer below: no import shows that.

    Only of names that nothing else has in the layers at or below the call, so that the name says which is meant.
    """
    height = {layer: number for number, layer in enumerate(LAYERS)}
    added: dict[str, set[Module]] = {}
    plain: dict[str, set[Module]] = {}
    for module in filter(None, texts):
        own = set(TYPE.findall(texts[module]))
        near = {target for target in imports(module, texts) if target and target[0] == module[0]}
        own |= {name for target in near for name in TYPE.findall(texts[target])}
        for block in IMPL.finditer(texts[module]):
            for name in METHOD.findall(block[2]):
                (plain if block[1] in own else added).setdefault(name, set()).add(module)
    found = set()
    for name, homes in added.items():
        lowest = min(height[home[0]] for home in homes | plain.get(name, set()))
        call = re.compile(rf"\bself\.{name}\(|\b(?:m|mechanism|solver|kept|all)\.{name}\(")
        for module in filter(None, texts):
            called = height[module[0]] < lowest and f".{name}(" in texts[module]
            if called and call.search(texts[module]):
                found.add(f"{'::'.join(module)}: {name} of {', '.join('::'.join(home) for home in sorted(homes))}")
    return found


def with_line(module: Module, line: str) -> Texts:
    return {**TEXTS, module: f"{line}\n{TEXTS[module]}"}


def test_every_module_has_a_layer() -> None:
    assert {module[0] for module in MODULES} == set(LAYERS)


def test_imports_only_from_the_layers_below() -> None:
    assert not from_above(TEXTS)


def test_no_files_import_one_another_in_a_circle() -> None:
    assert not circle(TEXTS)


def test_methods_that_lower_layers_call_are_written_there() -> None:
    assert not methods_from_above(TEXTS)


def test_the_drawing_in_the_crate_shows_the_layers() -> None:
    drawn = re.findall(r"^//! {4}(\w+)  ", (SOURCES / "lib.rs").read_text(encoding="utf-8"), re.MULTILINE)
    assert tuple(drawn) == LAYERS[::-1]


@pytest.mark.parametrize(
    "line",
    [
        "use crate::questions::worst::Worst;",
        "use crate::{math::real::Real, questions::{loaded::{Keep, Table}}};",
        "use super::super::nominal::trace;",
        "use crate::Status;",
        "fn f() -> crate::contact::state::Contact {}",
    ],
)
def test_an_import_from_above_is_found(line: str) -> None:
    assert from_above(with_line(("closure", "newton"), line))


def test_a_circle_is_found() -> None:
    line = "use super::newton::Solver;"
    assert "closure::newton" in circle(with_line(("closure", "equations"), line))


def test_a_method_from_above_is_found() -> None:
    line = "fn f(m: &Mechanism) { m.pressed_from_above(); }"
    added = "impl Mechanism {\n    pub fn pressed_from_above(&self) {}\n}"
    texts = {**with_line(("closure", "newton"), line), ("contact", "state"): added}
    assert len(methods_from_above(texts)) == 1
