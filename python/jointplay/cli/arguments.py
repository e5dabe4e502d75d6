"""What is written on the command line as values: `KEY=VALUE`, lists of numbers, ranges."""

from collections.abc import Callable, Sequence
from typing import Any

from jointplay.errors import InputError, shown
from jointplay.file import toml

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


NOT_NUMBERS = "is not a number, or numbers with commas between them"
#: finds the value of an expression; raises ValueError
Read = Callable[[str], float]


def numbers(
    text: str, option: str, counts: tuple[int, ...] | None = None, read: Read = float
) -> float | tuple[float, ...]:
    """Numbers or expressions between commas; a single one as it is.

    Raises
    ------
    InputError
        When something is not a number, or there are not as many as `counts` allows.
    """
    try:
        found = tuple(_bounded(part, option, read) for part in parts(text, ","))
    except ValueError as error:
        why = f": {error}" if read is not float and not _looks_plain(text) else ""
        raise InputError(f"{shown(text)} {NOT_NUMBERS}{why}", key=option) from None
    if counts is not None and len(found) not in counts:
        wanted = " or ".join(map(str, counts))
        raise InputError(f"needs {wanted} numbers with commas between them, not {shown(text)}", key=option)
    return found[0] if len(found) == 1 and counts is None else found


def parts(text: str, mark: str) -> list[str]:
    """What stands between the marks outside of brackets.

    Examples
    --------
    >>> parts("0.1,atan2(3, 4),a / 2", ",")
    ['0.1', 'atan2(3, 4)', 'a / 2']
    """
    found, depth = [""], 0
    for character in text:
        depth += (character in "([{") - (character in ")]}")
        if character == mark and depth <= 0:
            found.append("")
        else:
            found[-1] += character
    return [part.strip() for part in found]


def _looks_plain(text: str) -> bool:
    """Whether a text has no expression in it, but a slip in a list of numbers."""
    return set(text) <= set("0123456789.eE+-:, ")


def _bounded(text: str, option: str, read: Read) -> float:
    """A number, within what a file may have."""
    from jointplay.file.schema.values import LARGEST

    try:
        number = float(text)
    except ValueError:
        number = read(text)
    if not abs(number) <= LARGEST:
        raise InputError(f"{shown(text)} is not a number up to {LARGEST:.0e}", key=option)
    return number


def only_set(settings: dict[str, str]) -> dict[str, str]:
    """The settings of a sweep that are not swept."""
    return {key: text for key, text in settings.items() if not _is_swept(text)}


def swept(settings: dict[str, str], read: Read = float, option: str = "--set") -> tuple[list[str], list[float | str]]:
    """Which keys are swept, and over which values.

    ``KEY=0:1:11`` and ``KEY=1,2,5`` sweep; several swept keys need the same values.

    Examples
    --------
    >>> swept({"joints.*.clearance.radial": "0:1:3", "drives.theta1.error": "0.1"})
    (['joints.*.clearance.radial'], [0.0, 0.5, 1.0])
    """
    ranges = {key: _steps(text, f"{option} {key}", read) for key, text in settings.items() if _is_swept(text)}
    if not ranges:
        raise InputError(f"say what is swept: {option} KEY=from:to:count, or KEY=1,2,5", key=option)
    values = next(iter(ranges.values()))
    for key, steps in ranges.items():
        if steps != values:
            raise InputError(
                f"{key} has other values than {next(iter(ranges))}; keys that are swept together share them, and --by "
                "sweeps a second one",
                key="--set",
            )
    return list(ranges), values


def several(text: str, option: str, read: Read = float) -> list[float]:
    """The numbers of an option that takes one, several with commas between them, or a range.

    Examples
    --------
    >>> several("0.5:2:4", "--curve"), several("0.5,1", "--curve"), several("2", "--curve")
    ([0.5, 1.0, 1.5, 2.0], [0.5, 1.0], [2.0])
    """
    if len(parts(text, ":")) > 1:
        return [float(step) for step in _steps(text, option, read)]
    found = numbers(text, option, None, read)
    return [*found] if isinstance(found, tuple) else [found]


def gridded(settings: dict[str, str], read: Read = float) -> dict[str, float | list[float]]:
    """The grid of a map: ``KEY=from:to:count`` and ``KEY=1,2,5`` make an axis, ``KEY=0`` holds.

    Examples
    --------
    >>> gridded({"x": "-10:10:3", "angle": "0"})
    {'x': [-10.0, 0.0, 10.0], 'angle': 0.0}
    """
    grid: dict[str, float | list[float]] = {}
    for key, text in settings.items():
        if _is_swept(text) and len(parts(text, ",")) == 1:
            grid[key] = [float(step) for step in _steps(text, f"--grid {key}", read)]
            continue
        try:
            held = numbers(text, f"--grid {key}", None, read)
        except InputError as error:
            if len(parts(text, ",")) == 1:
                raise
            problem = error.problem.replace(NOT_NUMBERS, "is not from:to:count, 1,2,5 or a number", 1)
            raise InputError(problem, key=error.key) from None
        grid[key] = [*held] if isinstance(held, tuple) else held
    return grid


def _is_swept(text: str) -> bool:
    """Whether a text is a range or a list of values, and not one value of the file."""
    if text[:1] in ("[", "{", '"', "'"):
        return False
    ends = parts(text, ":")
    return len(parts(text, ",")) > 1 or (len(ends) > 1 and (_looks_plain(text) or _is_count(ends[2:])))


def _is_count(ends: list[str]) -> bool:
    return len(ends) == 1 and ends[0].isascii() and ends[0].isdigit()


def _steps(text: str, option: str, read: Read) -> list[float | str]:
    listed = parts(text, ",")
    if len(listed) > 1:
        return [value(part) for part in listed]
    ends = parts(text, ":")
    try:
        first, last, number = ends
        low, high, count = _bounded(first, option, read), _bounded(last, option, read), int(number)
    except ValueError as error:
        why = "" if _looks_plain(text) else f": {error}"
        problem = f"{shown(text)} is not from:to:count, such as 0:1:11{why}"
        raise InputError(problem, key=option) from None
    if not 2 <= count <= MOST_STEPS:
        raise InputError(f"{count} values; 2 to {MOST_STEPS} are possible", key=option)
    from jointplay.file.schema.values import spaced

    return [*spaced(low, high, count)]


def words(text: str | None) -> list[str] | None:
    """Words between commas; None where the option is left out."""
    return None if text is None else [word.strip() for word in text.split(",")]
