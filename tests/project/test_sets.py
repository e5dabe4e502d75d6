"""A set of offsets is declared once in Python, in `core/sets.py`: others read what it says and do not ask its name."""

import ast
import re
from pathlib import Path

from jointplay.core.sets import BOUNDS, SETS, WHOLE

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "python" / "jointplay"
#: where such a word means something else
OTHERWISE = {
    # The largest of a workspace.
    **{file: {"disc", "ball"} for file in ("analyses/workspace/__init__.py", "result/table/workspace.py")},
    "result/conclusions/workspace.py": {"disc", "ball"},
    "exchange/outlines.py": {"disc"},
    # What `rubs` and `slides` say.
    "analyses/friction/laws.py": {"ball", "journal"},
    "analyses/friction/rest.py": {"ball"},
    "analyses/friction/states.py": {"ball", "journal"},
    "analyses/life/sliding.py": {"ball", "guide", "plate"},
    # Joints of other formats, what is drawn of joints, and what has a gap on each side.
    **{key: {"ball"} for key in ("exchange/contact_spatial.py", "exchange/sdf.py", "exchange/urdf.py")},
    "show/viewer/geometry.py": {"ball", "guide"},
    "file/schema/clearances.py": {"plate"},
}
#: how many files read the declarations
READERS = 5


def words(path: Path) -> set[str]:
    """The texts of a module."""
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}


def test_sets_are_named_in_one_file() -> None:
    """Twenty-four named them: a new set was a change of all that listed them."""
    every = {path.relative_to(PACKAGE).as_posix(): words(path) & {*SETS} for path in PACKAGE.rglob("*.py")}
    assert {file: names for file, names in every.items() if names} == {"core/sets.py": {*SETS}, **OTHERWISE}


def test_few_files_read_the_declarations() -> None:
    reads = re.compile(r"\bimport [^\n]*\bSETS\b")
    assert len([path for path in PACKAGE.rglob("*.py") if reads.search(path.read_text(encoding="utf-8"))]) == READERS


def test_the_core_has_the_same_sets_with_the_same_sizes() -> None:
    text = (ROOT / "crates" / "jointplay-core" / "src" / "clearance" / "mod.rs").read_text(encoding="utf-8")
    body = text.partition("pub enum Set {")[2].partition("\n}\n")[0]
    found = re.findall(r"^    (\w+)(?: \{|\()(.*?)^    [})]", body, re.MULTILINE | re.DOTALL)
    core = {name.lower(): {*re.findall(r"^        (\w+): f64", inner, re.MULTILINE)} for name, inner in found}
    assert core == {name: {*one.sizes} for name, one in SETS.items()}
    assert {size for one in SETS.values() for size in one.sizes} == {*BOUNDS, *WHOLE}
