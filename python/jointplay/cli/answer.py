"""Ask, then print, write and draw; after Ctrl-C what is done until then."""

from __future__ import annotations

import inspect
import os
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from jointplay.basics.progress import bar
from jointplay.errors import InputError

from . import DONE, INTERRUPTED, NOT_OK
from .arguments import assignments, numbers, value
from .printing import Printing, printed
from .streams import hold, tell

if TYPE_CHECKING:
    from jointplay.model.mechanism import Mechanism
    from jointplay.result import Result
    from jointplay.result.table import Console

    from .drawing import FigureFile

#: characters of a line that is not read on a terminal
PLAIN = 80


def mechanism(
    file: str,
    settings: Sequence[str] | Mapping[str, str] | None,
    output: str | None = None,
    load_case: str | None = None,
) -> Mechanism:
    """The mechanism of a file with changes, perhaps with one of its outputs or load cases only.

    What a key with a `*` reached goes to stderr, when there is an answer.
    """
    from jointplay.model.mechanism import load

    pairs = settings if isinstance(settings, Mapping) else assignments(settings or (), "--set")
    m = load(file)
    m = change(m, {key: value(text, key) for key, text in pairs.items()}) if pairs else m
    return m.only(output, load_case)


def change(m: Mechanism, settings: Mapping[str, object]) -> Mechanism:
    """A changed copy; what a key with a `*` reached goes to stderr, when there is an answer."""
    from jointplay.model.mechanism import changed

    copy, reached = changed(m, settings)
    hold(reached)
    return copy


def reader(m: Mechanism) -> Callable[[str], float]:
    """Finds the values of expressions in the variables of a mechanism."""
    from jointplay.file.schema import NotAnExpression, Variables, variables_of

    variables = Variables(*variables_of(m.raw))

    def read(text: str) -> float:
        try:
            return variables.number(text)
        except NotAnExpression as problem:
            raise ValueError(str(problem)) from None

    return read


def offsets(m: Mechanism, given: Sequence[str] | None) -> dict[str, Any]:
    """Offsets by name."""
    pairs = assignments(given or (), "--offset")
    return {name: numbers(text, f"--offset {name}", None, reader(m)) for name, text in pairs.items()}


def target(m: Mechanism, text: str | None) -> Any:
    """An error to reach."""
    return None if text is None else numbers(text, "--target", (2, 3, 6), reader(m))


def require_other(output: Path | None, *read: str | None) -> None:
    """Refuse to replace a file that is read."""
    for name in read:
        if output is not None and name is not None and output.exists() and _is_same(output, name):
            raise InputError("is a file that is read; name another one", file=os.fspath(output), key="--output")


def _is_same(path: Path, name: str) -> bool:
    try:
        return path.samefile(name)
    except OSError:
        # An example by its name, or a stream.
        return False


def file_as_built(output: Path | None) -> Path | None:
    """Where a mechanism file goes; None where a result is written, or nothing.

    Raises
    ------
    InputError
        When nothing can be written there.
    """
    from jointplay.basics.files import require_writable
    from jointplay.result.write import check_path

    if output is not None and output.suffix.lower() == ".toml":
        require_writable(output)
        return output
    if output is not None:
        check_path(output, (".toml",))
    return None


def check_paths(output: Path | None) -> None:
    """Refuse what cannot be written before the work, not after it."""
    if printed().csv_dialect != Printing.csv_dialect and (output is None or output.suffix.lower() != ".csv"):
        raise InputError("says how a .csv is written; -o NAME.csv says where it goes", key="--csv-dialect")
    if output is not None:
        from jointplay.result import write

        write.check_path(output)


def answer(
    questions: Mapping[str, Callable[..., Result]],
    m: Mechanism,
    output: Path | None,
    plot: FigureFile,
    holds: Callable[[Result], bool] | None = None,
) -> int:
    """Ask the questions one after the other, then print or write what they say.

    Returns
    -------
    int
        Exit code; of a single question `holds` can say whether its answer is good.
    """
    return answered(questions, m, output, plot, holds)[0]


def answered(
    questions: Mapping[str, Callable[..., Result]],
    m: Mechanism,
    output: Path | None,
    plot: FigureFile,
    holds: Callable[[Result], bool] | None = None,
) -> tuple[int, dict[str, Result]]:
    """The exit code of `answer`, and the results."""
    from jointplay.analyses.nominal import Interrupted

    check_paths(output)
    plot.check(m, questions)
    results: dict[str, Result] = {}
    interrupted = False
    for name, ask in questions.items():
        try:
            results[name] = _asked(name, ask, m)
        except Interrupted as stopped:
            results[name] = stopped.partial
            interrupted = True
            break
        except KeyboardInterrupt:
            if not results:
                raise
            interrupted = True
            break
    if interrupted:
        sys.stderr.write("interrupted; what is done:\n" if output is None else "interrupted; what is done is written\n")
    tell()
    try:
        # Before anything is printed, which its reader may cut off.
        plot.draw(m, results)
    finally:
        if output is not None:
            save(results, output)
        else:
            show(results, [*_explained(m, results)])
    if interrupted:
        return INTERRUPTED, results
    is_good = all(map(holds or _is_good, results.values())) and (holds is not None or _holds_as_a_whole(results))
    return DONE if is_good else NOT_OK, results


def _holds_as_a_whole(results: Mapping[str, Result]) -> bool:
    """Whether no limit is left that none of the questions has judged."""
    from jointplay.result import parts
    from jointplay.result.conclusions import decide
    from jointplay.result.verdict import NOT_SHOWN

    whole = decide({name: parts(result) for name, result in results.items()})
    return whole is None or whole.state != NOT_SHOWN


def changed(
    base: Callable[[], Mechanism], found: Result, to_file: Path | None, nothing: str, *, is_shown: bool
) -> None:
    """Write the mechanism with the values that were found, and print them, where that is asked.

    Parameters
    ----------
    base : callable
        Gives the mechanism whose values are changed.
    found : Result
        With the attribute `changes`, if there are such values.
    nothing : str
        Why there is no file where there are none.
    is_shown : bool
        Whether they are printed.
    """
    lines = str(found.attrs.get("changes", "")).splitlines()
    if to_file is not None and "changes" in found.attrs:
        pairs = assignments(lines, "--set")
        base().with_({key: value(text, key) for key, text in pairs.items()}).write(to_file)
    elif to_file is not None:
        hold([f"{to_file} is not written: {nothing}"])
        tell()
    for line in lines if is_shown else ():
        typer.echo(f"--set {shlex.quote(line)}")


def _is_good(result: Result) -> bool:
    """Whether every configuration is ok, with every joint closed where that is asked, and the limits hold."""
    from jointplay.result.verdict import is_good

    if result.attrs["question"] == "solve" and "misfit" in result.attrs:
        return False
    return is_good(result)


def save(results: Mapping[str, Result], output: Path) -> None:
    """Write results as one file, in the dialect that was asked for."""
    from jointplay.exchange.saving import save_all

    save_all(results, output, csv_dialect=printed().csv_dialect)


def _asked(name: str, ask: Callable[..., Result], m: Mechanism) -> Result:
    if "progress" not in inspect.signature(ask).parameters:
        return ask(m)
    with bar(name) as progress:
        return ask(m, progress=progress)


def _explained(m: Mechanism, results: Mapping[str, Result]) -> Iterator[str]:
    """What may be in another unit, and where a mechanism stays open that cannot be assembled."""
    from jointplay.analyses.hints import hints

    yield from (f"Hint: {hint}" for hint in hints(m))
    every = results.values()
    failed = any(r.get("status").ndim == 1 and (r.get("status") == "not_assembled").any() for r in every)
    if not failed or any("failure" in r.attrs for r in every) or m.drive_values is None:
        return
    from jointplay.analyses.failure import failure

    found = failure(m)
    yield from () if found is None else found.words


def show(results: Mapping[str, Result], remarks: Sequence[str] = ()) -> None:
    """Print results: the answers first, then tables that fit."""
    from jointplay.result.table import screen, show

    first = next(iter(results.values()))
    answers, tables = screen(results)
    title = str(first.attrs["title"] or first.attrs["file"])
    show(title, answers, tables, _console(), remarks=remarks, every=printed().every)


def list_names(titles: Mapping[str, str], first: str) -> None:
    """Print names with what they are, under a first sentence."""
    from jointplay.result.table import show_names

    show_names(first, titles, _console())


def _console() -> Console:
    """Where it is printed: as wide as the terminal, or as COLUMNS says; 80 characters where there is no terminal."""
    from jointplay.result.table import Console

    return Console(width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else PLAIN, highlight=False)
