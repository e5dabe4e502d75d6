"""What the README and the documentation say is done: commands run, code runs; and they say it in the field's words.

The blocks of one page share a directory and run in their order:

* ``console``: lines after ``$ `` are commands, lines under them what they print (``...`` stands for anything; nothing
  shown means nothing compared). ``# exit code 1`` after a command says how it ends, 0 if nothing is said.
* ``python``: run as they are, or as a doctest if they begin with ``>>>``; names live on to the next block of the page.
* ``toml title="NAME"``: a file of that name; other TOML blocks only have to be TOML.

Files that a page links to, other than pages and pictures, are there: the reader has saved them.
"""

import ast
import doctest
import io
import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from jointplay import cli

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
# Paper pages are written by their own programs, which have their own tests.
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.glob("*.md"))]
#: pages that show what a terminal of 80 characters shows; on others it has 120
NARROW = {"recipes.md"}
#: commands that set up a machine rather than use the program
SET_UP = ("make", "git", "pip", "cd", "python -m pip", "python -m venv", "source", "cargo", "maturin", ".venv/bin/")
FENCE = re.compile(r"^(?P<indent> *)```(?P<info>[^\n`]*)\n(?P<body>.*?)^(?P=indent)```\s*$", re.MULTILINE | re.DOTALL)
#: what makes a line more than one call of our command, and where the shell does not look for it
OF_THE_SHELL = re.compile(r"^(?!jointplay )|[|&;<>()$`\\*?~#]")
QUOTED = re.compile(r"'[^']*'")
EXIT_CODE = re.compile(r"\s+# exit code (\d)$")
#: phrases that readers had to guess at, and the field's terms for them; names of variables, options and keys stay
TERMS = {
    r"\bgo(?:es|ing)? together\b|\bwent together\b": "can be assembled; of keys: belong together",
    r"\b(?:are|was|were|be|been) told\b|\bis told (?:as|at|by|from|in|where|with)\b": "is reported, is given",
    r"\btold apart\b|\btells? (?:\w+ )?apart\b": "distinguishes",
    r"\bst(?:and|ands|anding|ood) still\b": "has converged; of bodies: does not move",
    r"\bunits? (?:that|which) (?:fits?|has|have|go|goes|can|cannot|stays?)\b": "specimen",
    r"\b(?:built|random|strained) units?\b|\bunit to unit\b|\b(?:share|%) of (?:all |the )?units\b": "specimen",
    r"\bfactor on (?:all |the )?clearances\b": "clearance scale factor required for assembly",
    r"\b(?:held|holds?) (?:\w+ ){0,3}more than once\b": "over-constrained, redundant constraint",
    r"\black of fit\b": "misfit",
    r"\bwhat (?:\w+ ){0,2}loads? bends?\b": "deformation under the load",
    r"\bbounds? of work\b": "limit of steps; of a value: upper bound",
    r"\blos(?:e|es|t) hold\b": "no longer constrains",
    r"\blargest work of the loads?\b": "the offsets are support points along the reactions",
}
OUTPUT = doctest.OutputChecker()
LENIENT = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


class Block(NamedTuple):
    """A fenced block of a page."""

    language: str
    title: str
    body: str
    line: int


class Command(NamedTuple):
    """A command of a console block and what the page shows of its output."""

    text: str
    exit_code: int
    output: str


def blocks(page: Path) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    found = []
    for match in FENCE.finditer(text):
        language, _, rest = match["info"].strip().partition(" ")
        title = re.search(r'title="([^"]+)"', rest)
        indent = len(match["indent"])
        body = "".join(line[indent:] for line in match["body"].splitlines(keepends=True))
        found.append(Block(language, title[1] if title else "", body, text.count("\n", 0, match.start()) + 1))
    return found


def commands(body: str) -> list[Command]:
    found: list[Command] = []
    for part in re.split(r"^\$ ", body, flags=re.MULTILINE)[1:]:
        first, _, output = part.partition("\n")
        ending = EXIT_CODE.search(first)
        found.append(Command(EXIT_CODE.sub("", first), int(ending[1]) if ending else 0, output.strip("\n")))
    return found


def run(command: Command, where: Path, columns: int) -> str:
    """Run a command as a reader would, in his folder; returns what is wrong, nothing if all is well."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    terminal = {"PATH": path, "NO_COLOR": "1", "TERM": "dumb", "COLUMNS": str(columns)}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        for name, value in terminal.items():
            patch.setenv(name, value)
        code, said = (by_itself if OF_THE_SHELL.search(QUOTED.sub("", command.text)) else in_this_process)(command.text)
    if code != command.exit_code:
        return f"exit code {code}, not {command.exit_code}\n{said}"
    if command.output and not OUTPUT.check_output(command.output + "\n", said, LENIENT):
        return f"prints\n{said}\nnot\n{command.output}"
    return ""


def in_this_process(line: str) -> tuple[int, str]:
    """The exit code of our command and what it prints, without another start of Python."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = cli.run(shlex.split(line)[1:])
    return code, out.getvalue() + err.getvalue()


def by_itself(line: str) -> tuple[int, str]:
    """The same of whatever a shell runs."""
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, timeout=300)
    return done.returncode, done.stdout + done.stderr


def run_python(block: Block, page: Path, names: dict[str, Any]) -> None:
    if not block.body.lstrip().startswith(">>>"):
        exec(compile(block.body, f"{page.name}:{block.line}", "exec"), names)
        return
    example = doctest.DocTestParser().get_doctest(block.body, names, page.name, str(page), block.line)
    report: list[str] = []
    runner = doctest.DocTestRunner(optionflags=LENIENT)
    result = runner.run(example, out=report.append, clear_globs=False)
    names.update(example.globs)
    assert not result.failed, "".join(report)


@pytest.mark.whole
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_a_page_says_can_be_done(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "page"}
    columns = 80 if page.name in NARROW else 120
    for linked in re.findall(r"\]\(([^):#]+)\)", page.read_text(encoding="utf-8")):
        source = page.parent / linked
        # What is made at the build has its links looked at there.
        if source.suffix not in (".md", ".png", "") and page.parent == DOCS and source.is_file():
            (tmp_path / source.name).write_bytes(source.read_bytes())
    for block in blocks(page):
        at = f"{page.name}, line {block.line}"
        if block.language == "console":
            for command in commands(block.body):
                if not command.text.startswith(SET_UP):
                    problem = run(command, tmp_path, columns)
                    assert not problem, f"{at}: $ {command.text}\n{problem}"
        elif block.language == "toml":
            tomllib.loads(block.body)
            if block.title:
                (tmp_path / block.title).write_text(block.body, encoding="utf-8")
        elif block.language == "python":
            run_python(block, page, names)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_block_is_of_a_kind_that_is_checked(page: Path) -> None:
    unknown = [
        (b.line, b.language) for b in blocks(page) if b.language not in ("console", "toml", "python", "text", "mermaid")
    ]
    assert not unknown, "write ```text for what is only to be read"


@pytest.mark.parametrize("page", PAGES[:2], ids=lambda page: page.name)
def test_links_of_pages_that_the_documentation_build_does_not_check(page: Path) -> None:
    targets = re.findall(r"\]\(([^):#]+)\)", page.read_text(encoding="utf-8"))
    assert [target for target in targets if not (ROOT / target).exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_make_targets_that_a_page_names_exist(page: Path) -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    named = set(re.findall(r"(?:`|\$ )make ([a-z-]+)", page.read_text(encoding="utf-8")))
    assert named <= targets


def texts() -> Iterator[tuple[str, str]]:
    """What users read, with where it is: pages, changes to come, comments of examples, docstrings and messages."""
    for page in [*PAGES, *sorted((ROOT / "examples" / "papers").glob("*/page.md"))]:
        yield str(page.relative_to(ROOT)), page.read_text(encoding="utf-8")
    for path in sorted(DOCS.glob("*.ipynb")):
        for number, cell in enumerate(json.loads(path.read_text(encoding="utf-8"))["cells"]):
            yield f"{path.name}, cell {number}", "".join(cell["source"])
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    yield "CHANGELOG.md", changes.partition("## [Unreleased]")[2].partition("\n## [")[0]
    package = ROOT / "python" / "jointplay"
    for path in sorted(package.rglob("*.toml")):
        yield path.name, path.read_text(encoding="utf-8").replace("#", " ")
    for path in sorted(package.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield f"{path.relative_to(package)}:{node.lineno}", node.value


def private_words(text: str) -> list[str]:
    """Phrases of a text that the field has other terms for, each with these. They may run over the end of a line."""
    plain = " ".join(text.split())
    found = ((match[0], use) for term, use in TERMS.items() for match in re.finditer(term, plain, re.IGNORECASE))
    return [f"'{phrase}': {use}" for phrase, use in found]


def test_users_read_the_words_of_the_field() -> None:
    found = [f"{where}: {problem}" for where, text in texts() for problem in private_words(text)]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "sentence",
    [
        "It goes together near its start.",
        "Offsets are told in the axes of the joint.",
        "The outcomes cannot be told\n    apart.",
        "The output stands still.",
        "Units that fit without strain are counted.",
        "The share of the units beyond the limits.",
        "It scatters from unit to unit.",
        "The smallest factor on all clearances.",
        "Where joints hold the bodies more than once.",
        "The lack of fit is largest there.",
        "What the loads bend is added.",
        "It ended at its bound of work.",
        "The joints lose hold.",
        "It is the pose of largest work of the loads.",
    ],
)
def test_private_words_are_found(sentence: str) -> None:
    assert private_words(sentence)


@pytest.mark.parametrize("sentence", ["Values in units of the file.", "The bodies move together.", "`lack_of_fit`"])
def test_other_words_are_not(sentence: str) -> None:
    assert not private_words(sentence)
