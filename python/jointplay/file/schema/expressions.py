"""Expressions where numbers stand, in the variables of the file.

An expression stands only where a number may: what is valid as a text, such as the name of a joint, stays one. Numbers,
``+ - * / **``, parentheses, variables, `pi` and the functions below; nothing else can be called. Angles are in the
file's unit. A value that only rounding keeps from a number of few digits is that number: limits are met exactly.
"""

import ast
import keyword
import math
import operator
import re
import unicodedata
from collections.abc import Callable, Mapping
from graphlib import CycleError, TopologicalSorter
from typing import Any

from jointplay.basics.units import ANGLES
from jointplay.errors import listed, not_known, shown

#: an expression that a person wrote is not longer, nor are there more operations in a chain
LONGEST = 300
#: variables of a circle that a message lists
MOST_NAMED = 10
#: a number of no more digits is meant where the value of an expression is within so many units in its last place
FEW_DIGITS = 12
ROUNDING = 4
#: sines of multiples of this many degrees are met exactly
EXACT = 30.0
SINES = (
    0.0,
    0.5,
    math.sqrt(0.75),
    1.0,
    math.sqrt(0.75),
    0.5,
    0.0,
    -0.5,
    -math.sqrt(0.75),
    -1.0,
    -math.sqrt(0.75),
    -0.5,
)

#: what no expression has, and Python's parser would print remarks on: texts, and words right behind a number
FOREIGN = re.compile(r"""['"\\]|(?<![^\W\d])(?:and|else|for|if|in|is|not|or)\b""")

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
DEGREE = ANGLES["deg"]
TO_ANGLE: Mapping[str, Callable[..., float]] = {
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "atan2": math.atan2,
}
#: how many values each takes: a number of them, or at least as many as stated below zero
TAKES = dict.fromkeys((*PLAIN, *FROM_ANGLE, *TO_ANGLE), 1) | {"hypot": -2, "min": -2, "max": -2, "atan2": 2}
CONSTANTS = {"pi": math.pi}
RESERVED = frozenset((*TAKES, *CONSTANTS, "inf", "infinity", "nan"))
#: what only expressions have
SIGNS_OF_ONE = re.compile(r"[-+*/()]")


def is_variable(name: str) -> bool:
    """Whether a variable may have a name."""
    # Other letters that look the same would be another name within an expression.
    plain = unicodedata.normalize("NFKC", name) == name
    return name.isidentifier() and plain and not keyword.iskeyword(name) and name.lower() not in RESERVED


class NotAnExpression(Exception):
    """Why a text is no number; the sentence is made when it is needed.

    Parameters
    ----------
    why : callable or str
        The sentence, or what gives it.
    name : str
        The variable whose expression it is.
    """

    def __init__(self, why: Callable[[], str] | str, name: str = "") -> None:
        super().__init__()
        self.why = why
        self.name = name

    def __str__(self) -> str:
        return self.why if isinstance(self.why, str) else self.why()


class Variables:
    """The variables of a file, with their values.

    Parameters
    ----------
    given : mapping
        Numbers and expressions by name.
    angle : float
        The file's unit of angles in radians.

    Raises
    ------
    NotAnExpression
        When one has no value; its `name` says which.
    """

    def __init__(self, given: Mapping[str, object], angle: float) -> None:
        self.given = given
        self.angle = angle
        self._known: dict[str, float] = {}
        self._resolve()

    def _resolve(self) -> None:
        """Finds all variables, each after those that it needs."""
        needs: dict[str, set[str]] = {}
        for name, value in self.given.items():
            try:
                nodes = ast.walk(_parsed(value)) if isinstance(value, str) else ()
            except NotAnExpression as problem:
                raise NotAnExpression(problem.why, name) from None
            needs[name] = {node.id for node in nodes if isinstance(node, ast.Name) and node.id in self.given}
        try:
            order = [*TopologicalSorter(needs).static_order()]
        except CycleError as error:
            circle = error.args[1][::-1]
            names = circle if len(circle) <= MOST_NAMED else [*circle[:MOST_NAMED], "...", circle[-1]]
            raise NotAnExpression(f"variables that depend on themselves: {' -> '.join(names)}", circle[0]) from None
        for name in order:
            value = self.given[name]
            try:
                if isinstance(value, str) and is_plain(value):
                    raise NotAnExpression(f"a number is written without quotes: {value.strip()}")
                known = self.number(value) if isinstance(value, str) else self._called(float, [value], shown(value))
                if not math.isfinite(known):
                    raise NotAnExpression(f"a finite number is needed, not {shown(value)}")
            except NotAnExpression as problem:
                raise NotAnExpression(problem.why, name) from None
            self._known[name] = known

    def number(self, text: str) -> float:
        """The value of an expression.

        Raises
        ------
        NotAnExpression
            When it is none, or has no finite value.

        Examples
        --------
        >>> Variables({"a": 30, "b": "2 * a"}, math.pi / 180).number("b / 4 + cos(0)")
        16.0
        """
        try:
            node = _parsed(text)
            value = self._value(node, text)
            size = abs(value)
            if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub):
                # A difference is rounded as its larger part is.
                size = max(abs(self._value(part, text)) for part in (node.left, node.right))
        except RecursionError:
            raise NotAnExpression(f"{shown(text)} is nested too deep") from None
        if not math.isfinite(value):
            raise NotAnExpression(f"{shown(text)} has no finite value")
        return _settled(value, size)

    def _variable(self, name: str) -> float:
        if name in self._known:
            return self._known[name]
        if name in TAKES:
            raise NotAnExpression(f"{name} is a function: {name}(...)")
        if not self.given:
            raise NotAnExpression(f"{shown(name)} is neither a number nor a variable; the file has no [variables]")
        raise NotAnExpression(lambda: not_known(name, "one of [variables]", [*self.given, *CONSTANTS]))

    def _value(self, node: ast.expr, text: str) -> float:
        match node:
            case ast.Constant(value=bool() | complex()):
                pass
            case ast.Constant(value=int() | float() as value):
                return self._called(float, [value], text)
            case ast.Name(id=name):
                return CONSTANTS[name] if name in CONSTANTS else self._variable(name)
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
                    if self.angle == DEGREE and values[0] % EXACT == 0.0:
                        return self._called(_exact, [name, values[0]], text)
                    return self._called(FROM_ANGLE[name], [values[0] * self.angle], text)
                if name in TO_ANGLE:
                    return self._called(TO_ANGLE[name], values, text) / self.angle
                return self._called(PLAIN[name], values, text)
            case ast.Call(func=ast.Name(id=name)) if name not in TAKES:
                raise NotAnExpression(f"{shown(text)}: {not_known(name, 'a function', sorted(TAKES))}")
        raise NotAnExpression(
            f"{shown(text)} is not an expression: numbers, + - * / **, parentheses, variables, pi and {listed(TAKES)}"
        )

    @staticmethod
    def _called(function: Callable[..., float], values: list[Any], text: str) -> float:
        try:
            return float(function(*values))
        except (ValueError, ZeroDivisionError, OverflowError):
            raise NotAnExpression(f"{shown(text)} has no finite value") from None


def _settled(value: float, size: float) -> float:
    """The number of few digits that a value is but for rounding, where there is one.

    Examples
    --------
    >>> _settled(0.1 * 3, 0.3), _settled(0.1 + 0.2 - 0.3, 0.3), _settled(2 / 3, 2 / 3)
    (0.3, 0.0, 0.6666666666666666)
    """
    within = ROUNDING * math.ulp(size)
    near = float(f"{value:.{FEW_DIGITS}g}") if abs(value) > within else 0.0
    return near if abs(near - value) <= within else value


def _exact(name: str, degrees: float) -> float:
    """Sine, cosine or tangent of a multiple of 30 degrees."""
    turned = round(degrees % 360.0 / EXACT)
    sine, cosine = SINES[turned % 12], SINES[(turned + 3) % 12]
    return {"sin": sine, "cos": cosine}[name] if name != "tan" else sine / cosine


def _parsed(text: str) -> ast.expr:
    if len(text) > LONGEST:
        raise NotAnExpression(f"{shown(text)} is longer than {LONGEST} characters")
    try:
        if FOREIGN.search(text):
            raise SyntaxError
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
