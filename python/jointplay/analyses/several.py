"""Several outputs and load cases: a question is asked of each of them, and the answers stand side by side.

    answer[output, load_case] = question(mechanism with this output, under the common loads and those of the case)

What is asked of one of them is what a file with this output and these loads alone would be asked. The envelope over
the load cases has the largest error and the case that causes it.
"""

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ParamSpec

import numpy as np

from jointplay.model.mechanism import Mechanism
from jointplay.model.mobility import require_determinate
from jointplay.result import SIDES, Result, Variable, align, beside, size, unit_of

from .nominal import Interrupted, Nominal, Progress, carried, nominal

P = ParamSpec("P")
#: arguments of a question by name
Arguments = Mapping[str, Any]


def of_each(
    by_load: Callable[[Arguments], bool], check: Callable[[Mechanism], None] | None = None
) -> Callable[[Callable[P, Result]], Callable[P, Result]]:
    """Let a question be asked of a mechanism with several outputs and load cases.

    Parameters
    ----------
    by_load : callable
        Whether the answer depends on the loads; if not, load cases do not matter.
    check : callable, optional
        Refuses a mechanism with one output and load case; asked of all of them before the first answer.
    """

    def decorate(compute: Callable[P, Result]) -> Callable[P, Result]:
        signature = inspect.signature(compute)

        @functools.wraps(compute)
        def asked(*args: P.args, **kwargs: P.kwargs) -> Result:
            bound = signature.bind(*args, **kwargs)
            m: Mechanism = bound.arguments["m"]
            if check is not None:
                for part in m.every_part:
                    check(part)
            if not (m.outputs or m.load_cases):
                return compute(*args, **kwargs)
            bound.apply_defaults()
            arguments = bound.arguments
            return _Each(compute, m, arguments, by_load(arguments)).answer()

        return asked

    return decorate


def of_outputs(m: Mechanism, found: Sequence[Result]) -> Result:
    """The answers of the first outputs side by side."""
    return beside(align(found), "output", m.outputs[: len(found)], "output")


def places_of(parts: Sequence[Mechanism]) -> list[Nominal]:
    """The nominal configurations of every part, which sizes do not change; solved once for all that move alike."""
    first = parts[0]
    known = nominal(first)
    return [known if part is first else carried(known, first, part) for part in parts]


class _Each:
    """A question for each output and each load case.

    Parameters
    ----------
    compute : callable
        The question for one output and one load case.
    m : Mechanism
    arguments : mapping
        Of the question.
    by_load : bool
        Whether the answer depends on the load case.
    """

    def __init__(self, compute: Callable[..., Result], m: Mechanism, arguments: Arguments, by_load: bool) -> None:
        self.compute, self.m, self.arguments = compute, m, arguments
        self.cases = m.load_cases if by_load else ()
        base = m if by_load else m.without_load_cases()
        cases = self.cases or (None,)
        self.parts = [[(output, base.only(output, case)) for case in cases] for output in m.outputs or (None,)]
        self.count = sum(map(len, self.parts))
        for _, part in (each for row in self.parts for each in row):
            # Where loads of a case turn a spin, the configurations of another case do not hold for it.
            if any(spin.load is not None for spin in part.spins):
                require_determinate(part, over_constrained=True)
        self._known: tuple[Mechanism, Nominal] | None = None

    def answer(self) -> Result:
        """The answers side by side."""
        found: list[Result] = []
        answers: list[Result] = []
        try:
            for row in self.parts:
                answers = []
                for output, part in row:
                    done = len(found) * len(row) + len(answers)
                    answers.append(self._ask(output, part, done))
                found.append(self._over_cases(answers))
        except KeyboardInterrupt as stop:
            raise self._interrupted(found, answers, stop) from None
        return self._over_outputs(found)

    def _interrupted(self, found: list[Result], answers: list[Result], stop: KeyboardInterrupt) -> KeyboardInterrupt:
        """What there is after Ctrl-C: the outputs that are done; of the first the cases; of the first the part."""
        if found:
            words = f"interrupted after {len(found)} of {len(self.parts)} outputs"
        else:
            words = f"interrupted after {len(answers)} of {len(self.cases)} load cases"
            if not answers:
                if not isinstance(stop, Interrupted):
                    return KeyboardInterrupt()
                answers = [stop.partial]
                case = f", load case {self.cases[0]}" if self.cases else ""
                words = f"{stop.partial.attrs['incomplete']}{case}"
            words += f", output {self.m.outputs[0]}" if self.m.outputs else ""
            found = [self._over_cases(answers)]
        return Interrupted(_with_attribute(self._over_outputs(found), "incomplete", words))

    def _ask(self, output: str | None, part: Mechanism, done: int) -> Result:
        arguments = {**self.arguments, "m": part}
        if "at" in arguments:
            arguments["at"] = self._place(part)
        if (tell := arguments.get("progress")) is not None:
            arguments["progress"] = share(tell, done, self.count)
        offsets: Any = arguments.get("offsets")
        if hasattr(offsets, "dims"):
            # Offsets of another result are those of the same output.
            chosen = {"output": output} if output is not None and "output" in offsets.dims else {}
            arguments["offsets"] = offsets.sel(chosen)
        return self.compute(**arguments)

    def _place(self, part: Mechanism) -> Nominal:
        """The nominal configurations, which are solved once for all that move alike."""
        given: Nominal | None = self.arguments["at"]
        if given is not None:
            return given if part.of == self.m.of else carried(given, self.m, part)
        if self._known is None or part.bodies != self._known[0].bodies or part.length != self._known[0].length:
            self._known = part, nominal(part)
        known, at = self._known
        return at if part.of[0] == known.of[0] else carried(at, known, part)

    def _over_cases(self, answers: Sequence[Result]) -> Result:
        if not self.cases:
            return answers[0]
        cases = self.cases[: len(answers)]
        result = beside(align(answers), "load_case", cases, "load case", same=("nominal", "limit"))
        # Of some of the cases there is no largest.
        whole = result.attrs["question"] == "loaded" and cases == self.cases
        return _with_envelope(result) if whole else result

    def _over_outputs(self, found: Sequence[Result]) -> Result:
        return of_outputs(self.m, found) if self.m.outputs else found[0]


def share(progress: Progress, done: int, count: int) -> Progress:
    """Progress of one part as that of the whole."""
    return lambda steps, total: progress(done * total + steps, count * total)


def _with_attribute(result: Result, name: str, value: str) -> Result:
    return Result(result.coords, result.data, {**result.attrs, name: value})


def _with_envelope(result: Result) -> Result:
    """With the largest errors over the load cases and the cases that cause them; unknown where one case is unknown."""
    cases = np.array(result.labels("load_case"))
    data, coords = dict(result.data), dict(result.coords)
    error = result.data["error"]
    rest = error.dims[1:-1]

    def add(name: str, dims: tuple[str, ...], values: Any, units: str, words: str) -> None:
        largest = values.argmax(axis=0)
        unknown = np.isnan(values).any(axis=0)
        found = np.where(unknown, np.nan, np.take_along_axis(values, largest[None], axis=0)[0])
        data[f"envelope_{name}"] = Variable((*rest, *dims), found, units, f"{words} over the load cases")
        where = np.where(unknown, "", cases[largest])
        data[f"envelope_{name}_case"] = Variable((*rest, *dims), where, "", f"load case with the {words}")

    for quantity in ("position", "rotation"):
        words = f"largest {quantity} error" if quantity == "position" else "largest rotation"
        add(quantity, (), size(result, "error", quantity), unit_of(result, quantity), words)
    both = np.stack([-error.values, error.values], axis=-1)
    add("component", ("component", "side"), both, error.units, "lowest and highest error of the component")
    data["envelope_component"].values[..., 0] *= -1.0
    coords["side"] = Variable(("side",), np.array(SIDES))
    return Result(coords, data, result.attrs)
