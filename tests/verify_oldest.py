"""The tests with the oldest packages that jointplay says it works with, in an environment of their own.

`verify_oldest.py [TESTS ...]`; without names those of all rooms that packages matter to. A version that was said to do
and did not went unseen while every environment had the newest.
"""

import os
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: what `pip install 'jointplay[...]'` names
EXTRAS = ("plot", "tables", "dxf")
#: packages that only tests need, and tests that need more of those
TOOLS = ("hypothesis", "ipykernel", "jsonschema", "mypy", "pressfit", "pytest", "pytest-xdist", "ruff")
#: what older packages do otherwise: ticks and meshes of matplotlib, the last digit that pandas reads
OTHERWISE = ("test_colours_over_two_axes", "test_numbers_of_legends_and_axes", "test_numbers_to_take_along")
ROOMS = ("basics", "file", "model", "result", "plot", "cli", "exchange/test_dxf.py", "show/test_report.py")


def oldest() -> list[str]:
    """The lowest version of every package."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = [one for name in EXTRAS for one in project["optional-dependencies"][name]]
    return [f"{one.replace('>=', '==')}.*" for one in (*project["dependencies"], *extras)]


def main(tests: list[str]) -> int:
    """Run them; the exit code of pytest."""
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        python = Path(folder, "Scripts" if os.name == "nt" else "bin", "python")
        subprocess.run([python, "-m", "pip", "install", "--quiet", *oldest(), *TOOLS], check=True)
        # Old packages tell of functions that will go.
        options = ["-q", "--budget", "0.1", "-o", "filterwarnings=default", "-p", "no:cacheprovider", "-n", "auto"]
        options += ["-k", f"not ({' or '.join(OTHERWISE)})"]
        paths = [f"tests/{name}" for name in tests or ROOMS]
        done = subprocess.run(
            [python, "-m", "pytest", *options, *paths],
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT / "python")},
            check=False,
        )
    return done.returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
