"""Draws the figures of the pages while the documentation is built, so that they show what the program draws now."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

#: figure -> the command that draws it, `--plot` apart
FIGURES = {"img/four-bar.png": ("new four-bar", "error four-bar.toml")}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the figures to what is built."""
    for name, commands in FIGURES.items():
        with tempfile.TemporaryDirectory() as folder:
            figure = Path(folder) / Path(name).name
            for command in commands:
                plot = ("--plot", str(figure)) if command == commands[-1] else ()
                call = [sys.executable, "-m", "jointplay", *command.split(), *plot]
                subprocess.run(call, cwd=folder, check=True, capture_output=True)
            files.append(File.generated(config, name, content=figure.read_bytes()))
    return files
