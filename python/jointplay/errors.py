"""What can go wrong with what the user gave. An outcome of an analysis is a status, never an exception."""

import difflib
import json
import re
import unicodedata
from collections.abc import Iterable
from importlib.util import find_spec

#: how many known names a message lists before it says how many more there are
LISTED = 24
#: the longest value a message repeats
SHOWN = 60
#: letters that are read as digits
LOOK_ALIKE = str.maketrans("lio", "110")
#: the longest name of a file, or key, that a message repeats as a whole
LONGEST = 500


#: a number with a decimal comma, and what is said of it
COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
POINTS = "decimals have a point, such as 0.5"
#: characters that show the text around them in another order
REVERSING = "\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"


class JointplayError(Exception):
    """Root of every exception that jointplay raises on purpose."""


class InputError(JointplayError):
    """Bad input. ``str()`` is one whole line: file, key, what is wrong with the value, what would have been valid.

    Parameters
    ----------
    problem : str
        What is wrong, and what would be valid.
    file : str
        Name of the mechanism file, or of whatever else was read.
    key : str
        Dotted key inside the file, such as ``joints.J1.clearance``.
    """

    def __init__(self, problem: str, *, file: str = "", key: str = "") -> None:
        self.problem = one_line(problem)
        self.file = _brief(one_line(file))
        self.key = _brief(one_line(key))
        super().__init__(": ".join(part for part in (self.file, self.key, self.problem) if part))

    def __reduce__(self) -> tuple[object, ...]:
        # Exceptions are rebuilt from their message by default, which would lose file and key across processes.
        return (_rebuilt, (self.problem, self.file, self.key))


def _brief(name: str) -> str:
    """A name; of one that is no name any more beginning and end."""
    return name if len(name) <= LONGEST else f"{name[:SHOWN]}...{name[-SHOWN:]}"


def require(package: str, extra: str, what: str) -> None:
    """Refuse what needs a package that is not installed.

    Parameters
    ----------
    package : str
        As it is imported.
    extra : str
        The group of packages of jointplay that it is in.
    what : str
        What needs it.

    Raises
    ------
    InputError
    """
    if find_spec(package) is None:
        raise InputError(f"{what} needs {package}: pip install 'jointplay[{extra}]'")


def _rebuilt(problem: str, file: str, key: str) -> InputError:
    return InputError(problem, file=file, key=key)


def one_line(text: str) -> str:
    """The text with everything escaped that a terminal would obey or break the line at.

    Examples
    --------
    >>> one_line("a title\\nin red: \\x1b[31m")
    'a title\\\\nin red: \\\\x1b[31m'
    """
    if text.isprintable():
        return text
    return "".join(c if _is_harmless(c) else c.encode("unicode_escape").decode() for c in text)


def _is_harmless(c: str) -> bool:
    """Whether a character only shows itself: also blanks of other widths and joiners, which some scripts need."""
    return c.isprintable() or (unicodedata.category(c) in ("Zs", "Cf") and c not in REVERSING)


def shown(value: object) -> str:
    """A value as the file would write it, shortened."""
    try:
        text = json.dumps(value, ensure_ascii=False, default=str)
    except (TypeError, ValueError, RecursionError):
        text = str(type(value).__name__)
    text = {"NaN": "nan", "Infinity": "inf", "-Infinity": "-inf"}.get(text, text)
    return text if len(text) <= SHOWN else text[: SHOWN - 3] + "..."


def in_range(value: int, key: str, what: str, low: int, high: int) -> None:
    """Refuse a count that is too small or too large.

    Raises
    ------
    InputError
        The message names the key, the value and the limits.
    """
    if not low <= value <= high:
        # Python refuses to write whole numbers of thousands of digits.
        said = str(value) if abs(value) < 10**SHOWN else "a number of many digits"
        raise InputError(f"{said} is not {what}; {low} to {high:.10g} are possible", key=key)


def comma_hint(text: str) -> str:
    """What is said beside a text that cannot be read because it is a number with a decimal comma; nothing of others.

    Examples
    --------
    >>> comma_hint("0,5"), comma_hint("a,5")
    ('; decimals have a point, such as 0.5', '')
    """
    return f"; {POINTS}" if COMMA.fullmatch(text) else ""


def split_hint(values: object, needed: int) -> str:
    """The same of a list with more numbers than are needed: ``[75,5, 0]`` is three numbers."""
    split = isinstance(values, list | tuple) and needed < len(values) <= 2 * needed
    return f" ({POINTS}: a comma begins the next value)" if split else ""


def listed(names: Iterable[str]) -> str:
    """Names in a row, at most `LISTED` of them."""
    names = list(names)
    more = len(names) - LISTED
    return ", ".join(names[:LISTED]) + (f" and {more} more" if more > 0 else "") if names else "none"


def nearest(word: str, known: Iterable[str], *, slips_only: bool = False) -> str | None:
    """The known name that somebody who wrote `word` probably meant; None when there is none, or more than one.

    Parameters
    ----------
    word : str
        What was written.
    known : iterable of str
        What would have been valid.
    slips_only : bool
        Whether only slips of the keyboard count; otherwise a name that shares most of its letters will do.

    Examples
    --------
    >>> nearest("radail", ["radial", "diametral"])
    'radial'
    >>> nearest("J7", ["J1", "J2"]) is None
    True
    >>> nearest("rodl", ["rod1", "rod2"])
    'rod1'
    """
    word = word[:SHOWN].lower()
    known = list(known)
    looks = word.translate(LOOK_ALIKE)
    near = [(name, name[:SHOWN].lower()) for name in known]
    ranked = sorted(
        (low.translate(LOOK_ALIKE) != looks, _distance(word, low), len(name) != len(word), name) for name, low in near
    )
    if ranked and ranked[0][1] <= max(1, len(word) // 3) and ranked[0][1] < len(word):
        # The same slip from two names says nothing about which was meant.
        alone = len(ranked) == 1 or ranked[0][:3] != ranked[1][:3]
        return ranked[0][3] if alone else None
    return None if slips_only else next(iter(difflib.get_close_matches(word, known, n=1)), None)


def _distance(a: str, b: str) -> int:
    """Insertions, deletions, substitutions and swaps of neighbours that lead from one word to the other."""
    before: list[int] = []
    row = list(range(len(b) + 1))
    for i, x in enumerate(a, 1):
        before, above, row = row, before, [i]
        for j, y in enumerate(b, 1):
            best = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (x != y))
            if i > 1 and j > 1 and x == b[j - 2] and a[i - 2] == y:
                best = min(best, above[j - 2] + 1)
            row.append(best)
    return row[-1]


def suggestion(word: str, known: Iterable[str]) -> str:
    """``did you mean 'radial'? Known: diametral, law, radial`` for a word that is not among the known ones."""
    known = list(known)
    near = nearest(word, known)
    return f"did you mean '{near}'? Known: {listed(known)}" if near else f"known: {listed(known)}"


def not_known(word: str, what: str, known: Iterable[str]) -> str:
    """``'crnk' is not a body; did you mean 'crank'? Known: crank, rocker``."""
    return f"'{word[:SHOWN]}' is not {what}; {suggestion(word, known)}"
