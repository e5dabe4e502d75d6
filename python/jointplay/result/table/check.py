"""What a mechanism is made of, in tables."""

from collections.abc import Iterator

from jointplay.core.compile import LENGTHS
from jointplay.result import Result
from jointplay.result.conclusions import owners, plural

from .layout import Column, ResultTable, fixed, in_one_unit, words

WORDS = {"pin_in_slot": "pin in slot"}
#: what is listed by name where the file has several
SEVERAL = {"outputs": "Outputs", "load_cases": "Load cases"}


def overview(result: Result) -> list[ResultTable]:
    """Joints, sources of error, drives, and how it all can move."""
    tables = [_joints(result)]
    if "member" in result.coords:
        tables.append(_members(result))
    if "spring" in result.coords:
        tables.append(_springs(result))
    if "source" in result.coords:
        tables.append(_sources(result))
    if "clearance" in result.coords:
        tables.append(_plays(result))
    tables.append(_mobility(result))
    return tables


def _joints(result: Result) -> ResultTable:
    inner = set(result.get("member_joint").tolist()) if "member" in result.coords else set()
    rows = [k for k, name in enumerate(result.labels("joint")) if name not in inner]
    names = [result.labels("joint")[k] for k in rows]
    kinds, first, second = (result.get(name)[rows] for name in ("joint_kind", "first_body", "second_body"))
    driven = result.get("driven_joint").tolist() if "driven_joint" in result.data else []
    names_of_drives = result.labels("drive") if driven else []
    moves = [(joint, drive) for many, drive in zip(driven, names_of_drives, strict=True) for joint in many.split(", ")]
    columns = [
        words("joint", names, is_key=True),
        words("type", [WORDS.get(kind, kind) for kind in kinds.tolist()]),
        words("carried by", first.tolist()),
        words("rides on it", second.tolist()),
    ]
    if moves:
        drives: dict[str, list[str]] = {}
        for joint, drive in moves:
            drives.setdefault(joint, []).append(drive)
        columns.append(words("driven by", [", ".join(drives.get(name, ())) for name in names]))
    title = f"{plural(len(_bodies(result)), 'body', 'bodies')}, {plural(len(names), 'joint', 'joints')}"
    return ResultTable(title, tuple(columns))


def _bodies(result: Result) -> list[int]:
    """Places of the bodies of the file among all, those of further pieces of an elastic one left out."""
    names = owners(result)
    return [names.index(owner) for owner in dict.fromkeys(names)]


def _members(result: Result) -> ResultTable:
    stiffness, length = result.get("member_stiffness"), result.get("member_length")
    axially = tuple("rigid" if value == float("inf") else f"{value:.6g}" for value in stiffness.tolist())
    columns = (
        words("member", result.labels("member"), is_key=True),
        Column("length", result.unit("member_length"), tuple(f"{value:.4g}" for value in length.tolist())),
        Column("stiffness along it", result.unit("member_stiffness"), axially),
    )
    return ResultTable(plural(len(stiffness), "elastic member", "elastic members"), columns)


def _springs(result: Result) -> ResultTable:
    names = result.labels("spring")
    stiffness = tuple(f"{value:.6g}" for value in result.get("spring_stiffness").tolist())
    columns = (
        words("spring", names, is_key=True),
        words("on", result.get("spring_on").tolist()),
        *in_one_unit([Column("stiffness", "", stiffness)], result.coords["spring_unit"].values.tolist()),
    )
    return ResultTable(plural(len(names), "spring", "springs"), columns)


def _sources(result: Result) -> ResultTable:
    names = result.labels("source")
    sizes = tuple(f"{value:.4g}" for value in result.get("size").tolist())
    units = result.coords["source_unit"].values.tolist()
    columns = (
        words("source", names, is_key=True),
        words("kind", result.coords["source_kind"].values.tolist()),
        *in_one_unit([Column("up to", "", sizes)], units),
    )
    return ResultTable(plural(len(names), "source of error", "sources of error"), columns)


def _plays(result: Result) -> ResultTable:
    """The clearances whose size scatters, with the travel of the pin from side to side."""
    names, play = result.labels("clearance"), result.get("play")
    columns = (
        words("clearance", names, is_key=True),
        words("given as", result.get("play_given").tolist()),
        Column("play, from", result.unit("play"), tuple(f"{value:.4g}" for value in play[:, 0].tolist())),
        Column("to", result.unit("play"), tuple(f"{value:.4g}" for value in play[:, 1].tolist())),
    )
    tight = [name for name, value in zip(names, play[:, 0].tolist(), strict=True) if value < 0.0]
    notes = (f"Pairs with interference have no play: {', '.join(tight)}.",) if tight else ()
    count = plural(len(names), "clearance whose size scatters", "clearances whose sizes scatter")
    return ResultTable(f"{count}: travel from side to side", columns, notes)


def _mobility(result: Result) -> ResultTable:
    frame = result.labels("component")
    guess = result.get("guess")
    rows = _bodies(result)
    columns = [words("body", [result.labels("body")[k] for k in rows], is_key=True)]
    for k, name in enumerate(frame):
        places = 3 if name in LENGTHS else 2
        unit = result.unit("guess", component=name)
        columns.append(Column(name, unit, tuple(fixed(float(v), places) for v in guess[rows, k])))
    notes = (
        *_stresses(result),
        *_spins(result),
        *str(result.attrs.get("failure", "")).splitlines(),
        *(f"Hint: {hint}" for hint in str(result.attrs.get("hints", "")).splitlines()),
        *(f"{words_}: {result.attrs[name]}." for name, words_ in SEVERAL.items() if name in result.attrs),
    )
    return ResultTable("Start, from which it is assembled", tuple(columns), notes)


def _spins(result: Result) -> Iterator[str]:
    for spin in result.get("spin_words").tolist() if "spin" in result.coords else []:
        yield f"{spin[0].upper()}{spin[1:]}. This moves neither the output nor a load, and is held."


def _stresses(result: Result) -> Iterator[str]:
    """What every self-stress runs through; those that run through the same are listed together."""
    through = result.get("self_stress_members").tolist() if "number" in result.coords else []
    for members in dict.fromkeys(through):
        numbers = [str(k) for k, other in enumerate(through, 1) if other == members]
        many = len(numbers) > 1
        yield f"Self-stress{'es' * many} {', '.join(numbers)} run{'s' * (not many)} through {members}."
