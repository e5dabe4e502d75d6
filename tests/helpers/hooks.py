"""The parts of the build of the documentation, as modules."""

import functools
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "hooks"


@functools.cache
def hook(name: str) -> ModuleType:
    """A part of the build."""
    spec = importlib.util.spec_from_file_location(f"docs_{name}", FOLDER / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # Data classes look their module up there.
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
