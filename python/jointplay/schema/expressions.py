"""Expressions where numbers stand, in the variables of the file.

An expression stands only where a number may: what is valid as a text, such as the name of a joint, stays one. Numbers,
``+ - * / **``, parentheses, variables, `pi` and the functions below; nothing else can be called. Angles are in the
file's unit.
"""

from __future__ import annotations

import ast
import copy
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from pydantic import ValidationError

from jointplay.errors import InputError, listed, not_known, shown

#: an expression that a person wrote is not longer, nor are there more operations in a chain
LONGEST = 500
#: passes over the file: what an expression becomes may show the next one
MOST_PASSES = 12

OPERATORS: Mapping[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: math.pow,
}
SIGNS: Mapping[type[ast.unaryop], Callable[[float], float]] = {ast.UAdd: operator.pos, ast.USub: operator.neg}
PLAIN: Mapping[str, Callable[..., float]] = {
    "sqrt": math.sqrt,
    "hypot": math.hypot,
    "abs": abs,
    "min": min,
    "max": max,
    "exp": math.exp,
    "log": math.log,
}
FROM_ANGLE: Mapping[str, Callable[[float], float]] = {"sin": math.sin, "cos": math.cos, "tan": math.tan}
TO_ANGLE: Mapping[str, Callable[..., float]] = {
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "atan2": math.atan2,
}
#: how many values each takes: a number of them, or at least as many as stated below zero
TAKES = dict.fromkeys((*PLAIN, *FROM_ANGLE, *TO_ANGLE), 1) | {"hypot": -2, "min": -2, "max": -2, "atan2": 2}
CONSTANTS = {"pi": math.pi}
RESERVED = frozenset((*TAKES, *CONSTANTS))


F = TypeVar("F")


def is_variable(name: str) -> bool:
    """Whether a variable may have a name."""
    return name.isidentifier() and name not in RESERVED


class NotAnExpression(Exception):
    """Why a text is no number."""


class Variables:
    """The variables of a file, as they are asked for.

    Parameters
    ----------
    given : mapping
        Numbers and expressions by name.
    angle : float
        The file's unit of angles in radians.
    """

    def __init__(self, given: Mapping[str, object], angle: float) -> None:
        self.given = given
        self.angle = angle
        self._known: dict[str, float] = {}
        self._asked: list[str] = []

    def number(self, text: str) -> float:
        """The value of an expression.

        Raises
        ------
        NotAnExpression
            When it is none, or has no finite value.

        Examples
        --------
        >>> Variables({"a": 30, "b": "2 * a"}, math.pi / 180).number("b * sin(a) + 1")
        31.0
        """
        value = self._value(_parsed(text), text)
        if not math.isfinite(value):
            raise NotAnExpression(f"{shown(text)} has no finite value")
        return value

    def variable(self, name: str) -> float:
        """The value of a variable.

        Raises
        ------
        NotAnExpression
            When there is none of this name, or it depends on itself.
        """
        if name in self._known:
            return self._known[name]
        if name not in self.given:
            names = [*self.given, *CONSTANTS]
            raise NotAnExpression(not_known(name, "one of [variables]", names) if self.given else _nothing(name))
        if name in self._asked:
            circle = " -> ".join((*self._asked[self._asked.index(name) :], name))
            raise NotAnExpression(f"variables that depend on themselves: {circle}")
        self._asked.append(name)
        try:
            given = self.given[name]
            value = self.number(given) if isinstance(given, str) else float(given)  # type: ignore[arg-type]
            if not math.isfinite(value):
                raise NotAnExpression(f"a finite number is needed, not {shown(given)}")
        finally:
            self._asked.pop()
        self._known[name] = value
        return value

    def _value(self, node: ast.expr, text: str) -> float:
        match node:
            case ast.Constant(value=bool() | complex()):
                pass
            case ast.Constant(value=int() | float() as value):
                return float(value)
            case ast.Name(id=name):
                return CONSTANTS[name] if name in CONSTANTS else self.variable(name)
            case ast.UnaryOp(op=op, operand=operand) if type(op) in SIGNS:
                return SIGNS[type(op)](self._value(operand, text))
            case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
                return self._called(OPERATORS[type(op)], [self._value(left, text), self._value(right, text)], text)
            case ast.BinOp(op=ast.BitXor()):
                raise NotAnExpression(f"{shown(text)}: a power is written a**2")
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in TAKES:
                count = TAKES[name]
                if len(arguments) != count and not (count < 0 and len(arguments) >= -count):
                    needed = f"{count}" if count > 0 else f"{-count} or more"
                    raise NotAnExpression(f"{shown(text)}: {name} takes {needed} value{'s' * (needed != '1')}")
                values = [self._value(argument, text) for argument in arguments]
                if name in FROM_ANGLE:
                    return self._called(FROM_ANGLE[name], [values[0] * self.angle], text)
                if name in TO_ANGLE:
                    return self._called(TO_ANGLE[name], values, text) / self.angle
                return self._called(PLAIN[name], values, text)
            case ast.Call(func=ast.Name(id=name)):
                raise NotAnExpression(f"{shown(text)}: {not_known(name, 'a function', sorted(TAKES))}")
        raise NotAnExpression(
            f"{shown(text)} is not an expression: numbers, + - * / **, parentheses, variables, pi and {listed(TAKES)}"
        )

    @staticmethod
    def _called(function: Callable[..., float], values: list[float], text: str) -> float:
        try:
            return float(function(*values))
        except (ValueError, ZeroDivisionError, OverflowError):
            raise NotAnExpression(f"{shown(text)} has no finite value") from None


def _nothing(name: str) -> str:
    return f"{shown(name)} is neither a number nor a variable; the file has no [variables]"


def _parsed(text: str) -> ast.expr:
    if len(text) > LONGEST:
        raise NotAnExpression(f"{shown(text)} is longer than {LONGEST} characters")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise NotAnExpression(f"{shown(text)} is not an expression such as a / 2 + 10") from None


def is_plain(text: str) -> bool:
    """Whether an expression is just a number, which is written without quotes."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def resolved(raw: dict[str, Any], variables: Variables, check: Callable[[dict[str, Any]], F], file: str) -> F:
    """What a check makes of data whose expressions are replaced by numbers wherever it refuses a text.

    Parameters
    ----------
    raw : dict
        The data of the file; stays as it is.
    variables : Variables
        What expressions may name.
    check : callable
        Raises `ValidationError` for what is not valid.
    file : str
        For messages.

    Raises
    ------
    InputError
        Naming an expression without a value.
    ValidationError
        What is refused for another reason.
    """
    data = raw
    for _ in range(MOST_PASSES):
        try:
            return check(data)
        except ValidationError as error:
            changed = _replaced(data, error, variables, file)
            if changed is None:
                raise
            data = changed
    return check(data)


def _replaced(data: dict[str, Any], error: ValidationError, variables: Variables, file: str) -> dict[str, Any] | None:
    """A copy with numbers for the texts that are refused; None where that changes nothing."""
    data = copy.deepcopy(data)
    wrong: list[tuple[str, NotAnExpression]] = []
    changed = False
    for mistake in error.errors(include_url=False, include_context=False):
        place = _place(mistake["loc"], data)
        if not place or place[0] == "variables":
            continue
        *above, last = place
        here: Any = data
        for step in above:
            here = here[step]
        # A validator may refuse a whole list.
        refused = here[last]
        spots: list[tuple[Any, Any]] = [(refused, k) for k in range(len(refused))] if isinstance(refused, list) else []
        for holder, at in spots or [(here, last)]:
            text = holder[at]
            if not isinstance(text, str) or is_plain(text):
                continue
            try:
                holder[at] = variables.number(text)
                changed = True
            except NotAnExpression as why:
                wrong.append((".".join(map(str, place)), why))
    if not changed and wrong and variables.given:
        key, problem = wrong[0]
        raise InputError(str(problem), file=file, key=key)
    return data if changed else None


def _place(loc: tuple[int | str, ...], data: Any) -> list[int | str]:
    """The part of pydantic's location that is in the file."""
    steps: list[int | str] = []
    for part in loc:
        if (isinstance(data, dict) and part in data) or (
            isinstance(data, list) and isinstance(part, int) and part < len(data)
        ):
            data = data[part]  # type: ignore[index]
            steps.append(part)
    return steps
