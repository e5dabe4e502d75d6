"""What packages say of themselves is said in several files: they agree."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
VERSION = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]
RECIPE = (ROOT / "packaging" / "conda" / "recipe.yaml").read_text()
CITATION = (ROOT / "CITATION.cff").read_text()
WORKFLOW = (ROOT / ".github" / "workflows" / "wheels.yml").read_text()


def test_versions_agree() -> None:
    shown = subprocess.run([sys.executable, "-m", "jointplay", "--version"], capture_output=True, text=True, check=True)
    assert shown.stdout.split() == ["jointplay", VERSION]
    assert re.findall(r"^version: (.*)", CITATION, re.MULTILINE) == [VERSION]
    assert re.findall(r'^  version: "(.*)"', RECIPE, re.MULTILINE) == [VERSION]


def test_the_conda_recipe_needs_what_the_wheel_needs() -> None:
    listed = RECIPE.partition("  run:\n")[2].partition("\n\n")[0]
    needed = {line.strip(" -").replace(" ", "") for line in listed.splitlines()}
    assert needed == {f"python{PROJECT['requires-python']}", *PROJECT["dependencies"]}


def test_authors_and_licences_agree() -> None:
    (author,) = PROJECT["authors"]
    assert f"Copyright (c) 2026 {author['name']}" in (ROOT / "LICENSE-MIT").read_text()
    assert f"- name: {author['name']}\n" in CITATION
    assert all(f"- {name}\n" in CITATION for name in PROJECT["license"].split(" OR "))
    assert f"license: {PROJECT['license']}\n" in RECIPE


def test_wheels_are_built_with_the_oldest_python_that_is_supported() -> None:
    oldest = PROJECT["requires-python"].removeprefix(">=")
    assert f'python-version: "{oldest}"' in WORKFLOW
    assert f"python {oldest}.*" in RECIPE
    assert f"Programming Language :: Python :: {oldest}" in PROJECT["classifiers"]


def test_wheels_are_published_only_after_they_and_the_tests_have_run() -> None:
    assert "if: startsWith(github.ref, 'refs/tags/v')\n    needs: [test, wheel, sdist]" in WORKFLOW
    assert "run: bash .ci/run" in WORKFLOW
