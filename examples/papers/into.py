"""What the makers of the pages share: where they write."""

import argparse
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[2] / "build" / "papers"


def folder(description: str) -> Path:
    """The folder that the command line names, with one for figures in it."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--into", type=Path, default=FOLDER, help="the folder to write into; build/papers if left out")
    found: Path = parser.parse_args().into
    (found / "img").mkdir(parents=True, exist_ok=True)
    return found
