"""What make says of a machine that lacks something, before it downloads or compiles anything."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]
RUST = PACKAGE["rust-version"]
PYTHON = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["requires-python"].removeprefix(">=")

#: a machine that has everything; what is called with anything but a question for its version tells
MACHINE = {
    "python3": 'case "$1 $2" in "-c import platform"*) echo 3.13.1;; -c*) ;; *) echo "did: python3 $*"; false;; esac',
    "cargo": 'case "$*" in *--version) echo "cargo 1.99.0 (0123 2026-01-01)";; *) echo "did: cargo $*"; false;; esac',
    "rustc": 'echo "rustc 1.99.0 (0123 2026-01-01)"',
    "cc": "exit 1",
    "c++": "exit 1",
}
BASICS = ("bash", "sh", "make", "sed", "sort", "head", "dirname", "find", "expand", "printf", "test", "mkdir", "touch")


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """As much of a clean clone as make reads."""
    clone = tmp_path / "clone"
    (clone / ".ci").mkdir(parents=True)
    (clone / "crates").mkdir()
    (clone / "benchmarks").mkdir()
    for name in ("Makefile", "Cargo.toml", "Cargo.lock", "pyproject.toml", ".ci/needs", "benchmarks/requirements.txt"):
        shutil.copy(ROOT / name, clone / name)
    return clone


def make(clone: Path, goal: str, **changes: str | None) -> subprocess.CompletedProcess[str]:
    """Make a goal on a machine with these changes; None takes a program away."""
    programs = clone.parent / "bin"
    programs.mkdir()
    for name in BASICS:
        if found := shutil.which(name):
            (programs / name).symlink_to(found)
    for name, script in (MACHINE | changes).items():
        if script is not None:
            (programs / name).write_text(f"#!/bin/bash\n{script}\n")
            (programs / name).chmod(0o755)
    environment = {"PATH": str(programs), "LC_ALL": "C"}
    return subprocess.run(
        [programs / "make", "-C", clone, goal], env=environment, capture_output=True, text=True, check=False
    )


def older(version: str) -> str:
    major, minor = version.split(".")[:2]
    return f"{major}.{int(minor) - 1}.3"


@pytest.mark.parametrize(
    ("goal", "changes", "lacking"),
    [
        ("build", {"rustc": f'echo "rustc {older(RUST)} (9fc6 2025-01-01)"'}, [f"Rust {RUST} or newer", older(RUST)]),
        ("build", {"cargo": 'echo "cargo 1.9.0"'}, [f"Rust {RUST} or newer", "'cargo' is 1.9.0"]),
        ("build", {"cargo": None, "rustc": None}, [f"Rust {RUST} or newer", "'rustc' was not found"]),
        ("build", {"python3": "echo 3.9.18"}, [f"Python {PYTHON} or newer", "'python3' is 3.9.18"]),
        ("build", {"python3": None}, [f"Python {PYTHON} or newer", "'python3' was not found"]),
        ("demo", {"python3": MACHINE["python3"].replace("-c*) ;;", "-c*) exit 1;;")}, ["venv and ensurepip"]),
        ("build", {"cc": None}, ["a C compiler"]),
        ("bench", {"rustc": 'echo "rustc 1.60.0"'}, [f"Rust {RUST} or newer", "1.60.0"]),
        ("test", {"c++": None}, ["a C++ compiler"]),
        ("test", {"cargo": 'test "$1" = --version && echo "cargo 1.99.0"'}, ["'cargo fmt'", "'cargo clippy'"]),
        ("check-rust", {"rustc": 'echo "rustc 1.60.0"'}, [f"Rust {RUST} or newer", "1.60.0"]),
    ],
)
def test_what_is_missing_is_said_before_anything_is_downloaded(
    clone: Path, goal: str, changes: dict[str, str | None], lacking: list[str]
) -> None:
    """An old cargo used to be noticed after pip had filled an environment, by an error from inside a dependency."""
    run = make(clone, goal, **changes)
    assert run.returncode == 2
    sentences = [line for line in run.stderr.splitlines() if line.startswith("jointplay needs ")]
    for words in lacking:
        assert any(words in sentence for sentence in sentences), run.stderr
    assert "did:" not in run.stdout
    assert not (clone / ".venv").exists()


def test_a_machine_that_has_everything_goes_on(clone: Path) -> None:
    """Without the C++ compiler, too, which only tests need: the next step is the environment."""
    run = make(clone, "build", **{"c++": None})
    assert "jointplay needs" not in run.stderr
    assert "did: python3 -m venv .venv" in run.stdout


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", "docs/install.md"])
def test_pages_name_the_versions_that_are_declared(page: str) -> None:
    text = (ROOT / page).read_text()
    assert re.search(rf"Rust\]?(\([^)]*\))? {re.escape(RUST)} or newer", text)
    assert f"Python {PYTHON} or newer" in text
