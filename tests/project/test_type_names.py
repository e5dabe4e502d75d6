"""A type name has one meaning, so that a reader who has met it once knows it."""

import ast
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: names that still have two meanings or more in the core; no new one is added
MOST_IN_THE_CORE = 78

IN_RUST = re.compile(r"^(?:pub(?:\([^)]*\))? )?(?:struct|enum|trait|type|union) (\w+)", re.MULTILINE)
#: how names of types are written; constants are in upper case
TYPE = re.compile(r"_?[A-Z][a-z]\w*")


def in_python(text: str) -> Iterator[str]:
    """Classes, and names that a module gives to types."""
    tree = ast.parse(text)
    yield from (node.name for node in ast.walk(tree) if isinstance(node, ast.ClassDef))
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        yield from (t.id for t in targets if isinstance(t, ast.Name) and TYPE.fullmatch(t.id))


def twins(names: Iterable[tuple[Path, str]]) -> dict[str, list[str]]:
    """Names that are defined in more than one file, with the files."""
    found: dict[str, set[Path]] = {}
    for path, name in names:
        found.setdefault(name, set()).add(path)
    return {name: sorted(p.relative_to(ROOT).as_posix() for p in at) for name, at in found.items() if len(at) > 1}


def test_a_type_name_has_one_meaning_in_python() -> None:
    files = (ROOT / "python" / "jointplay").rglob("*.py")
    assert not twins((path, name) for path in files for name in in_python(path.read_text(encoding="utf-8")))


def test_no_further_type_name_has_two_meanings_in_the_core() -> None:
    sources = (ROOT / "crates" / "jointplay-core" / "src").rglob("*.rs")
    files = (path for path in sources if "tests" not in path.parts[len(ROOT.parts) :])
    found = twins((path, name) for path in files for name in IN_RUST.findall(path.read_text(encoding="utf-8")))
    assert len(found) <= MOST_IN_THE_CORE, found
