"""The sections of a report, in the order in which a reader needs them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from platform import python_version
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from jointplay import plot
from jointplay.analyses import ordering, pressed
from jointplay.analyses.hints import hints
from jointplay.errors import listed, one_line
from jointplay.model.mechanism import Mechanism
from jointplay.model.sizing import sizings
from jointplay.plot.figures import limits_of, worst_of
from jointplay.plot.sheet import separate, sheet
from jointplay.plot.ticks import subplot
from jointplay.questions import QUESTIONS
from jointplay.result import Result, blame, figure, in_words, today
from jointplay.result.conclusions import Sentence, conclude, decide
from jointplay.result.table import tables
from jointplay.result.table.html import folded, paragraphs, table
from jointplay.result.table.layout import NOTHING, Column, ResultTable
from jointplay.result.verdict import HELD, MISSED, NOT_SHOWN, cause, place, verdict

from . import former, maps
from .answers import JUDGED, Answers, Chapter, directions
from .drawing import WORDS, drawing, embedded
from .figures import blank, download, numbers, picture, settings

QUANTITIES = ("position", "rotation")
#: in front of verdicts
SYMBOLS = {HELD: "✓", MISSED: "✗", NOT_SHOWN: "?"}
#: variables that stand behind a figure of errors
ERRORS = {
    "worst": ("worst_position", "worst_rotation", "worst_component", "limit", "status"),
    "loaded": ("error", "undetermined", "limit", "status"),
    "random": ("error_mean", "error_std", "error_quantile", "outside", "limit", "status"),
}


@dataclass(frozen=True)
class Section:
    """A heading with what stands below it, in HTML."""

    title: str
    content: str


def of_chapter(chapter: Chapter) -> Iterator[Section]:
    """The sections on one output."""
    always = {
        "Verdict": _verdict,
        "The mechanism": _mechanism,
        "Errors along the path": _errors,
        "Which source is to blame": _blame,
    }
    makers = {
        "sizes": ("Error against clearances and tolerances", _sizes),
        "random": ("Scatter from specimen to specimen", _scatter),
        "loaded": ("Reactions in the joints", _reactions),
        "allow": ("How large clearances and tolerances may be", _allowed),
        "forces": ("Forces with play", _forces),
        "structural": ("Structural error", _structural),
        "life": ("Wear and life", _life),
        "compensate": ("Compensation", _compensation),
        "singularities": ("Distance from singularities", _singularities),
    }
    asked = dict(title_and_maker for question, title_and_maker in makers.items() if question in chapter.results)
    for title, make in (always | asked).items():
        with settings():
            content = make(chapter)
        yield Section(title, content)
    if chapter.reasons:
        yield Section("What was not asked", _not_asked(chapter))


def worst_place(chapter: Chapter) -> int:
    """The configuration with the largest position error."""
    question = next(name for name in ("worst", "random", "loaded") if name in chapter.results)
    return int(np.nan_to_num(figure(chapter.parts(question)[0][1], "position")[0]).argmax())


def _verdict(chapter: Chapter) -> str:
    items = []
    # What holds whatever is asked is said once.
    already: set[Sentence] = set()
    for question in JUDGED:
        words = QUESTIONS[question].label
        for heading, part in chapter.parts(question):
            sentences = [sentence for sentence in conclude(part).sentences if sentence not in already]
            already.update(sentence for sentence in sentences if sentence.is_common)
            label = ", ".join(filter(None, (words, heading)))
            mark = marked(verdict(part).outcome)
            if sentences:
                said = paragraphs([sentence.text for sentence in sentences])
                said += paragraphs([f"Assumed: {QUESTIONS[question].assumes}"], "note")
                items.append(f"<dt>{escape(label)} {mark}</dt><dd>{said}</dd>")
    # The verdict over all outputs stands above.
    lead = whole([chapter]) if chapter.output else ""
    return lead + paragraphs(_summary(chapter)) + (f"<dl>{''.join(items)}</dl>" if items else "")


def whole(chapters: Sequence[Chapter]) -> str:
    """The verdict over all questions, of all outputs together."""
    found: dict[str, list[tuple[str, Result]]] = {}
    for chapter in chapters:
        output = f"Output {chapter.output}" if len(chapters) > 1 else ""
        for question in JUDGED:
            own = [(", ".join(filter(None, (output, heading))), part) for heading, part in chapter.parts(question)]
            found.setdefault(question, []).extend(own)
    said = decide(found)
    if said is None:
        return paragraphs(["No verdict: the file has no limits that errors could be held against."], "answer")
    return f'<p class="answer">{marked(said.state)} {escape(said.text)}</p>'


def marked(outcome: str) -> str:
    """A verdict as a mark that is read without colours, too."""
    if not outcome:
        return ""
    return f'<strong class="{outcome.replace(" ", "-")}">{SYMBOLS[outcome]} {outcome}</strong>'


def _summary(chapter: Chapter) -> list[str]:
    """The largest error, where it is, and what causes it."""
    said = []
    if "worst" in chapter.results:
        part = chapter.parts("worst")[0][1]
        at = worst_place(chapter)
        value, unit = float(part.get("worst_position")[at]), part.unit("worst_position")
        found = cause(part, "position", "high", at)
        whose = f"; to blame first: {in_words(*found)}" if found else ""
        said.append(f"The largest possible position error is {value:.4g} {unit}, at {place(part, at)}{whose}.")
    return said


def _mechanism(chapter: Chapter) -> str:
    """The drawing to play with; where no program runs, and on paper, a picture of it."""
    m = chapter.m.first
    data = drawing(chapter)
    words = (
        "Move the slider through the configurations; drag to turn (in the plane: to shift), press Ctrl and turn the "
        "wheel to zoom, double-click to start again. Errors and clearances are magnified by the stated factor. "
        "The shaded region is where the output point can be as far as clearances and tolerances let it, on the exact "
        f"closure, looked for in {directions(m)} directions; dots are random specimens."
    )
    still = blank(7.4, 5.0)
    plot.mechanism(m, _first(chapter), axes=subplot(still))
    files: dict[str, str] = {}
    if "region" in chapter.results:
        files["region.csv"] = numbers(chapter.results["region"], ("region", "extent", "region_direction"))
    picture_ = picture(still, f"{m.title}, configuration {_first(chapter)}", files)
    return (
        f"{embedded(data)}"
        f'<p class="note screen">{escape(words)}</p>{folded("Still picture, and the region as numbers", picture_)}'
    )


def _drawn(draw: Callable[..., Figure], *args: Any, **options: Any) -> Figure:
    """A figure that has half the width of the page."""
    figure = blank(5.2, 4.0)
    draw(*args, **options, axes=subplot(figure))
    return figure


def _first(chapter: Chapter) -> int:
    return int(np.isfinite(chapter.at.poses).all(axis=(1, 2)).argmax())


def _labelled(chapter: Chapter, questions: Sequence[str]) -> dict[str, Result]:
    found = {}
    for question in questions:
        for heading, part in chapter.parts(question):
            found[heading or question] = part
    return found


def _errors(chapter: Chapter) -> str:
    curves = _labelled(chapter, tuple(WORDS))
    files = {f"{name}.csv": numbers(chapter.results[name], ERRORS[name]) for name in WORDS if name in chapter.results}
    figures = [_drawn(plot.error, curves, quantity) for quantity in (*QUANTITIES, *_limited([*curves.values()]))]
    said = "Size of the error by question; of random specimens the 95 % quantile. Limits are dashed."
    blocks = [folded(f"Table: {label}", table(found)) for label, part in curves.items() for found in tables(part)]
    return picture(figures, said, files) + "".join(blocks)


def _limited(results: Sequence[Result]) -> list[str]:
    """The components that have a limit."""
    return [name for name in results[0].labels("component") if limits_of(results, name)]


def _blame(chapter: Chapter) -> str:
    at = worst_place(chapter)
    every = [
        (question, ", ".join(filter(None, (WORDS[question], heading))), part)
        for question in ("worst", "loaded", "random")
        for heading, part in chapter.parts(question)
    ]
    _, label, first = every[0]
    figures = [_drawn(plot.pareto, first, "position", at), _drawn(plot.blame, first)]
    said = f"{label[:1].upper()}{label[1:]}: sources of the position error at {place(first, at)}, and along the path."
    links = [(f"contribution-{question}.csv", numbers(part, ("contribution",))) for question, _, part in every]
    shown = picture(figures, said, dict(links[:1]))
    if not every[1:]:
        return shown
    rest = "".join(download(*link) for link in links[1:])
    shares = table(_shares([(label, part) for _, label, part in every[1:]], at))
    return shown + folded("The same of other questions and load cases", f"{shares}<p>{rest}</p>")


def _shares(every: Sequence[tuple[str, Result]], at: int) -> ResultTable:
    """Whose part of the position error is how large, question by question, the largest parts first."""
    found = [(label, blame(part)) for label, part in every]
    causes = list(dict.fromkeys(cause for _, one in found for cause in one.causes))
    rows = [dict(zip(one.causes, 100.0 * one.position[at], strict=True)) for _, one in found]
    shares = np.array([[row.get(cause, np.nan) for row in rows] for cause in causes])
    order = np.argsort(-np.nan_to_num(np.abs(shares)).max(axis=1, initial=0.0), kind="stable")
    cells = [tuple(f"{share:.1f}" if np.isfinite(share) else NOTHING for share in column) for column in shares[order].T]
    columns = [Column(label, "%", column) for (label, _), column in zip(found, cells, strict=True)]
    names = tuple(causes[k] for k in order)
    words = "Shares in the position error, of random specimens in its variance."
    return ResultTable("", (Column("source", "", names, left=True, is_key=True), *columns), (words,))


def _sizes(chapter: Chapter) -> str:
    result = chapter.results["sizes"]
    if result.sizes["configuration"] > 1:
        steps = {f"× {factor:g}": result.isel("factor", k) for k, factor in enumerate(result.coords["factor"].values)}
        figure = _drawn(plot.error, steps)
    else:
        figure = _drawn(plot.sweep, result)
    said = "Largest position error with all clearances and tolerances of the file times a factor."
    return picture(figure, said, {"sizes.csv": numbers(result, ("worst_position", "worst_rotation"))})


def _scatter(chapter: Chapter) -> str:
    part = chapter.parts("random")[0][1]
    at = worst_place(chapter)
    shown = dict.fromkeys(QUANTITIES, at) | {name: worst_of(part, name) for name in _limited([part])}
    figures = [_drawn(plot.histogram, part, quantity, where) for quantity, where in shown.items()]
    said = f"Random specimens at {place(part, at)}, where the position error can be largest"
    said += "; components with a limit where they are worst." if len(shown) > len(QUANTITIES) else "."
    files = {
        f"histogram-{where}.csv": numbers(part.isel("configuration", where), ("histogram", "edge"))
        for where in dict.fromkeys(shown.values())
    }
    return picture(figures, said, files)


def _reactions(chapter: Chapter) -> str:
    found = []
    for heading, part in chapter.parts("loaded"):
        if "reaction" not in part.data:
            continue
        said = ": ".join(filter(None, (heading, "Forces in the joints under the loads of the file, at nominal poses.")))
        files = {"reactions.csv": numbers(part, ("reaction",))}
        # They do not depend on which point is the output.
        key = said, files["reactions.csv"]
        if key not in chapter.shared:
            figure = blank(7.4, 4.2)
            plot.reactions(part, axes=subplot(figure))
            chapter.shared[key] = picture(figure, said, files)
        found.append(chapter.shared[key])
    return "".join(found)


def _allowed(chapter: Chapter) -> str:
    result = chapter.results["allow"]
    words = "Sizes in the file beside the largest ones with which the limits hold in the worst case, each alone."
    found = set(result.labels("source"))
    rest = [one.name for one in sizings(chapter.m.first)[1] if one.name not in found]
    said = f"Of the sources with the largest shares; not looked for: {listed(rest)}, for which see `jointplay allow`."
    return _pictured(chapter, "allow", words, paragraphs([said] if rest else [], "note"))


def _forces(chapter: Chapter) -> str:
    every = chapter.parts("forces")
    return "".join(
        paragraphs([heading] if heading else []) + _concluded(part) + _table(part) for heading, part in every
    )


def _structural(chapter: Chapter) -> str:
    words = "How far the nominal mechanism, without play, is from its target; dashed, the tolerance of the target."
    return _pictured(chapter, "structural", words)


def _life(chapter: Chapter) -> str:
    words = "Clearances and errors while the joints wear, and the age from which on a limit is missed."
    return _pictured(chapter, "life", words)


def _compensation(chapter: Chapter) -> str:
    result, every = chapter.results["compensate"], chapter.parts("compensate")
    units = dict.fromkeys(result.labels("drive_unit"))
    figures = [_drawn(plot.error, dict(every), quantity) for quantity in QUANTITIES]
    figures += [_drawn(plot.correction, result, unit) for unit in units]
    said = "Error under the loads of the file before and after the correction of the drives, and the correction."
    names = [name for name in result.data if "contribution" not in name]
    shown = picture(figures, said, {"compensation.csv": numbers(result, names)})
    for heading, part in every:
        judged = marked(verdict(part).outcome) + _concluded(part)
        shown += paragraphs([heading] if heading else []) + judged + _table(part, "Table of the corrected drives")
    return shown


def _singularities(chapter: Chapter) -> str:
    words = "The configuration that is nearest to a singularity, and how near all are to singularities of each kind."
    return _pictured(chapter, "singularities", words)


def _pictured(chapter: Chapter, asked: str, words: str, notes: str = "", drawn: Callable[..., Any] = separate) -> str:
    """An answer with its figures, from which all of its numbers can be had, notes and its table."""
    result = chapter.results[asked]
    shown = picture(drawn(chapter.m.first, {asked: result}), words, {f"{asked}.csv": numbers(result, result.data)})
    return _concluded(result) + shown + notes + _table(result)


def _concluded(result: Result) -> str:
    """The answer in sentences."""
    return paragraphs([sentence.text for sentence in conclude(result).sentences])


def _table(result: Result, words: str = "Table") -> str:
    return folded(words, "".join(map(table, tables(result))))


def _not_asked(chapter: Chapter) -> str:
    rows = "".join(f"<dt>{escape(name)}</dt><dd>{escape(why)}</dd>" for name, why in chapter.reasons.items())
    return f"<dl>{rows}</dl>"


def assembly(answers: Answers) -> Section | None:
    """The steps of the assembly, where the file has an order."""
    if answers.assembly is None:
        return None
    with settings():
        figure = sheet(answers.m.first, {"assemble": answers.assembly})
        blocks = "".join(table(found, title=True) for found in tables(answers.assembly))
    said = "Error and forces after every step of the assembly."
    shown = picture(figure, said, {"assembly.csv": numbers(answers.assembly, answers.assembly.data)})
    return Section("Assembly", _concluded(answers.assembly) + shown + folded("Tables", blocks))


def map_(answers: Answers) -> Section | None:
    """The error over the grid of the file."""
    if answers.map is None:
        return None
    with settings():
        return Section("Map", maps.content(answers.m, answers.map))


def sizes_to_order(answers: Answers) -> Section | None:
    """Fits, limits and costs of all sources."""
    found = ordering.table(answers.m)
    return Section(found.title, table(found, most=None)) if found is not None else None


def changes(against: former.Former, m: Mechanism, record: former.Record) -> Section:
    """What has changed since a former report."""
    old = against.record
    keys = former.changed_keys(against.raw, m.raw)
    if old is None:
        said = "That report is of an older version of the program, which did not keep its verdicts for comparison."
    else:
        revision = f"revision {old.revision}, " if old.revision else ""
        said = f"That report is of {old.date}, {revision}mechanism {old.hash}; this one of mechanism {record.hash}."
    differ = table(keys, title=True, most=None) if keys else paragraphs(["No key of the file differs."])
    blocks = [paragraphs([said]), differ]
    if old is not None:
        blocks.append(table(former.changed_answers(old, record), title=True, most=None))
    return Section(f"Changes since {one_line(against.name)}", "".join(blocks))


def inputs(answers: Answers, command: str) -> Section:
    """What the page was made from."""
    m, known = answers.m, answers.check
    rows: Mapping[str, Any] = {
        "mechanism": known.attrs["mobility"],
        "file": f"{Path(m.file).name}, mechanism {m.hash}",
        "date": today(),
        "configurations": known.attrs["configurations"],
        "random specimens": f"{answers.samples} per configuration, seed {answers.seed}{_under_loads(answers)}",
        "warnings": " ".join(hints(m)) or "none",
        "versions": f"jointplay {known.attrs['jointplay']}, Python {python_version()}, NumPy {np.__version__}",
        "made by": command or "jointplay.report(m, path)",
    }
    items = "".join(f'<dt>{escape(str(k))}</dt><dd translate="no">{escape(str(v))}</dd>' for k, v in rows.items())
    assumed = (
        f"All poses and errors are those of the exact closure equations, without {listed(_left_out(m))}. "
        "Shares of sources are to first order."
    )
    content = f"<dl>{items}</dl>{paragraphs([assumed], 'note')}"
    content += folded("What the mechanism is made of", "".join(table(one, title=True) for one in tables(known)))
    return Section(
        "Inputs and assumptions", content + folded("The file", f'<pre translate="no">{escape(m.complete_text)}</pre>')
    )


def _under_loads(answers: Answers) -> str:
    """How many specimens are drawn under loads, where they are fewer."""
    every = [chapter.results["random"].attrs for chapter in answers.chapters if "random" in chapter.results]
    if answers.samples <= pressed.FEWER or not any("samples_loaded" in attrs for attrs in every):
        return ""
    return f"; under the loads {pressed.FEWER}, and more where these leave a required yield open"


def _left_out(m: Mechanism) -> list[str]:
    """What is not computed, or not for this file."""
    joints = m.data.joints.values()
    there = {
        "friction": any(getattr(joint, "friction", None) is not None for joint in joints),
        "wear": any(joint.wears is not None for joint in joints),
        "inertia": m.motion is not None,
    }
    return ["impact", *(name for name, is_there in there.items() if not is_there)]
