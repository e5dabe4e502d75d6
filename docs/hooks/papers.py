"""Makes the pages on published papers, their figures and tables, while the documentation is built."""

import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

MAKERS = Path(__file__).resolve().parents[2] / "examples" / "papers"


def run(maker: Path, folder: str) -> None:
    """Run one of the makers."""
    call = [sys.executable, str(maker), "--into", folder]
    done = subprocess.run(call, check=False, capture_output=True, text=True)
    if done.returncode:
        raise PluginError(f"{maker.name}: {done.stderr}")


@cache
def made() -> dict[str, bytes]:
    """All that the makers write, by its path."""
    with tempfile.TemporaryDirectory() as folder:
        with ThreadPoolExecutor() as pool:
            list(pool.map(lambda maker: run(maker, folder), sorted(MAKERS.glob("make_*.py"))))
        root = Path(folder)
        return {str(path.relative_to(root)): path.read_bytes() for path in sorted(root.rglob("*")) if path.is_file()}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages on papers."""
    for name, content in made().items():
        text = content.decode() if name.endswith(".md") else content
        files.append(File.generated(config, f"papers/{name}", content=text))
    return files
