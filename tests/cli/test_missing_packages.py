"""Where a package that not everybody has is missing: one line that says how to get it, before any work."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import jointplay as jp

#: a command in a process that does not find a package
WITHOUT = "import sys; sys.modules[sys.argv[1]] = None; from jointplay.cli import run; sys.exit(run(sys.argv[2:]))"
#: by package: its extra, and commands that need it
NEEDING = {
    "matplotlib": (
        "plot",
        [
            "report m.toml -o r.html",
            "error m.toml --plot f.png",
            "animate m.toml -o f.gif",
            "studio m.toml --no-browser",
        ],
    ),
    "plotly": ("plot", ["map m.toml -g theta1=20:80:3 --plot f.html"]),
    "openpyxl": ("tables", ["error m.toml -o r.xlsx"]),
    "pyarrow": ("tables", ["error m.toml -o r.parquet"]),
    "ezdxf": ("dxf", ["export m.toml -o m.dxf", "import m.dxf -o n.toml"]),
    "mujoco": ("robots", ["import m.xml -o n.toml"]),
    "distributed": ("cluster", ["error m.toml -q random --scheduler tcp://127.0.0.1:1"]),
}


@pytest.mark.parametrize(("package", "words"), [(name, one) for name, (_, every) in NEEDING.items() for one in every])
def test_it_is_said_in_one_line_before_the_work(package: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(jp.examples.text("four-bar"), encoding="utf-8")
    (tmp_path / "m.xml").write_text("<mujoco/>", encoding="utf-8")
    (tmp_path / "m.dxf").write_text("0\nEOF\n", encoding="utf-8")
    before = {*tmp_path.iterdir()}
    call = [sys.executable, "-c", WITHOUT, package, *words.split()]
    done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert done.stderr.endswith(f"needs {package}: pip install 'jointplay[{NEEDING[package][0]}]'\n")
    assert {*tmp_path.iterdir()} == before
