"""From what pydantic found to one line for people: the key, the value that stands there, and what would be valid."""

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from jointplay.errors import comma_hint, shown, split_hint, suggestion

COUNTS = {2: "two", 3: "three"}
#: values of a list of fixed length
LONGEST_ROW = 9
WORDS = {1: "one value is", 2: "two values are"}


def located(error: ValidationError, raw: object) -> tuple[str, str]:
    """Dotted key and sentence of the first mistake.

    Parameters
    ----------
    error : ValidationError
        As raised by a model of this package.
    raw : object
        The data that was validated.

    Returns
    -------
    tuple of str
        The dotted key (empty for the file as a whole) and the problem.
    """
    errors = error.errors(include_url=False)
    found = errors[0]
    kind, given, context = found["type"], found.get("input"), found.get("ctx", {})
    loc = found["loc"]
    if loc and loc[-1] == "[key]":
        name = loc[-2]
        return _key(loc[:-2], raw), _sentence(kind, given, context) if kind == "problem" else _name(str(name))
    if kind == "missing" and loc and isinstance(loc[-1], int):
        # One mistake for every value that is missing at the end of a list of fixed length.
        count = 1 + max(int(e["loc"][-1]) for e in errors if e["type"] == kind and e["loc"][:-1] == loc[:-1])
        return _key(loc[:-1], raw), f"{COUNTS.get(count, count)} values are needed, not {shown(given)}"
    return _key(loc, raw), _sentence(kind, given, context)


def _name(name: str) -> str:
    return f"{shown(name)} is not a name: no blanks and none of . / * = [ ] or quotes, up to 100 characters"


def place(loc: Sequence[int | str], raw: Any) -> tuple[int | str, ...]:
    """The part of pydantic's location that is in the file: it also names members of unions.

    Examples
    --------
    >>> place(("joints", "A", "<revolute>", "on", 0), {"joints": {"A": {"on": [1, 2]}}})
    ('joints', 'A', 'on', 0)
    """
    parts: list[int | str] = []
    here = raw
    for part in loc:
        in_table = isinstance(here, Mapping) and part in here
        in_list = isinstance(here, list | tuple) and isinstance(part, int) and part < len(here)
        if in_table or in_list:
            here = here[part]
            parts.append(part)
    return tuple(parts)


def _key(loc: Sequence[int | str], raw: Any) -> str:
    return ".".join(map(str, place(loc, raw)))


def _sentence(kind: str, given: object, context: Mapping[str, Any]) -> str:
    value = shown(given)
    match kind:
        case "problem":
            return str(context["message"])
        case "finite_number":
            return f"a finite number is needed, not {value}"
        case "float_type" | "int_type":
            hint = comma_hint(given) if isinstance(given, str) else ""
            return f"a {'whole ' * (kind == 'int_type')}number is needed, not {value}{hint}"
        case "greater_than_equal" | "less_than_equal" | "greater_than" | "less_than":
            return _bound(kind, value, context)
        case "string_type":
            return f"a text in quotes is needed, not {value}"
        case "bool_type":
            return f"true or false is needed, not {value}"
        case "literal_error":
            known = [word.strip(" '") for word in str(context["expected"]).replace(" or ", ",").split(",")]
            return f"{value} is not valid here; {suggestion(str(given), known)}"
        case "tuple_type":
            return f"a list in brackets is needed, not {value}"
        case "too_long":
            needed = int(context["max_length"])
            if needed > LONGEST_ROW:
                return f"at most {needed} values are possible, not {value}"
            return f"{needed} values are needed, not {value}{split_hint(given, needed)}"
        case "too_short":
            least = int(context["min_length"])
            if not context["actual_length"]:
                return f"the list is empty; at least {WORDS.get(least, least)} needed"
            return f"at least {WORDS.get(least, least)} needed, not {value}"
        case "dict_type" | "model_type":
            return f"a table is needed, not {value}"
    return f"{value} is not valid here ({kind.replace('_', ' ')})"


def _bound(kind: str, value: str, context: Mapping[str, Any]) -> str:
    limit = next(iter(context.values()))
    if limit == 0 and kind == "greater_than_equal":
        return f"must not be negative: {value}"
    if limit == 0 and kind == "greater_than":
        return f"must be greater than zero: {value}"
    words = {"greater_than_equal": "at least", "less_than_equal": "at most", "less_than": "less than"}
    return f"must be {words.get(kind, 'greater than')} {limit:.15g}: {value}"
