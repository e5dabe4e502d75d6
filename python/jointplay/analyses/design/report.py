"""What was found, as a result: values, aims before and after, what binds, how far values may move, the front."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from jointplay.analyses.allocate.report import BINDS, written
from jointplay.analyses.ideal import compared
from jointplay.basics.arrays import Floats
from jointplay.model.mechanism import Mechanism
from jointplay.result import SIDES, Result, ResultBuilder, Variable

from .attempts import ASSEMBLY, WORDS, Attempts, Candidate

#: a value within this part of its range of a bound is at the bound
AT_BOUND = 1e-6


@dataclass
class Designed:
    """What is told."""

    m: Mechanism
    attempts: Attempts
    #: of the aims
    weights: Mapping[str, float]
    #: the design of the file
    before: Candidate
    seed: int
    losses: tuple[float, ...]
    #: what was found
    best: Candidate | None = None
    tolerated: Floats | None = None
    front: list[Candidate] = field(default_factory=list)
    #: why it is not finished
    incomplete: str = ""
    #: attempts
    done: int = 0


def report(answer: Designed) -> Result:
    """The result."""
    best = answer.best
    assert best is not None
    variables = answer.attempts.variables
    builder = ResultBuilder(answer.m, "design", attempts=answer.done, seed=answer.seed)
    builder.attrs["asked"] = answer.attempts.table.question
    if answer.incomplete:
        builder.attrs["incomplete"] = answer.incomplete
    builder.labels("variable", [one.key for one in variables], "key of a value that may be chosen anew")
    _add(builder, "value_before", ("variable",), [one.before for one in variables], "value in the file")
    _add(builder, "value_found", ("variable",), best.values, "value that is found")
    _add(builder, "lowest", ("variable",), [one.low for one in variables], "smallest value it may have")
    _add(builder, "highest", ("variable",), [one.high for one in variables], "largest value it may have")
    slack = [AT_BOUND * one.span for one in variables]
    bounds = [
        "lowest" if value - one.low <= near else "highest" if one.high - value <= near else ""
        for one, value, near in zip(variables, best.values, slack, strict=True)
    ]
    builder.data["at_bound"] = Variable(("variable",), np.array(bounds, dtype=str), "", "bound that it is at")
    if answer.tolerated is not None:
        builder.labels("loss", answer.losses, "part by which the aim is larger")
        builder.labels("side", SIDES, "side")
        words = "how far it may move alone until the aim is larger by this part, or something does not hold"
        _add(builder, "tolerated", ("variable", "loss", "side"), answer.tolerated, words)
    names = [*answer.weights]
    builder.labels("aim", names, "what is to be small")
    builder.coords["aim_unit"] = Variable(
        ("aim",), np.array([_unit(answer.m, name) for name in names], dtype=str), "", "unit along aim"
    )
    builder.coords["aim_words"] = Variable(
        ("aim",), np.array([WORDS[name] for name in names], dtype=str), "", "aim in words"
    )
    if len(names) > 1 and not answer.front:
        _add(builder, "aim_weight", ("aim",), [*answer.weights.values()], "weight of the aim")
    _add(
        builder, "aim_before", ("aim",), [answer.before.aim(name) for name in names], "aim with the values in the file"
    )
    _add(builder, "aim_found", ("aim",), [best.aim(name) for name in names], "aim with the values that are found")
    _held(builder, answer, best)
    if answer.front:
        builder.labels("front", np.arange(len(answer.front)), "number of the design on the front")
        _add(builder, "front_aim", ("front", "aim"), [[one.aim(n) for n in names] for one in answer.front], "its aims")
        _add(builder, "front_value", ("front", "variable"), [one.values for one in answer.front], "its values")
    status = "ok" if best.holds else "infeasible"
    builder.data["status"] = Variable((), np.array(status), "", "outcome")
    if best.why:
        builder.attrs["refused"] = best.why
    if best.holds:
        changed = zip(variables, best.values, strict=True)
        builder.attrs["changes"] = "\n".join(f"{one.key}={written(v)}" for one, v in changed if v != one.before)
    return builder.result()


def _held(builder: ResultBuilder, answer: Designed, best: Candidate) -> None:
    """What has to hold, and what is used of it."""
    used, before = ({ASSEMBLY: 1.0 + one.lost if one.lost else 0.0, **one.largest} for one in (best, answer.before))
    names = list(dict.fromkeys([*used, *before]))
    builder.labels("held", names, "what has to hold")
    _add(builder, "used_before", ("held",), [before.get(n, np.nan) for n in names], "what the file uses of it")
    _add(builder, "used", ("held",), [used.get(n, np.nan) for n in names], "what is used of it; 1 is the limit")
    binding = [used.get(n, 0.0) >= BINDS for n in names]
    builder.data["binding"] = Variable(("held",), np.array(binding), "", "whether it is used as a whole")


def _unit(m: Mechanism, name: str) -> str:
    if name in ("outside", "cost"):
        return ""
    if name == "drive_force":
        kind = m.coordinate_kind(m.drive_joints[0])
        return str(m.units.force_name if kind == "length" else m.units.moment_name)
    turns = name.endswith("rotation") or (name.startswith("structural") and compared(m)[1] == "angle")
    return str(m.units.angle_name if turns else m.units.length_name)


def _add(builder: ResultBuilder, name: str, dims: Sequence[str], values: object, words: str) -> None:
    unit = {"aim": "see aim_unit"}.get(dims[-1], "")
    builder.data[name] = Variable(tuple(dims), np.array(values, dtype=np.float64), unit, words)
