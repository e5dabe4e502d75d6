"""Draws the figures of the pages while the documentation is built, so that they show what the program draws now.

A page names a figure once, as ``img/NAME.png``. There is a light and a dark one of each; readers see the one of the
colours they read in.
"""

import re
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

DOCS = Path(__file__).resolve().parents[1]
#: figure -> the commands that draw it, `--plot` apart
FIGURES = {
    "img/home.png": (
        "new four-bar",
        "error four-bar.toml --panel mechanism --configuration 0 --size 100x90mm --dpi 250",
    ),
    "img/four-bar.png": ("new four-bar", "error four-bar.toml --size 200mm --dpi 220"),
    "img/pump.png": (
        "import {docs}/cad/pump.FCStd --planar --fit H7/g6 --drives Main=0:360:13 --output-point Slider",
        "error pump.toml --panel mechanism --configuration 1 --size 160x80mm --dpi 220",
    ),
    "img/map.png": ("new 3-rrr", "map 3-rrr.toml -g x=-150:150:151 -g y=-150:150:151 -g angle=0"),
}
STYLES = ("light", "dark")
#: exit codes of a drawing that was made: also of one that shows what is not ok
DRAWN = (0, 1)
IMAGE = re.compile(r"(?P<start>!\[[^\]]*\]\([^)\s]*)\.png\)(?P<attributes>\{[^}]*\})?")


@cache
def drawn(name: str, style: str) -> bytes:
    """A figure in a style."""
    with tempfile.TemporaryDirectory() as folder:
        figure = Path(folder) / Path(name).name
        for command in FIGURES[name]:
            plot = ("--plot", str(figure), "--style", style) if command == FIGURES[name][-1] else ()
            call = [sys.executable, "-m", "jointplay", *(word.format(docs=DOCS) for word in command.split()), *plot]
            done = subprocess.run(call, cwd=folder, check=False, capture_output=True, text=True)
            if done.returncode not in DRAWN:
                raise PluginError(f"{command}: {done.stderr}")
        return figure.read_bytes()


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the figures to what is built."""
    for name in FIGURES:
        for style in STYLES:
            files.append(File.generated(config, name.replace(".", f"-{style}."), content=drawn(name, style)))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Both figures in place of the one that a page names."""

    def both(found: re.Match[str]) -> str:
        name = found["start"].rpartition("(")[2] + ".png"
        if name not in FIGURES:
            return found[0]
        attributes = found["attributes"] or ""
        return "".join(f"{found['start']}-{style}.png#only-{style}){attributes}" for style in STYLES)

    return IMAGE.sub(both, markdown)
