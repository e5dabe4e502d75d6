"""What the page shows: answers at the position of the sliders, and along the path of the file.

While sliders move, `worst` is to first order and `random` of few specimens. When they rest, `settled` finds both on the
exact closure, with more and more specimens.
"""

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from jointplay.analyses import forces, pressed, region, worst
from jointplay.analyses.displaced import at_offsets, under_load
from jointplay.analyses.nominal import WITHOUT_ERRORS, Nominal
from jointplay.analyses.questions import computation, options_of
from jointplay.analyses.region import IN_PLANE, IN_SPACE, around
from jointplay.analyses.transmission import angle, lines
from jointplay.basics.arrays import Floats
from jointplay.basics.poses import SPATIAL
from jointplay.core.compile import ANGULAR, LENGTHS
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism
from jointplay.questions import QUESTIONS, Question, asked_by
from jointplay.result import FORCES_APART, SIZES, STATUSES, Result, blame, figure, in_words, rounding, typical
from jointplay.result.conclusions import Sentence, conclude, rests
from jointplay.result.conclusions.words import farthest, say
from jointplay.result.table.forces import overview
from jointplay.result.table.layout import Column
from jointplay.result.verdict import NOT_SHOWN, Verdict, cause, ends, verdict
from jointplay.show.reporting.answers import reproduces, specimens
from jointplay.show.viewer import DisplacedScene, scene

from .board import Json, on_board, poses_of
from .knobs import drives, offsets
from .session import PageQuestion, Session, placed

#: specimens while sliders move, and when they rest: as many as there is time for, one after the other
FEW = 256
STAGES = (1024, 16_384, 131_072)
#: seconds that a stage may take
PATIENCE = 10.0
#: configurations of a path up to which it is answered while sliders move
MOST_LIVE = 60
#: directions of an over-constrained mechanism's region while sliders move
ROUGH = 16
#: sources with the largest shares that are shown
MOST_SHARES = 8
QUANTITIES = ("position", "rotation")
#: what is said of limits of forces at the position of the sliders
ELSEWHERE = Sentence("Limits of forces count along the whole path: the last line has their verdict.")

Check = Callable[[int, int], None]


@dataclass(frozen=True)
class AtSliders:
    """A mechanism at the position of the sliders, with one output, under the loads that act there."""

    m: Mechanism
    at: Nominal
    answers: Mapping[str, Result]
    region: Floats


def now(session: Session, asked: PageQuestion, check: Check) -> Json:
    """What is shown while sliders move.

    Parameters
    ----------
    check : callable
        Raises when the page has asked something newer.

    Returns
    -------
    dict
        Fit for JSON: the drawing, numbers and sentences of every question at the position, and answers along the path.
    """
    begin = time.perf_counter()
    m = session.mechanism(asked)
    path = session.along(m)
    at, nearest = placed(m, path, asked.drives)
    m_here = m.running_under(nearest, at.drives, at.poses)
    told: Json = {"serial": asked.serial, "exact": False, "samples": FEW} | _standing(m, at, asked)
    told["poses"] = poses_of(m, at)
    told["transmission"] = transmission(m, at)
    if "problem" not in told:
        here = _here(m_here, at, asked)
        told |= _drawing(here, asked) | _numbers(here.answers)
    check(0, 0)
    if len(path) <= MOST_LIVE:
        key = ("path", m.of, tuple(sorted(asked.values.items())))
        told["path"] = session.kept(key, lambda: _path(_questions(m, path)))
    told["milliseconds"] = 1e3 * (time.perf_counter() - begin)
    return told


def settled(session: Session, asked: PageQuestion, samples: int, check: Check) -> Json:
    """What is shown when sliders rest: the same on the exact closure.

    Parameters
    ----------
    samples : int
        Random specimens per configuration; 0 for all other questions.
    """
    begin = time.perf_counter()
    m = session.mechanism(asked)
    path = session.along(m)
    at, nearest = placed(m, path, asked.drives)
    m_here = m.running_under(nearest, at.drives, at.poses)
    told: Json = {"serial": asked.serial, "exact": True, "samples": samples} | _standing(m, at, asked)
    key = ("settled", m.of, samples, tuple(sorted(asked.values.items())))

    def ask(own: Mechanism, where: Nominal) -> dict[str, Result]:
        if samples:
            return _possible("random", own, where, samples=samples, path=len(where) > 1, progress=check)
        return _possible("loaded", own, where) | {"worst": worst.compute(own, at=where, progress=check)}

    if "problem" not in told:
        answers = ask(m_here, at)
        check(0, 0)
        if samples:
            told |= _numbers(answers)
        else:
            answers |= _given(m_here, at, asked)
            # Of random specimens the few are drawn; their numbers come with the next stage.
            drawn = AtSliders(
                m_here,
                at,
                _few(m_here, at) | answers,
                _region(m_here, at, check),
            )
            told |= _drawing(drawn, asked) | _numbers(answers)
    told["path"] = session.kept(key, lambda: _path(ask(m, path)))
    if m.limits.forces and not samples:
        told["forces"] = session.kept(("forces", *key), lambda: _forces(m, path, check))
    seconds = time.perf_counter() - begin
    following = [stage for stage in STAGES if stage > samples]
    # Time grows at most with the number of specimens.
    soon = not samples or (following and seconds * _growth(m, samples, following[0]) < PATIENCE)
    told["next"] = following[0] if soon and told["path"] else 0
    told["milliseconds"] = 1e3 * seconds
    return told


def _standing(m: Mechanism, at: Nominal, asked: PageQuestion) -> Json:
    """What keeps the machine from standing at a position, where something does, and where it would be."""
    if not np.isfinite(at.poses).all():
        return {"problem": f"cannot be assembled at {_drives(m, asked.drives)}"}
    status = str(STATUSES[at.status[0]])
    if status not in WITHOUT_ERRORS:
        return {}
    leaves = "" if at.leaves is None or not at.leaves[0] else f": {at.leaves[0]} leaves its range"
    drawn = on_board(m, at, scene(m, at))
    return {"problem": f"{status.replace('_', ' ')} at {_drives(m, asked.drives)}{leaves}", "scene": drawn}


def transmission(m: Mechanism, at: Nominal) -> Json | None:
    """The smallest transmission angle at a configuration, beyond the bodies that drives move, and a dead centre."""
    if m.pose_size == SPATIAL or not np.isfinite(at.poses).all():
        return None
    moved = {name for drive in m.data.drives.values() for name in drive.moves}
    driven = {body for name, own in zip(m.joints, m.joint_bodies, strict=True) if name in moved for body in own}
    found = []
    for name, bodies in zip(m.joints, m.joint_bodies, strict=True):
        if not driven.intersection(bodies):
            # Other joints have none.
            with suppress(InputError):
                found.append((float(np.degrees(angle(m, at, lines(m, name))[0])), name))
    if not driven or not found:
        return None
    least, joint = min(found)
    is_dead = bool(m.core.measure(at.drives, at.poses)["singular_value"][0] < m.limits.singular_value)
    text = f"Transmission angle {least:.1f}° at {joint}"
    return {"text": f"⚠ dead centre: {text}" if is_dead else text, "alarm": is_dead}


def _questions(m: Mechanism, at: Nominal) -> dict[str, Result]:
    """All questions while sliders move."""
    rough = worst.compute(m, at=at, **QUESTIONS["worst"].asked_by["studio"])
    return _possible("loaded", m, at) | {"worst": rough} | _few(m, at)


def _few(m: Mechanism, at: Nominal) -> dict[str, Result]:
    """The specimens that are drawn."""
    return _possible("random", m, at, samples=FEW, **QUESTIONS["random"].asked_by["studio"])


def _growth(m: Mechanism, samples: int, following: int) -> float:
    """How many times as long more specimens take; of those under a load, which take most of the time, few are drawn."""
    return 2.0 if samples >= pressed.FEW and pressed.counts_too(m) else following / samples


def _possible(question: str, m: Mechanism, at: Nominal, **options: Any) -> dict[str, Result]:
    """Nothing where nothing loads the mechanism, or a law is not possible; the report says why."""
    with suppress(InputError):
        return {question: computation(question, "studio")(m, at=at, **options)}
    return {}


def _takes_offsets(question: str) -> bool:
    """Whether a question is about offsets that somebody gives."""
    return question in asked_by("studio") and "offsets" in options_of(question)


def _given(m: Mechanism, at: Nominal, asked: PageQuestion) -> dict[str, Result]:
    """What is asked about the offsets that the sliders give."""
    if not _takes_offsets(asked.question):
        return {}
    return {asked.question: computation(asked.question, "studio")(m, offsets=dict(asked.offsets), at=at)}


def _here(m: Mechanism, at: Nominal, asked: PageQuestion) -> AtSliders:
    answers = _questions(m, at) | _given(m, at, asked)
    axes = _axes(m)
    towards = around(axes, (IN_PLANE if axes == 2 else IN_SPACE) if m.core.isostatic else ROUGH)
    found = m.core.region(at.drives, at.poses, towards, 0)["error"][0, :, :axes]
    return AtSliders(m, at, answers, found / m.units.length)


def _region(m: Mechanism, at: Nominal, check: Check) -> Floats:
    reached: Floats = region.compute(m, at=at, progress=check).get("region")[0]
    return reached


def _axes(m: Mechanism) -> int:
    return sum(name in LENGTHS for name in m.components)


def _drives(m: Mechanism, values: tuple[float, ...]) -> str:
    told = []
    for name, joint, value in zip(m.drives, m.drive_joints, values, strict=True):
        unit = m.units.angle_name if m.joint_kinds[joint] in ANGULAR else m.units.length_name
        told.append(f"{name} = {value:.4g} {unit}")
    return ", ".join(told)


def _drawing(here: AtSliders, asked: PageQuestion) -> Json:
    """The drawing at a position."""
    m, at = here.m, here.at
    bounds = dict(zip(m.quantities, m.limits.bounds(m.quantities), strict=True))
    limit = float(bounds["position"][1]) / m.units.length
    cloud = specimens(m, at) if asked.question == "random" else None
    drawn = scene(
        m,
        at,
        displaced=_displaced(here, asked.question),
        region=here.region[None],
        cloud=cloud,
        limit=limit if np.isfinite(limit) else None,
    )
    shown = here.answers.get(asked.question)
    return {"scene": on_board(m, at, drawn | {"blamed": _blamed(m, shown, drawn["shapes"])})}


def _displaced(here: AtSliders, question: str) -> list[DisplacedScene]:
    """The mechanism where the answer to a question has it."""
    m, at = here.m, here.at
    if question not in here.answers or not QUESTIONS[question].displaced:
        return []
    result = here.answers[question]
    at_extreme = {"extreme": "position"} if question == "worst" else {}
    offset = result.get("worst_offset" if question == "worst" else "offset", **at_extreme)
    is_elastic = question == "loaded" and not m.core.isostatic
    moved = under_load(m, at) if is_elastic else at_offsets(m, at, offset)
    # Where offsets alone tell the poses there is nothing to compare; to first order they are not those of the error.
    is_known = _takes_offsets(question) or (question == "worst" and m.core.isostatic)
    return (
        [DisplacedScene(QUESTIONS[question].displaced, *moved)] if is_known or reproduces(m, at, result, moved) else []
    )


def _numbers(answers: Mapping[str, Result]) -> Json:
    """Numbers, sentences and shares of every question at a position."""
    return {"here": {question: _one(question, result) for question, result in answers.items()}}


def _one(question: str, result: Result) -> Json:
    said = conclude(_without_forces(result))
    told: Json = {"status": str(result.get("status")[0])}
    of_forces = [ELSEWHERE] if FORCES_APART in result.attrs else []
    told["sentences"] = [_sentence(one) for one in (*said.sentences, *of_forces)]
    _, highest = ends(result) if "undetermined" in result.data else (None, None)
    for quantity in QUANTITIES:
        values, unit = figure(result, quantity)
        most = values if highest is None else highest[:, SIZES.index(quantity) - len(SIZES)]
        is_open = np.isfinite(most[0]) and most[0] - values[0] > rounding(result, unit)
        blamed = cause(result, quantity, "high", 0)
        told[quantity] = {
            "value": _number(0.0 if abs(values[0]) <= rounding(result, unit) else values[0]),
            "unit": unit,
            # What the load leaves open counts in the sentence, so it stands in the table, too.
            "most": _number(most[0]) if is_open else None,
            "blame": in_words(*blamed) if blamed else "",
            "shares": _shares(result, quantity),
        }
    if question == "worst":
        found = result.get("worst_offset", extreme="position")[0]
        told["offsets"] = dict(zip(result.labels("parameter"), map(_number, found), strict=True))
    if question == "random":
        told["samples"] = int(result.attrs["samples"])
    return told


def _shares(result: Result, quantity: str) -> list[tuple[str, float]]:
    """The sources with the largest shares, and those shares."""
    if "contribution" not in result.data:
        return []
    found = blame(result)
    row = getattr(found, quantity)[0]
    if not np.isfinite(row).all():
        return []
    order = np.argsort(-np.abs(row), kind="stable")[:MOST_SHARES]
    return [(found.causes[k], float(row[k])) for k in order.tolist()]


def _blamed(m: Mechanism, result: Result | None, shapes: list[Json]) -> list[int]:
    """Numbers of the points that are marked: where the joints stand that are to blame for the position error."""
    found = None if result is None else cause(result, "position", "high", 0)
    joints: dict[int, None] = {}
    for name in found[0] if found else ():
        if name in m.data.dimensions:
            ends = m.data.dimensions[name].between
            joints |= {k: None for k, joint in enumerate(m.joints) if joint.split("/")[0] in ends}
        elif name in m.sources:
            source = m.compiled_sources[m.sources.index(name)].spec
            if "joint" in source:
                joints[source["joint"]] = None
            elif "drive" in source:
                joints[m.drive_joints[source["drive"]]] = None
    named = {text: s["points"][0] for s in shapes if s["kind"] == "name" for text in s["text"].split(", ")}
    points = []
    for k in joints:
        name = m.joints[k].split("/")[0]
        # Both pins of a universal joint stand under its name.
        at = named.get(name, named.get(name.rpartition(".")[0]))
        points.append(m.joint_points[k][1] if at is None else at)
    return points


def _path(answers: Mapping[str, Result]) -> Json:
    """Errors along the path, for plots, with sentences."""
    told: Json = {}
    for question, result in answers.items():
        said, judged = conclude(_without_forces(result)), verdict(result)
        curves = {}
        for quantity in QUANTITIES:
            values, unit = figure(result, quantity)
            limit = result.get("limit", quantity=quantity, side="high") if "limit" in result.data else np.nan
            values = np.where(np.abs(values) <= rounding(result, unit), 0.0, values)
            curves[quantity] = {"values": [_number(v) for v in values], "unit": unit, "limit": _number(limit)}
        told[question] = curves | {
            "components": _components(result),
            "sentences": list(map(_sentence, said.sentences)),
            "outcome": judged.outcome,
            "rests": rests(question, result, judged),
            "brief": _brief(result, judged),
        }
    return told


def _components(result: Result) -> Json:
    """Lowest and highest errors of the components that have a limit, with these limits."""
    if "limit" not in result.data:
        return {}
    told: Json = {}
    for k, name in enumerate(result.labels("component")):
        limits = [float(v) for v in result.get("limit", quantity=name).ravel() if np.isfinite(v)]
        if not limits:
            continue
        unit = result.unit("limit", quantity=name)
        if "error_quantile" in result.data:
            lines = [result.get("error_quantile", probability=typical(result), quantity=name)]
        else:
            lines = [side[:, k] for side in ends(result)]
        nothing = rounding(result, unit)
        is_one = len(lines) == 2 and not np.nanmax(lines[1] - lines[0], initial=0.0) > nothing
        shown = [[_number(0.0 if abs(v) <= nothing else v) for v in line] for line in lines[: 1 if is_one else 2]]
        told[name] = {"lines": shown, "unit": unit, "limits": limits}
    return told


def _forces(m: Mechanism, path: Nominal, check: Check) -> Json:
    """What becomes of limits of forces along the path, in sentences and tables; or why that is not known."""
    try:
        result = forces.compute(m, at=path, progress=check)
    except InputError as problem:
        reason = {"text": f"Limits of forces are not shown: {problem.problem}", "alarm": True, "state": NOT_SHOWN}
        return {"outcome": NOT_SHOWN, "brief": f"{NOT_SHOWN} ({problem.problem})", "sentences": [reason], "tables": []}
    judged = verdict(result)
    return {
        "outcome": judged.outcome,
        "rests": rests("forces", result, judged),
        "brief": _brief(result, judged),
        "sentences": list(map(_sentence, conclude(result).sentences)),
        "tables": [{"title": one.title, "columns": list(map(_column, one.columns))} for one in overview(result)],
    }


def _column(column: Column) -> Json:
    head = column.name.replace("\n", " ") + (f" [{column.unit}]" if column.unit else "")
    return {"head": head, "cells": list(column.cells), "alarms": list(column.alarms)}


def _brief(result: Result, judged: Verdict) -> str:
    """The verdict of a question in a few words, or its largest position error where there is nothing to keep to."""
    if judged.outcome:
        return f"{judged.outcome}{f' ({judged.gist})' if judged.gist else ''}"
    values, unit = figure(result, "position")
    k = farthest(values, result.get("status"))
    if k is None:
        return "no answer"
    if values[k] <= rounding(result, unit):
        return "nothing is off"
    scatters = result.attrs["question"] == "random"
    return f"{f'{100 * typical(result):g} % below' if scatters else 'up to'} {say(float(values[k]), unit)}"


def _without_forces(result: Result) -> Result:
    """A result that does not say who judges limits of forces: here the page does, beside every question."""
    return replace(result, attrs={name: value for name, value in result.attrs.items() if name != FORCES_APART})


def _sentence(one: Sentence) -> Json:
    return {"text": one.text, "alarm": one.is_alarm, "state": one.state}


def _number(value: Any) -> float | None:
    """A number, None where JSON has none for it."""
    return float(value) if np.isfinite(value) else None


def _choice(question: Question) -> Json:
    """What a page needs to know of a question."""
    return {
        "words": question.label,
        "needs_loads": question.needs_loads,
        "takes_offsets": _takes_offsets(question.name),
        # What is asked in another way while sliders move.
        "is_rough": bool(question.asked_by["studio"]),
    }


def opened(session: Session) -> Json:
    """What a page needs to begin: the mechanism along its path, its sliders and its choices."""
    m = session.m
    first = m.first
    path = session.path
    factors = first.drive_factors
    known = np.flatnonzero(np.isfinite(path.poses).all(axis=(1, 2)))
    begin = path.drives[known[len(known) // 2]] if len(known) else path.drives[0]
    return {
        "title": m.title,
        "scene": scene(first, path),
        "outputs": list(m.outputs),
        "cases": list(m.load_cases),
        "loads": m.has_loads or not m.core.isostatic,
        "questions": {name: _choice(QUESTIONS[name]) for name in asked_by("studio")},
        "knobs": [knob.told() for knob in session.knobs.values()],
        "drives": drives(first, path),
        "offsets": offsets(first),
        "forces": bool(m.limits.forces),
        "along": [[_number(v) for v in row] for row in path.drives / factors],
        "begin": [float(v) for v in begin / factors],
    }
