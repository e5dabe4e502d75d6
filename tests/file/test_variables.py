"""Variables and expressions: any number of the file may be one."""

import ast
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import jointplay as jp
from helpers.answers import require_refused
from jointplay.cli import run
from jointplay.file.schema.expressions import LONGEST, NotAnExpression, Variables

SLIDER_CRANK = """
format = 1
units = { length = "mm", angle = "deg", force = "N" }

[variables]
a = 40
b = "3 * a"
play = "a / 400"
lean = "atan2(3, 4)"

[joints]
A = { type = "revolute", on = { ground = [0, 0], crank = [0, 0] }, clearance = { radial = "play" } }
B = { type = "revolute", on = { crank = ["a", 0], rod = [0, 0] }, clearance = { diametral = "4 * play * sin(30)" } }
C = { type = "revolute", on = { rod = ["b", 0], slider = [0, 0] }, clearance = { radial = "play" } }
D = { type = "prismatic", on = { ground = { at = [0, 0], axis = [1, 0] }, slider = { at = [0, 0], axis = [1, 0] } } }

[start]
slider = { x = "a + b" }

[drives]
theta = { joint = "A", values = [30, "lean + 30", "2 * lean"], error = "play / 2" }

[output]
body = "slider"
at = "C"

[[loads]]
force = ["-10 * cos(60)", 0]

[dimensions.rod]
body = "rod"
between = ["B", "C"]
tolerance = "play / 10"
"""
LEAN = math.degrees(math.atan2(3, 4))
#: the same with the numbers written out
WRITTEN: dict[str, object] = {
    "variables": None,
    "joints.A.clearance.radial": 0.1,
    "joints.B.clearance.diametral": 0.2,
    "joints.C.clearance.radial": 0.1,
    "joints.B.on.crank": [40.0, 0],
    "joints.C.on.rod": [120.0, 0],
    "start.slider.x": 160.0,
    "drives.theta.values": [30, LEAN + 30, 2 * LEAN],
    "drives.theta.error": 0.05,
    "loads.0.force": [-5.0, 0],
    "dimensions.rod.tolerance": 0.01,
}


def test_a_file_with_variables_is_the_file_with_the_numbers() -> None:
    m = jp.loads(SLIDER_CRANK)
    written = m.with_(WRITTEN)
    assert "variables" not in written.raw
    for ask in (jp.worst, jp.loaded, jp.solve):
        found, expected = ask(m), ask(written)
        for name in found.data_vars:
            if found[name].dtype.kind == "f":
                # cos(60) and sin(30) are rounded.
                np.testing.assert_allclose(found[name], expected[name], rtol=1e-9, atol=1e-12, err_msg=str(name))


def test_variables_are_set_and_swept_like_any_key() -> None:
    m = jp.loads(SLIDER_CRANK)
    values = [0.05, 0.1, 0.2]
    swept = jp.sweep(m, "variables.play", values)
    for k, play in enumerate(values):
        alone = jp.worst(m.with_({"variables.play": play}))
        np.testing.assert_array_equal(swept.worst_position[k], alone.worst_position)
    assert swept.worst_position[2, 0] > 1.9 * swept.worst_position[1, 0]


def test_a_name_stays_a_name() -> None:
    """`at` may be a point or the name of a joint: a variable of the same name does not make it a number."""
    m = jp.loads(SLIDER_CRANK.replace('b = "3 * a"', 'b = "3 * a"\nC = 7'))
    assert m.data.output.at == "C"
    assert m.with_({"output.at": ["C", "-C"]}).data.output.at == (7.0, -7.0)


def test_a_wildcard_reaches_a_size_in_other_words() -> None:
    """The joint in whose file the diameter stands has half of the expression as its radius."""
    m = jp.loads(SLIDER_CRANK)
    radius = m.value("joints.B.clearance.radial")
    np.testing.assert_allclose(m.with_({"joints.A.clearance.radial": radius}).data.joints["A"].clearance.radial, 0.1)


def test_angles_are_in_the_unit_of_the_file() -> None:
    text = SLIDER_CRANK.replace('angle = "deg"', 'angle = "rad"').replace("sin(30)", "sin(pi / 6)")
    m = jp.loads(text.replace('[30, "lean + 30", "2 * lean"]', '["lean"]').replace("cos(60)", "cos(pi / 3)"))
    assert m.data.drives["theta"].values == pytest.approx((math.atan2(3, 4),))
    assert m.data.joints["B"].clearance.diametral == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("old", "new", "key", "said"),
    [
        ('"a / 400"', '"a /"', "variables.play", "is not an expression such as"),
        ('"3 * a"', '"3 * b"', "variables.b", "depend on themselves: b -> b"),
        ('a = 40\nb = "3 * a"', 'a = "b / 3"\nb = "3 * a"', "variables.a", "themselves: a -> b -> a"),
        ('"3 * a"', '"3 * lena"', "variables.b", "did you mean 'lean'?"),
        (
            'clearance = { radial = "play" } }\nB',
            'clearance = { radial = "ply" } }\nB',
            "joints.A.clearance.radial",
            "'play'",
        ),
        ('"a / 400"', '"__import__(1)"', "variables.play", "is not a function; known: abs"),
        ('"a / 400"', '"open(1)"', "variables.play", "is not a function"),
        ('"a / 400"', '"a.real"', "variables.play", "is not an expression: numbers, +"),
        ('"a / 400"', '"(lambda: 1)()"', "variables.play", "is not an expression"),
        ('"a / 400"', '"[a for a in (1,)][0]"', "variables.play", "is not an expression"),
        ('"a / 400"', '"a if a else 2"', "variables.play", "is not an expression"),
        ('"a / 400"', '"True"', "variables.play", "is not an expression"),
        ('"a / 400"', '"1j"', "variables.play", "is not an expression"),
        ('"a / 400"', '"a^2"', "variables.play", "a power is written a**2"),
        ('"a / 400"', '"9**9**9**9"', "variables.play", "has no finite value"),
        ('"a / 400"', '"1*' + "9" * 400 + '"', "variables.play", "is longer than 300 characters"),
        ("a = 40", "a = 1" + "1" * 400, "variables.a", "has no finite value"),
        ('"a / 400"', '"0.1"', "variables.play", "a number is written without quotes: 0.1"),
        ('"a / 400"', '"sqrt + 1"', "variables.play", "sqrt is a function"),
        ("a = 40", "inf = 40", "variables", "has a meaning"),
        ("a = 40", "in = 40", "variables", "is not the name of a variable"),
        ("a = 40", '"\u00b5" = 40', "variables", "is not the name of a variable"),
        ('"a / 400"', '"sqrt(-a)"', "variables.play", "has no finite value"),
        ('"a / 400"', '"(-a)**0.5"', "variables.play", "has no finite value"),
        ('"a / 400"', '"a / (3 * a - b)"', "variables.play", "has no finite value"),
        ('"a / 400"', '"sqrt(a, 2)"', "variables.play", "sqrt takes 1 value"),
        ('"a / 400"', '"max(a)"', "variables.play", "max takes 2 or more values"),
        ('"a / 400"', '"' + "(" * 200 + "a" + ")" * 200 + '"', "variables.play", "longer than 300 characters"),
        ('"a / 400"', '"-a / 400"', "joints.A.clearance.radial", "must not be negative: -0.1"),
        ("a = 40", "a = true", "variables.a", "a number is needed, not true"),
        ("a = 40", "a = [40]", "variables.a", "number"),
        ("a = 40", "a = nan", "variables.a", "finite number"),
        ("a = 40", "pi = 40", "variables", "has a meaning in expressions already"),
        ("a = 40", '"a b" = 40', "variables", "is not a name"),
        ("a = 40", "3a = 40", "variables", "is not the name of a variable"),
        ('["b", 0]', '["b + ", 0]', "joints.C.on.rod.0", "is not an expression such as"),
        (
            'radial = "play" } }\nB',
            'radial = "0.1" } }\nB',
            "joints.A.clearance.radial",
            'a number is needed, not "0.1"',
        ),
    ],
)
def test_what_is_no_number_is_refused_by_its_key(old: str, new: str, key: str, said: str) -> None:
    require_refused(SLIDER_CRANK, old, new, key, said)


def test_variables_may_need_each_other_in_any_order() -> None:
    """A thousand variables, each of which needed the next one, ended in a traceback."""
    chain = "\n".join(f'v{k} = "v{k + 1} + 1"' for k in range(1000)) + "\nv1000 = 1"
    m = jp.loads(SLIDER_CRANK.replace("a = 40", f'{chain}\na = "v0 - 961"'))
    assert m.data.joints["B"].on["crank"].at == (40.0, 0.0)
    circle = chain.replace("v1000 = 1", 'v1000 = "v0"')
    with pytest.raises(jp.InputError, match=r"themselves: v\d+ -> .* -> \.\.\. -> v\d+"):
        jp.loads(SLIDER_CRANK.replace("a = 40", f"a = 40\n{circle}"))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('at = "C"', 'at = "C"\n[limits]\njoints = "a"', 'a table is needed, not "a"'),
        ('length = "mm"', 'length = "a"', '"a" is not valid here'),
        ('length = "mm"', 'length = "mmm"', "'mm'"),
        ('radial = "play" } }\nB', 'radial = "play", law = "unifrom" } }\nB', "did you mean 'uniform'?"),
        ('radial = "play" } }\nB', 'radial = "play", law = "a" } }\nB', '"a" is not valid here'),
        ('between = ["B", "C"]', 'between = ["a"]', "two values are needed"),
        ("format = 1", 'format = "a / 40"', 'format = 1, not "a / 40"'),
        ("format = 1", 'format = "a +"', 'format = 1, not "a +"'),
        ("format = 1", 'format = 1\ninclude = ["leg.toml"]', "not in a text or a change"),
    ],
)
def test_a_word_that_is_no_number_keeps_its_message(old: str, new: str, said: str) -> None:
    """A misspelt word was called an unknown variable, and one that is a variable's name too became a number."""
    require_refused(SLIDER_CRANK, old, new, "", said)


def test_an_expression_needs_no_variables() -> None:
    m = jp.loads(jp.examples.text("four-bar")).with_({"joints.J1.clearance.radial": "sqrt(2) / 10"})
    assert m.data.joints["J1"].clearance.radial == math.sqrt(2) / 10
    with pytest.raises(jp.InputError, match='a number is needed, not "wide"'):
        m.with_({"joints.J1.clearance.radial": "wide"})
    with pytest.raises(jp.InputError, match="is not a variable"):
        jp.loads(SLIDER_CRANK).with_({"variables.plya": 0.2})


def test_the_command_sets_a_variable(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.toml"
    path.write_text(SLIDER_CRANK)
    twice = jp.worst(jp.load(path).with_({"variables.play": 0.2}))
    said = f"{float(twice.worst_position[0]):.3f}"
    assert run(["error", str(path), "-q", "worst", "--set", "variables.play=2 * a / 400"]) == 0
    assert said in capsys.readouterr().out
    assert run(["sweep", str(path), "--set", "variables.play=0.1,0.2"]) == 0
    assert said in capsys.readouterr().out


def test_the_command_reads_expressions_wherever_it_reads_numbers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A list was split at the comma of atan2(3, 4), and numbers beside expressions were refused."""
    path = tmp_path / "m.toml"
    path.write_text(SLIDER_CRANK)
    assert run(["sweep", str(path), "--set", "variables.lean=atan2(3, 4)", "--set", "variables.play=0.1,a/200"]) == 0
    numbers = capsys.readouterr().out
    assert run(["sweep", str(path), "--set", "variables.play=a/400:max(0.2, a/1000):2"]) == 0
    assert capsys.readouterr().out == numbers
    assert run(["error", str(path), "--offset", "A=play/2,-play/2"]) == 0
    offsets = capsys.readouterr().out
    assert run(["error", str(path), "--offset", "A=0.05,-0.05"]) == 0
    assert capsys.readouterr().out == offsets
    assert run(["map", str(path), "--grid", "theta=0:2*lean:3", "-q", "solve"]) == 0
    assert run(["error", str(path), "--offset", "A=ply,0"]) == 2
    assert "did you mean 'play'?" in capsys.readouterr().err
    assert run(["map", str(path), "--grid", "theta=0:lena:3"]) == 2
    assert "did you mean 'lean'?" in capsys.readouterr().err
    assert run(["sweep", str(path), "--set", "variables.play=0.1,wide"]) == 2
    assert "values are all numbers or all words; 'wide' is not one of" in capsys.readouterr().err


def _both(form: str, *parts: tuple[str, str], python: str = "") -> tuple[str, str]:
    """An expression in the words of a file and of Python, where a power of a negative number is no complex one."""
    return form.format(*(p[0] for p in parts)), (python or form).format(*(p[1] for p in parts))


def _operation(a: tuple[str, str], sign: str, b: tuple[str, str]) -> tuple[str, str]:
    return _both(f"({{}} {sign} {{}})", a, b, python="pow({}, {})" if sign == "**" else "")


NUMBERS = st.floats(-50, 50).map(lambda x: round(x, 3)).map(lambda x: f"({x})")
EXPRESSIONS = st.recursive(
    st.one_of(NUMBERS, st.sampled_from(["a", "b", "pi"])).map(lambda text: (text, text)),
    lambda inner: st.one_of(
        st.builds(_operation, inner, st.sampled_from(["+", "-", "*", "/", "**"]), inner),
        st.builds(_both, st.sampled_from([f"{f}({{}})" for f in ("sqrt", "sin", "cos", "tan", "exp", "abs")]), inner),
        st.builds(_both, st.sampled_from([f"{f}({{}}, {{}})" for f in ("min", "max", "hypot")]), inner, inner),
        st.builds(_both, st.just("(-{})"), inner),
    ),
    max_leaves=8,
)


def _of_python(python: str | ast.expr) -> float:
    names: dict[str, Any] = {name: getattr(math, name) for name in ("sqrt", "sin", "cos", "tan", "exp", "pow", "hypot")}
    names |= {"abs": abs, "min": min, "max": max, "a": 2.5, "b": 5.0, "pi": math.pi}
    code = python if isinstance(python, str) else compile(ast.Expression(python), "", "eval")
    return float(eval(code, {"__builtins__": {}}, names))


@settings(max_examples=300, deadline=None)
@given(EXPRESSIONS)
def test_values_are_those_of_python(both: tuple[str, str]) -> None:
    """But for what rounding keeps from a number of few digits."""
    text, python = both
    try:
        expected = _of_python(python)
    except (ValueError, ZeroDivisionError, OverflowError):
        expected = math.nan
    if math.isfinite(expected) and len(text) <= LONGEST:
        found = Variables({"a": 2.5, "b": "2 * a"}, 1.0).number(text)
        match ast.parse(python, mode="eval").body:
            case ast.BinOp(left=left, op=ast.Add() | ast.Sub(), right=right):
                size = max(abs(_of_python(left)), abs(_of_python(right)))
            case _:
                size = abs(expected)
        assert abs(found - expected) <= 4 * math.ulp(size)
        assert found == expected or found == float(f"{found:.12g}")
    else:
        with pytest.raises(NotAnExpression):
            Variables({"a": 2.5, "b": "2 * a"}, 1.0).number(text)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("180 * sin(30)", 90.0),
        ("sin(180)", 0.0),
        ("cos(-90)", 0.0),
        ("cos(420)", 0.5),
        ("tan(-135)", 1.0),
        ("asin(0.5)", 30.0),
        ("3 * 0.1", 0.3),
        ("0.3 - 3 * 0.1", 0.0),
        ("0.1 + 0.2 - 0.3", 0.0),
        ("sqrt(2) * sqrt(2)", 2.0),
        ("sqrt(2)", math.sqrt(2)),
        ("1 / 3", 1 / 3),
        ("1e-30 / 3", 1e-30 / 3),
    ],
)
def test_rounding_does_not_miss_a_number_that_is_meant(text: str, value: float) -> None:
    """A range to "180 * sin(30)" did not hold 90, and "0.3 - 3 * 0.1" was negative."""
    assert Variables({}, math.pi / 180).number(text) == value


def test_a_tangent_of_a_right_angle_has_no_value() -> None:
    with pytest.raises(NotAnExpression, match="has no finite value"):
        Variables({}, math.pi / 180).number("tan(90)")


@pytest.mark.parametrize("axis", ["1" * 400, f"[{'1' * 400}, 0]", "nan", "[inf, 1]"])
def test_a_direction_of_hundreds_of_digits_is_refused(axis: str) -> None:
    """It ended in a traceback."""
    text = SLIDER_CRANK.replace("axis = [1, 0]", f"axis = {axis}", 1)
    with pytest.raises(jp.InputError, match=r"a direction .* is needed"):
        jp.loads(text)


def test_a_mistake_of_a_table_as_a_whole_is_not_blamed_on_the_first_expression() -> None:
    """A joint without its bodies was reported as `shaft.at.0: a number is needed, not "base"`, of another joint."""
    m = jp.loads(jp.examples.text("delta-by-hand"))
    with pytest.raises(jp.InputError, match=r"patterns\.arm\.joints\.wrista: say where it sits"):
        m.with_({"patterns.arm.joints.wrista.bodies": None})
