"""Imports go one way, nothing heavy is imported before it is needed, and every module has its layer."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "python" / "jointplay"

#: each layer may import from those before it, and a package from its own modules
LAYERS = (
    "errors",
    "questions",
    "typed",
    "files",
    "toml",
    "carried",
    "columns",
    "measured",
    "units",
    "confidence",
    "poses",
    "standards",
    "schema",
    "spec",
    "answers",
    "_core",
    "compile",
    "motion",
    "patterns",
    "document",
    "model",
    "builder",
    "gaps",
    "sizing",
    "mobility",
    "result",
    "verdict",
    "conclusions",
    "store",
    "cluster",
    "analyses",
    "spreadsheets",
    "write",
    "pages",
    "table",
    "plot",
    "display",
    "viewer",
    "reporting",
    "examples",
    "exchange",
    "serving",
    "cli",
    "__main__",
)
#: slow to import: only inside the function that needs them
HEAVY = {
    *("xarray", "pandas", "matplotlib", "plotly", "scipy", "h5netcdf", "h5py", "zarr"),
    *("dask", "distributed", "mujoco"),
}
#: faces and the package itself load layers on demand, so that the command starts fast
ON_DEMAND = {"__init__", "cli", "__main__"}


class Import(NamedTuple):
    """One import statement: dotted name, line, and whether it runs when the module is imported."""

    name: str
    line: int
    at_import: bool


def modules() -> list[Path]:
    return sorted(path for path in PACKAGE.rglob("*.py") if "__pycache__" not in path.parts)


def dotted(path: Path) -> tuple[str, ...]:
    """``python/jointplay/schema/file.py`` -> ``("jointplay", "schema", "file")``; a package is its ``__init__``."""
    return (PACKAGE.name, *path.relative_to(PACKAGE).with_suffix("").parts)


def layer(path: Path) -> str:
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
    """The layer that an import of our own package reaches; None for anything else."""
    parts = name.split(".")
    if parts[0] != PACKAGE.name:
        return None
    return parts[1] if len(parts) > 1 and parts[1] in LAYERS else "__init__"


def test_every_module_has_a_layer() -> None:
    assert {layer(path) for path in modules()} <= {*LAYERS, "__init__"}, "give it its place in LAYERS"


def test_modules_import_only_from_the_layers_before_theirs() -> None:
    """The public names are for users; inside, a module says which layer it takes a thing from."""
    height = {name: k for k, name in enumerate(LAYERS)}
    inside = [path for path in modules() if layer(path) != "__init__"]
    wrong = [
        f"{path}, line {i.line}: {i.name}"
        for path in inside
        for i in imports(path)
        if (to := inner(i.name)) is not None and height.get(to, len(LAYERS)) > height[layer(path)]
    ]
    assert not wrong


def test_no_module_hides_an_import_of_our_own() -> None:
    """A hidden import is the mark of a missing layer."""
    inside = [path for path in modules() if layer(path) not in ON_DEMAND]
    hidden = [f"{p}, line {i.line}: {i.name}" for p in inside for i in imports(p) if not i.at_import and inner(i.name)]
    assert not hidden


def test_only_what_draws_imports_anything_heavy_with_itself() -> None:
    inside = [path for path in modules() if layer(path) not in ("plot", "viewer", "reporting", "serving")]
    found = [(path, i) for path in inside for i in imports(path) if i.at_import and i.name.split(".")[0] in HEAVY]
    assert not [f"{path}, line {i.line}: {i.name}" for path, i in found]


def test_modules_do_not_import_one_another_in_a_circle() -> None:
    """In the packages as well, whose modules share a layer."""
    names = {".".join(dotted(path)).removesuffix(".__init__") for path in modules()}
    graph: dict[str, set[str]] = {}
    for path in (path for path in modules() if layer(path) not in ON_DEMAND):
        own = ".".join(dotted(path)).removesuffix(".__init__")
        found = {i.name if i.name in names else i.name.rpartition(".")[0] for i in imports(path) if i.at_import}
        graph[own] = (found & names) - {own}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"circle: {' -> '.join(error.args[1])}")


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
