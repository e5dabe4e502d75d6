"""Draws the figures of the pages while the documentation is built, so that they show what the program draws now."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

#: figure -> the command that draws it, `--plot` apart
FIGURES = {
    "img/four-bar.png": ("new four-bar", "error four-bar.toml"),
    "img/map.png": ("new 3-rrr", "map 3-rrr.toml -g x=-150:150:151 -g y=-150:150:151 -g angle=0"),
}
#: exit codes of a drawing that was made: also of one that shows what is not ok
DRAWN = (0, 1)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the figures to what is built."""
    for name, commands in FIGURES.items():
        with tempfile.TemporaryDirectory() as folder:
            figure = Path(folder) / Path(name).name
            for command in commands:
                plot = ("--plot", str(figure)) if command == commands[-1] else ()
                call = [sys.executable, "-m", "jointplay", *command.split(), *plot]
                done = subprocess.run(call, cwd=folder, check=False, capture_output=True, text=True)
                if done.returncode not in DRAWN:
                    raise RuntimeError(f"{command}: {done.stderr}")
            files.append(File.generated(config, name, content=figure.read_bytes()))
    return files
