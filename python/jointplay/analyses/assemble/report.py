"""What all answers about an assembly say of its steps."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from jointplay.analyses.nominal import Interrupted, Progress, nominal
from jointplay.basics.arrays import Floats
from jointplay.errors import InputError, shown
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, ResultBuilder

from .spans import spans
from .steps import Step, index, name, order

T = TypeVar("T")
LENGTHS_OF_LINKS = {
    "nominal": "length with perfect parts",
    "actual": "length with the known deviations and every clearance in its middle",
    "shortest": "shortest length over all clearances and tolerances",
    "longest": "longest length over all clearances and tolerances",
}


@dataclass(frozen=True)
class Configuration:
    """Where it is assembled: one of the mechanism's configurations, SI, nan where it is not assembled."""

    configuration: int
    #: nominal poses of all bodies; shape (body, pose)
    poses: Floats
    #: nominal pose of the output; shape (component,)
    output: Floats

    @property
    def is_assembled(self) -> bool:
        """Whether perfect parts can be assembled there."""
        return bool(np.isfinite(self.poses).all())


def place(m: Mechanism, configuration: int) -> Configuration:
    """One of the configurations of a mechanism."""
    at = nominal(m)
    if not 0 <= configuration < len(at):
        there = f"they go from 0 to {len(at) - 1}" if len(at) > 1 else "there is only 0"
        problem = f"there is no configuration {shown(configuration)}; {there}"
        raise InputError(problem, file=m.file, key="configuration")
    return Configuration(configuration, at.poses[configuration], at.output[configuration])


def each(taken: Sequence[Step], work: Callable[[Step], T], progress: Progress | None) -> list[T]:
    """What there is to find out about every step; after Ctrl-C about those that are done, never none."""
    found: list[T] = []
    try:
        for step in taken:
            found.append(work(step))
            if progress is not None:
                progress(len(found), len(taken))
    except KeyboardInterrupt:
        if not found:
            raise
    return found


def finished(builder: ResultBuilder, count: int) -> Result:
    """The result over the steps that are done.

    Raises
    ------
    Interrupted
        When those are fewer than `count`.
    """
    done = len(builder.coords["step"].values)
    if done < count:
        builder.attrs["incomplete"] = f"interrupted after {done} of {count} steps"
        raise Interrupted(builder.result())
    return builder.result()


def begun(m: Mechanism, at: Configuration, which: str, count: int | None = None) -> ResultBuilder:
    """A result over the (first) steps of an assembly, with the members that each of them adds."""
    base, every = order(m)
    added = every[:count]
    builder = ResultBuilder(m, "assemble", assemble=which, base=name(m, base), at_configuration=at.configuration)
    builder.attrs["length"] = m.length / builder.units.length
    builder.add("nominal", "component", at.output, "nominal pose of the output", "component")
    builder.labels("step", np.arange(1, len(added) + 1), "number of the step, from 1")
    members = np.array([", ".join(name(m, body) for body in step) for step in added], dtype=str)
    builder.add("members", "step", members, "bodies that the step adds")
    return builder


def unassembled(m: Mechanism, at: Configuration, which: str) -> Result:
    """The answer where not even perfect parts can be assembled."""
    builder = begun(m, at, which)
    steps = len(builder.coords["step"].values)
    builder.add("status", "step", np.array(["not_assembled"] * steps), "outcome")
    return builder.result()


def report(m: Mechanism, taken: Sequence[Step], at: Configuration, which: str) -> ResultBuilder:
    """The same with what each of the steps is."""
    builder = begun(m, at, which, len(taken))

    def words(key: str, cells: list[str], long_name: str) -> None:
        builder.add(key, "step", np.array(cells, dtype=str), long_name)

    words("links", [", ".join("+".join(link) for link in step.links) for step in taken], "the same, locked ones as one")
    words("kind", [step.kind for step in taken], "what the step is")
    for key, long_name in (
        ("mobility", "freedoms of what is assembled, drives held"),
        ("redundancy", "constraints of what is assembled that are held already"),
    ):
        builder.add(key, "step", np.array([getattr(step.freedom, key) for step in taken], dtype=np.int64), long_name)
    _links(builder, taken, at)
    words("held", [", ".join(step.freedom.held) for step in taken], "what is held at its nominal place")
    return builder


def _links(builder: ResultBuilder, taken: Sequence[Step], at: Configuration) -> None:
    """The lengths of links that are locked to one another."""
    m, labels, lengths = builder.m, [], []
    for step in taken:
        for link in step.links:
            if len(link) == 1:
                continue
            found = list(spans(m, at.poses, [index(m, member) for member in link]))
            for span in found:
                own = "+".join(link)
                labels.append(own if len(found) == 1 else f"{own}:{m.joints[span.ends[0]]}-{m.joints[span.ends[1]]}")
                lengths.append((span.nominal, span.actual, span.shortest, span.longest))
    if not labels:
        return
    builder.labels("link", labels, "members that are locked to one another, between two of their joints")
    for (key, words), values in zip(LENGTHS_OF_LINKS.items(), np.transpose(lengths), strict=True):
        builder.add(f"link_{key}", "link", values, words, "length")
