"""Imports go one way, nothing heavy is imported before it is needed, and every module has its room."""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "python" / "jointplay"

#: each room may import from those before it, and a module from those of its own room
ROOMS = (
    "errors",
    "questions",
    "basics",
    "file",
    "core",
    "_core",
    "model",
    "examples",
    "result",
    "analyses",
    "exchange",
    "plot",
    "show",
    "cli",
    "__main__",
)
#: slow to import: only inside the function that needs them
HEAVY = {
    *("xarray", "pandas", "matplotlib", "plotly", "scipy", "h5netcdf", "h5py", "zarr"),
    *("dask", "distributed", "mujoco"),
}
#: faces and the package itself load rooms on demand, so that the command starts fast
ON_DEMAND = {"__init__", "cli", "__main__"}


#: what reads the specification of the core outside of `core`: all others ask the mechanism for what they need
READ_THE_SPECIFICATION = {
    "model/mechanism.py",
    # These make other mechanisms of it: a part with its own bodies, one with a target.
    "analyses/assemble/part.py",
    "analyses/map/reach.py",
    # Its text says whether a map on disk is of this mechanism.
    "analyses/map/__init__.py",
    # How wheels touch decides where their friction acts.
    "analyses/friction/couplings.py",
    # All of it is drawn or written in another format.
    *("exchange/contact_model.py", "exchange/drafting.py"),
    *("plot/scene.py", "show/viewer/geometry.py"),
}


class Import(NamedTuple):
    """One import statement: dotted name, line, and whether it runs when the module is imported."""

    name: str
    line: int
    at_import: bool


def modules() -> list[Path]:
    return sorted(path for path in PACKAGE.rglob("*.py") if "__pycache__" not in path.parts)


def dotted(path: Path) -> tuple[str, ...]:
    """``python/jointplay/plot/style.py`` -> ``("jointplay", "plot", "style")``; a package is its ``__init__``."""
    return (PACKAGE.name, *path.relative_to(PACKAGE).with_suffix("").parts)


def room(path: Path) -> str:
    return dotted(path)[1]


@cache
def imports(path: Path) -> list[Import]:
    """Every import of the module, those for the type checker left out."""
    package = dotted(path)[:-1]

    def visit(node: ast.AST, at_import: bool) -> Iterator[Import]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
                for other in child.orelse:
                    yield from visit(other, at_import)
            elif isinstance(child, ast.Import):
                for alias in child.names:
                    yield Import(alias.name, child.lineno, at_import)
            elif isinstance(child, ast.ImportFrom):
                base = package[: len(package) + 1 - child.level] if child.level else ()
                stem = ".".join((*base, child.module) if child.module else base)
                for alias in child.names:
                    yield Import(f"{stem}.{alias.name}", child.lineno, at_import)
            else:
                function = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
                yield from visit(child, at_import and not function)

    return list(visit(ast.parse(path.read_text(encoding="utf-8"), str(path)), at_import=True))


def inner(name: str) -> str | None:
    """The room that an import of our own package reaches; None for anything else."""
    parts = name.split(".")
    if parts[0] != PACKAGE.name:
        return None
    return parts[1] if len(parts) > 1 and parts[1] in ROOMS else "__init__"


def test_every_module_has_a_room() -> None:
    assert {room(path) for path in modules()} <= {*ROOMS, "__init__"}, "put it into a room, or give it a place in ROOMS"


def test_modules_import_only_from_their_own_room_and_those_before() -> None:
    """The public names are for users; inside, a module says which room it takes a thing from."""
    height = {name: k for k, name in enumerate(ROOMS)}
    inside = [path for path in modules() if room(path) != "__init__"]
    wrong = [
        f"{path}, line {i.line}: {i.name}"
        for path in inside
        for i in imports(path)
        if (to := inner(i.name)) is not None and height.get(to, len(ROOMS)) > height[room(path)]
    ]
    assert not wrong


def test_few_read_the_specification_of_the_core() -> None:
    """A change of it was a change of 44 files."""
    outside = [path for path in modules() if room(path) != "core"]
    reads = re.compile(r"\b(?:core_spec|in_core)\b|\.spec\(\)")
    found = {p.relative_to(PACKAGE).as_posix() for p in outside if reads.search(p.read_text(encoding="utf-8"))}
    assert found == READ_THE_SPECIFICATION


def test_no_module_hides_an_import_of_our_own() -> None:
    """A hidden import is the mark of two things in the wrong order."""
    inside = [path for path in modules() if room(path) not in ON_DEMAND]
    hidden = [f"{p}, line {i.line}: {i.name}" for p in inside for i in imports(p) if not i.at_import and inner(i.name)]
    assert not hidden


def test_only_what_draws_imports_anything_heavy_with_itself() -> None:
    inside = [path for path in modules() if room(path) not in ("plot", "show")]
    found = [(path, i) for path in inside for i in imports(path) if i.at_import and i.name.split(".")[0] in HEAVY]
    assert not [f"{path}, line {i.line}: {i.name}" for path, i in found]


def circle(graph: dict[str, set[str]]) -> list[str]:
    """Nodes that lead back to the first of them, if there are any."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def graph_of_imports() -> dict[str, set[str]]:
    """What each module imports of the others with itself, by dotted names; of a package that is its ``__init__``."""
    names = {".".join(dotted(path)).removesuffix(".__init__") for path in modules()}
    graph: dict[str, set[str]] = {}
    for path in (path for path in modules() if room(path) not in ON_DEMAND):
        own = ".".join(dotted(path)).removesuffix(".__init__")
        found = {i.name if i.name in names else i.name.rpartition(".")[0] for i in imports(path) if i.at_import}
        graph[own] = (found & names) - {own}
    return graph


def test_modules_do_not_import_one_another_in_a_circle() -> None:
    assert not circle(graph_of_imports())


def test_files_and_folders_of_a_room_do_not_import_one_another_in_a_circle() -> None:
    """Within a room imports go one way, too, from folder to folder."""

    def entry(name: str) -> str:
        # What a room exports itself is its __init__.
        return ".".join([*name.split("."), "__init__"][1:3])

    graph: dict[str, set[str]] = {}
    for name, found in graph_of_imports().items():
        graph.setdefault(entry(name), set()).update({entry(other) for other in found} - {entry(name)})
    assert not circle(graph)


def test_the_page_on_the_design_has_the_rooms_in_their_order() -> None:
    text = (ROOT / "docs" / "design.md").read_text(encoding="utf-8")
    table = text.partition("In `python/jointplay` ")[2].partition("\n\n")[2].partition("\n\n")[0]
    named = re.findall(r"^\| (.*?) \|", table, re.MULTILINE)
    assert re.findall(r"`(\w+)`", " ".join(named)) == [name for name in ROOMS if name != "__main__"]


def test_tests_are_in_the_folder_of_the_room_that_they_test() -> None:
    """What is of no room, such as formats, words and packages, is in `project`."""
    folders = {path.parent.relative_to(ROOT / "tests").as_posix() for path in (ROOT / "tests").rglob("test_*.py")}
    assert folders <= {*ROOMS, "project"}


def loaded_by(code: str) -> set[str]:
    """Top-level modules that are imported after a fresh interpreter has run the code."""
    code += "\nimport sys; print('MODULES', *sorted({name.partition('.')[0] for name in sys.modules}))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(run.stdout.rpartition("MODULES")[2].split())


def test_importing_the_package_imports_nothing_that_is_slow() -> None:
    slow = HEAVY | {"numpy", "pydantic", "typer", "rich"}
    assert not loaded_by("import jointplay") & slow


def test_help_is_printed_without_the_libraries_of_the_results() -> None:
    help_page = "import sys; sys.argv = ['jointplay', '--help']\nfrom jointplay.cli import main\n"
    assert not loaded_by(help_page + "try: main()\nexcept SystemExit: pass") & HEAVY


def test_every_public_name_can_be_had() -> None:
    code = "import jointplay as jp\nfor name in jp.__all__: getattr(jp, name)\nassert set(jp.__all__) <= set(dir(jp))"
    subprocess.run([sys.executable, "-c", code], check=True)
