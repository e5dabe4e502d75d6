"""A question is one declaration: what follows from it is there, and a new question touches few files.

A file mentions a question when it has the name as a word in quotes, or imports from its module.
"""

import ast
import inspect
import re
from pathlib import Path

import pytest

import jointplay as jp
from jointplay.analyses.questions import computation, options_of, public
from jointplay.cli.options import OF_QUESTIONS
from jointplay.plot.figures import curves
from jointplay.plot.panels import SHEETS
from jointplay.questions import QUESTIONS, asked_by, named
from jointplay.result import from_dataset

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "python" / "jointplay"
ASKERS = (
    "error",
    "map",
    "sweep",
    "compare",
    "allow",
    "life",
    "workspace",
    "allocate",
    "design",
    "assemble",
    "compensate",
    "forces",
    "studio",
)
#: beside the module of the question, its test and its two pages; CONTRIBUTING.md says why
ALWAYS = {"questions.py", "__init__.py"}
TOUCHED = {
    # `error` asks it of the worst offsets, and drives are corrected for it.
    "given": ALWAYS | {"cli/asking.py", "analyses/compensate.py"},
    # It has a command and a section of the report.
    "compensate": ALWAYS
    | {"cli/asking.py", "cli/commands.py", "cli/help.py", "cli/options.py"}
    | {"show/reporting/answers.py", "show/reporting/sections.py"},
}
#: arguments of the light forms by another name
CALLED = {"offset": "offsets", "first_order": "exact"}


def mentions(question: str, text: str, kind: str) -> bool:
    """Whether a file has the name of a question in its code."""
    if question not in text:
        return False
    if kind != ".py":
        return bool(re.search(rf"""["'`]{question}["'`]|[.]{question}\b""", text))
    tree = ast.parse(text)
    parts = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and node.value == question and id(node) not in parts:
            return True
        if isinstance(node, ast.ImportFrom):
            modules = (node.module or "").split(".")
            from_all = modules[-1] in ("", "analyses") and question in {alias.name for alias in node.names}
            if modules[-1] == question or from_all:
                return True
    return False


def touched(question: str) -> set[str]:
    """The source files that mention a question, its own module left out."""
    own = {PACKAGE / "analyses" / f"{question}.py", PACKAGE / "analyses" / question}
    files = [path for kind in ("py", "js", "css", "html") for path in PACKAGE.rglob(f"*.{kind}")]
    return {
        path.relative_to(PACKAGE).as_posix()
        for path in files
        if not own & {path, *path.parents} and mentions(question, path.read_text(encoding="utf-8"), path.suffix)
    }


@pytest.mark.parametrize("question", TOUCHED)
def test_a_question_touches_these_files_and_no_others(question: str) -> None:
    """`loaded` was spelled in 27 source files: whoever added a question had to find them all."""
    assert touched(question) == TOUCHED[question]


def test_a_new_question_touches_eight_files_at_most() -> None:
    """With its module, its test, and its places in two pages."""
    assert len(TOUCHED["given"]) + 4 <= 8


def test_contributing_names_the_files() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    section = text.split("## How to add a question")[1].split("\n## ")[0]
    files = re.findall(r"`(?:python/jointplay/)?([\w/]+\.\w+)`", section)
    assert TOUCHED["given"] | {"analyses/given.py"} <= set(files)


@pytest.mark.parametrize("name", QUESTIONS)
def test_a_declaration_names_what_there_is(name: str) -> None:
    question = QUESTIONS[name]
    assert callable(getattr(jp, name))
    assert set(question.asked_by) <= set(ASKERS)
    for package, dotted in (
        ("jointplay.analyses", f"{name}.{question.compute}"),
        ("jointplay.analyses", f"{name}.{question.options or name}"),
        ("jointplay.result.conclusions", question.conclusion),
        ("jointplay.result.table", question.overview or question.table),
    ):
        assert not dotted or callable(named(package, dotted)), dotted
    # What no command prints is said in no sentences.
    assert question.conclusion or not question.asked_by
    assert not question.sheet or question.sheet in SHEETS
    # What those who ask give themselves, it takes.
    known = inspect.signature(named("jointplay.analyses", f"{name}.{question.compute}")).parameters
    for options in question.asked_by.values():
        assert set(options) <= set(known)
    if question.asked_by:
        assert question.title
        assert question.figures
    assert ("map" in question.asked_by) == (question.chunk > 0)
    if "studio" in question.asked_by:
        assert question.label


@pytest.mark.parametrize("name", [name for name, question in QUESTIONS.items() if question.figures])
def test_the_figures_are_variables_of_its_results(name: str) -> None:
    m = jp.loads(jp.examples.text("four-bar"))
    m = m.with_(target={"line": {"fit": True}}) if QUESTIONS[name].needs_target else m
    m = m.with_({"limits.drive_torques.theta1": 1e6}) if name == "forces" else m
    options = {"samples": 16} if name == "random" else {}
    result = from_dataset(getattr(jp, name)(m, **options))
    assert {figure.variable for figure in QUESTIONS[name].figures.values()} <= set(result.data)


def test_options_of_commands_are_arguments_of_questions() -> None:
    known = {option for name, question in QUESTIONS.items() if question.asked_by for option in options_of(name)}
    assert {CALLED.get(name, name) for name in OF_QUESTIONS} <= known


@pytest.mark.parametrize("asker", ["sweep", "map", "compare", "allow", "life"])
def test_what_is_not_asked_here_is_refused_by_the_names_that_are(asker: str) -> None:
    with pytest.raises(jp.InputError) as refused:
        computation("studio", asker)
    assert all(name in str(refused.value) for name in asked_by(asker))
    assert all(callable(public(name)) for name in asked_by(asker))


def test_given_offsets_have_one_curve() -> None:
    """The residual of the closure was drawn beside the error, as if the drives had been corrected."""
    result = from_dataset(jp.given(jp.loads(jp.examples.text("four-bar")), {"J1": [0.5, 0]}))
    assert [curve.name for curve in curves(result, "position")] == ["given"]
