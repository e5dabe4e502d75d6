"""What is written on the command line as values: `KEY=VALUE`, lists of numbers, ranges."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from jointplay import toml
from jointplay.errors import InputError, shown

#: more steps than anybody waits for
MOST_STEPS = 100_000


def assignments(settings: Sequence[str], option: str) -> dict[str, str]:
    """`KEY=VALUE` pairs.

    Raises
    ------
    InputError
        When there is no `=`, or a key is given twice.
    """
    pairs: dict[str, str] = {}
    for setting in settings:
        key, sign, text = setting.partition("=")
        key = key.strip()
        if not sign or not key:
            raise InputError(f"{shown(setting)} is not KEY=VALUE", key=option)
        if key in pairs:
            raise InputError(f"{key} is given twice", key=option)
        pairs[key] = text.strip()
    return pairs


def value(text: str, key: str = "") -> Any:
    """A value as in the file; what is not TOML is text. The key is for messages.

    Examples
    --------
    >>> value("0.2"), value("[1, 2]"), value("normal")
    (0.2, [1, 2], 'normal')
    """
    try:
        parsed = toml.parse(f"value = {text}", key=key)
    except toml.NotToml:
        return text
    # Text with line ends could bring keys of its own.
    return parsed["value"] if len(parsed) == 1 else text


def numbers(text: str, option: str, counts: tuple[int, ...] | None = None) -> float | tuple[float, ...]:
    """Numbers between commas; a single one as it is.

    Raises
    ------
    InputError
        When something is not a number, or there are not as many as `counts` allows.
    """
    try:
        found = tuple(_bounded(part, option) for part in text.split(","))
    except ValueError:
        raise InputError(f"{shown(text)} is not a number, or numbers with commas between them", key=option) from None
    if counts is not None and len(found) not in counts:
        wanted = " or ".join(map(str, counts))
        raise InputError(f"needs {wanted} numbers with commas between them, not {shown(text)}", key=option)
    return found[0] if len(found) == 1 and counts is None else found


def _bounded(text: str, option: str) -> float:
    """A number, within what a file may have."""
    from jointplay.schema.values import LARGEST

    number = float(text)
    if not abs(number) <= LARGEST:
        raise InputError(f"{shown(text)} is not a number up to {LARGEST:.0e}", key=option)
    return number


def swept(settings: dict[str, str]) -> tuple[list[str], list[float | str], dict[str, str]]:
    """Which keys are swept over which values, and which are only set.

    ``KEY=0:1:11`` and ``KEY=1,2,5`` sweep; several swept keys need the same values.

    Examples
    --------
    >>> swept({"joints.*.clearance.radial": "0:1:3", "drives.theta1.error": "0.1"})
    (['joints.*.clearance.radial'], [0.0, 0.5, 1.0], {'drives.theta1.error': '0.1'})
    """
    ranges = {key: steps for key, text in settings.items() if (steps := _steps(key, text)) is not None}
    if not ranges:
        raise InputError("say what is swept: --set KEY=from:to:count, or KEY=1,2,5", key="--set")
    values = next(iter(ranges.values()))
    for key, steps in ranges.items():
        if steps != values:
            raise InputError(
                f"{key} has other values than {next(iter(ranges))}; keys that are swept together share them",
                key="--set",
            )
    return list(ranges), values, {key: text for key, text in settings.items() if key not in ranges}


def gridded(settings: dict[str, str]) -> dict[str, float | list[float]]:
    """The grid of a map: ``KEY=from:to:count`` and ``KEY=1,2,5`` make an axis, ``KEY=0`` holds.

    Examples
    --------
    >>> gridded({"x": "-10:10:3", "angle": "0"})
    {'x': [-10.0, 0.0, 10.0], 'angle': 0.0}
    """
    grid: dict[str, float | list[float]] = {}
    for key, text in settings.items():
        steps = _steps(key, text, "--grid")
        if steps is None:
            held = numbers(text, f"--grid {key}")
            steps = [*held] if isinstance(held, tuple) else [held]
        values = [step for step in steps if isinstance(step, int | float)]
        if len(values) < len(steps):
            raise InputError(f"{shown(text)} is not from:to:count, 1,2,5 or a number", key=f"--grid {key}")
        grid[key] = [float(v) for v in values] if len(values) > 1 else float(values[0])
    return grid


def _steps(key: str, text: str, option: str = "--set") -> list[float | str] | None:
    if text[:1] in ("[", "{", '"', "'"):
        return None
    if "," in text:
        return [value(part.strip()) for part in text.split(",")]
    if ":" not in text or not set(text) <= set("0123456789.eE+-: "):
        return None
    try:
        first, last, number = text.split(":")
        low, high, count = _bounded(first, option), _bounded(last, option), int(number)
    except ValueError:
        raise InputError(f"{shown(text)} is not from:to:count, such as 0:1:11", key=f"{option} {key}") from None
    if not 2 <= count <= MOST_STEPS:
        raise InputError(f"{count} values; 2 to {MOST_STEPS} are possible", key=f"{option} {key}")
    from jointplay.schema.values import spaced

    return [*spaced(low, high, count)]


def words(text: str | None) -> list[str] | None:
    """Words between commas; None where the option is left out."""
    return None if text is None else [word.strip() for word in text.split(",")]
