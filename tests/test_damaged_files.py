"""Damaged files: whatever stands in them, the answer is one line or a mechanism, never a traceback."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Callable
from typing import Any

import pytest
import tomlkit
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from jointplay import examples
from jointplay.errors import InputError
from jointplay.mobility import require_determinate
from jointplay.model import Mechanism, load, loads

TEXTS = {name: examples.text(name) for name in examples.names()}
DAMAGE = settings(max_examples=250, deadline=None, suppress_health_check=[HealthCheck.too_slow])
WEIRD: list[Any] = [
    0, -1, 1e-300, 1e300, -1e12, 2**63, float("nan"), float("inf"), True, "", "ground", "J1", "a\nb", "{}", [],
    [0], [0, 0], [[0, 0]], [1, "x"], {}, {"at": [0, 0]}, {"x": 1}, {"sigma": 0.1}, {"radial": 0.1},
]  # fmt: skip


def survive(read: Callable[[], Mechanism]) -> None:
    """Only InputError, with one line, or a mechanism that the core takes; any other exception fails the test."""
    said = "damaged.toml: "
    try:
        require_determinate(read())
    except InputError as error:
        said = str(error)
    assert "damaged.toml: " in said
    assert said.isprintable()
    assert len(said) < 2000


@DAMAGE
@given(st.sampled_from(sorted(TEXTS)), st.data())
def test_bytes_flipped_deleted_repeated_or_cut_off(
    tmp_path_factory: pytest.TempPathFactory, name: str, data: st.DataObject
) -> None:
    content = bytearray(TEXTS[name].encode())
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, max(0, len(content) - 1)))
        length = data.draw(st.integers(1, 30))
        match data.draw(st.sampled_from(["flip", "put", "delete", "repeat", "cut"])):
            case "flip" if content:
                content[at] ^= 1 << data.draw(st.integers(0, 7))
            case "put":
                content[at:at] = data.draw(
                    st.sampled_from([b"0", b"-", b"9", b".", b"e", b'"', b"[", b"]", b"=", b"\n", b"\0"])
                )
            case "delete":
                del content[at : at + length]
            case "repeat":
                content[at:at] = content[at : at + length]
            case "cut":
                del content[at:]
    path = tmp_path_factory.getbasetemp() / "damaged.toml"
    path.write_bytes(bytes(content))
    survive(lambda: load(path))


def places(node: Any, above: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    below = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [p for key, value in below for p in [(*above, key), *places(value, (*above, key))]]


def at(node: Any, steps: tuple[str | int, ...]) -> Any:
    for step in steps:
        node = node[step]
    return node


@DAMAGE
@given(st.sampled_from(sorted(TEXTS)), st.data())
def test_keys_renamed_values_swapped_tables_removed(name: str, data: st.DataObject) -> None:
    raw = tomllib.loads(TEXTS[name])
    for _ in range(data.draw(st.integers(1, 3))):
        spots = places(raw)
        if not spots:
            break
        spot = data.draw(st.sampled_from(spots))
        table, key = at(raw, spot[:-1]), spot[-1]
        match data.draw(st.sampled_from(["weird", "swap", "remove", "rename", "negate"])):
            case "weird":
                table[key] = copy.deepcopy(data.draw(st.sampled_from(WEIRD)))
            case "swap":
                table[key] = tomllib.loads(TEXTS[name])
                table[key] = at(table[key], data.draw(st.sampled_from(places(table[key]))))
            case "remove":
                del table[key]
            case "rename" if isinstance(table, dict):
                table[data.draw(st.sampled_from(["x", "type", "at", "output", "ground", "Ω", "a b"]))] = table.pop(key)
            case "negate" if isinstance(table[key], int | float):
                table[key] = -table[key]
    try:
        text = tomlkit.dumps(raw)
    except (TypeError, ValueError):
        return
    survive(lambda: loads(text, "damaged.toml"))


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=300))
def test_any_bytes_at_all(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "any.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"any\.toml: "):
        load(path)
