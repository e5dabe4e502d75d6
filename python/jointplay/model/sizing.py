"""How large every source of error is, and what makes it another size in the file.

    size       of a clearance the largest play, as the file measures it: radial, diametral, gap, axial, backlash, slack;
               of a deviation the tolerance to the farther side, or the diameter or angle of its zone
    resized    every number of the file that is proportional to the size, times new size / size

A clearance is one source here, with the sizes that make it (hole and pin, slot and slider, mounting): their limits are
scaled with it. What is not a size of play stays: the length of a pin, the section of a slider. Several bodies on one
pin, and both pins of a universal joint, have one clearance in the file, so they are one source here, too.

Who looks for sizes asks `sizings` and changes the mechanism that it gives with `with_`:

    base, sources = sizings(m)
    copy = base.with_(sources[0].resized(0.02))
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from jointplay.core.compile.sizes import MICROMETRE, MILLIMETRE, Size, sizes_of
from jointplay.errors import InputError
from jointplay.file import standards
from jointplay.file.schema import (
    AxisDeviation,
    BearingKeys,
    ComponentDeviation,
    Deviating,
    Drive,
    Follower,
    LawTable,
    Mesh,
    SizedClearance,
    ToleranceTable,
    limits_of,
)
from jointplay.file.schema.values import as_data
from jointplay.model.mechanism import Mechanism
from jointplay.model.patterns import written_out

#: fits with play that are preferred, hole basis: those of ANSI B4.2-1978 (H7/h6, H7/g6, H8/f7, H9/d9, H11/c11), and
#: between and below them H6/h5, H6/g5 and H8/e8 of ISO 286-1:2010
PREFERRED = ("H6/h5", "H6/g5", "H7/h6", "H7/g6", "H8/f7", "H8/e8", "H9/d9", "H11/c11")
#: groups of ball bearings, from tight to loose
GROUPS = ("C2", "CN", "C3", "C4", "C5")
#: what says by itself how large a clearance is; the first that is given is its size
MEASURES = ("radial", "diametral", "gap", "axial", "backlash", "backlash_angle", "slack")

RawTable = dict[str, Any]


@dataclass(frozen=True)
class Sizing:
    """One source, its size, and how the file says another one."""

    #: as results name the source; the joint's name where several sources have one clearance
    name: str
    #: the sources of results that it is, without the sizes that make a clearance
    sources: tuple[str, ...]
    #: where the file has its size
    key: str
    #: what the size is: ``radial``, ``diametral``, ``gap``, ``axial``, ``backlash``, ``backlash_angle``, ``slack``,
    #: ``tolerance``, ``diameter`` or ``angle``
    measure: str
    #: ``length``, ``angle`` or ``temperature``: which unit it has
    kind: str
    #: in units of the file
    size: float
    #: nominal size of a fit, in units of the file; None where the file does not give one
    diameter: float | None = None
    #: whether it is a ball bearing, whose size is ordered by its group
    bearing: bool = False
    #: why its size cannot be changed; empty where it can
    fixed: str = ""
    #: hole and pin, or what else makes a clearance and scatters
    parts: tuple[Size, ...] = ()
    #: how far a number with a tolerance may be off, in units of the file; None of what has none
    limits: tuple[float, float] | None = None
    _changes: Callable[[float], Mapping[str, object]] = field(default=lambda _: {}, repr=False, compare=False)
    _table: Mapping[str, object] = field(default_factory=dict, repr=False, compare=False)

    def resized(self, size: float) -> dict[str, object]:
        """Changes for `Mechanism.with_` that give it a size.

        Parameters
        ----------
        size : float
            In units of the file, not negative.
        """
        return dict(self._changes(size))

    def of_fit(self, fit: str) -> dict[str, object]:
        """Changes for `Mechanism.with_` that give it a fit, such as H7/g6, of the diameter it has."""
        nominal = "diameter" if "diameter" in self._fit_keys else "nominal"
        return {self.key: {**self._rest, "fit": fit, nominal: self.diameter}}

    def of_bearing(self, group: str) -> dict[str, object]:
        """Changes for `Mechanism.with_` that give it a group of bearings, such as C3, of the bore it has."""
        return {self.key: {**self._table, "bearing": group}}

    @property
    def can_have_fit(self) -> bool:
        """Whether a fit can be its size, if a diameter is given."""
        return bool(self._fit_keys) and not self.bearing

    @property
    def _fit_keys(self) -> tuple[str, ...]:
        return {"radial": ("diameter",), "diametral": ("diameter",), "gap": ("nominal",)}.get(self.measure, ())

    @property
    def _rest(self) -> RawTable:
        """What a clearance has beside its play."""
        play = {"radial", "diametral", "gap", "tolerance", "size_law", "hole", "pin", "slot", "slider"}
        return {key: value for key, value in self._table.items() if key not in play}

    def fits(self, m: Mechanism) -> list[str]:
        """The preferred fits of its diameter, from the smallest largest play to the largest.

        The fits are in `PREFERRED`; those that the standard does not have for the diameter are left out.
        """
        if self.diameter is None:
            return []
        return [name for name, _, _ in plays(self.diameter, m.units.length)]


def plays(diameter: float, unit: float, besides: str = "") -> list[tuple[str, float, float]]:
    """The fits that are preferred for a diameter, with least and largest play, from the smallest largest play on.

    Parameters
    ----------
    diameter : float
        Nominal size, in units of the file.
    unit : float
        Metres per unit of length of the file.
    besides : str
        A fit that is among them although it is not preferred.

    Returns
    -------
    list of tuple
        Fit, and the least and the largest difference of the sizes, in units of the file, negative where they overlap.
        Those that the standard does not have for the diameter are left out.

    Examples
    --------
    >>> [(name, round(most, 6)) for name, _, most in plays(12, 1e-3)[:3]]
    [('H6/h5', 0.019), ('H6/g5', 0.025), ('H7/h6', 0.029)]
    """
    known = []
    for name in dict.fromkeys((*PREFERRED, besides) if besides else PREFERRED):
        try:
            hole, shaft = (standards.limits(diameter * unit / MILLIMETRE, text) for text in standards.fit(name))
        except standards.NotInStandard:
            continue
        known.append((hole.upper - shaft.lower, hole.lower - shaft.upper, name))
    return [(name, least * MICROMETRE / unit, most * MICROMETRE / unit) for most, least, name in sorted(known)]


def sizings(m: Mechanism) -> tuple[Mechanism, list[Sizing]]:
    """The mechanism with its patterns written out, and all its sources in the order of results.

    Copies of a pattern are parts of their own there, so that each can have its own size.
    """
    base = m
    if "patterns" in m.raw:
        base = Mechanism(written_out(dict(m.raw), m.file).data, m.file).only(*m.chosen)
    found: dict[str, Sizing] = {}
    for index, name in enumerate(base.sources):
        one = _sizing(base, index, name)
        if one is None:
            continue
        if one.key in found:
            known = found[one.key]
            one = Sizing(**{**vars(known), "name": _joint_of(name), "sources": (*known.sources, name)})
        found[one.key] = one
    return base, list(found.values())


def times(sources: Sequence[Sizing], factor: float) -> dict[str, object]:
    """Changes for `Mechanism.with_` that multiply all sizes that can be changed by a factor."""
    return {
        key: value
        for source in sources
        if source.size and not source.fixed
        for key, value in source.resized(factor * source.size).items()
    }


def _joint_of(name: str) -> str:
    """The joint of the file that a source belongs to; names of joints have neither a slash nor a point."""
    return name.partition("/")[0].partition(".")[0]


def _sizing(m: Mechanism, index: int, name: str) -> Sizing | None:
    """One source; None for a size that is a part of a clearance."""
    kind, data, joint = m.source_kinds[index], m.data, _joint_of(name)
    match kind:
        case "size":
            return None
        case "clearance":
            return _clearance(m, name, joint)
        case "angle":
            return _deviating(name, f"joints.{joint}.angle", getattr(data.joints[joint], "angle"), "angle")  # noqa: B009
        case "ratio":
            if joint in data.followers:
                return _of_follower(m, name)
            key = f"joints.{joint}.ratio_error"
            return _deviating(name, key, getattr(data.joints[joint], "ratio_error"), "length")  # noqa: B009
        case "runout":
            body, entry = name.split(".", 2)[2], data.joints[joint]
            assert isinstance(entry, Mesh)
            return _zone(name, f"joints.{joint}.runout.{body}", entry.runout[body], "tolerance", "length")
        case "position" | "direction":
            return _place(m, name, joint, kind)
        case "dimension":
            return _deviating(name, f"dimensions.{name}", data.dimensions[name], "length")
        case "link":
            link, component = name.rsplit(".", 1)
            length = component in ("x", "y", "z", "a", "d")
            off = data.links[link].by_component[component]
            return _deviating(name, f"links.{link}.{component}", off, "length" if length else "angle")
        case "drive":
            return _drive(m, index, name)
        case "backlash":
            return _backlash(m, index, name)
        case "thermal":
            return _deviating(name, "temperature", data.temperature, "temperature")
    raise AssertionError(f"{kind} has no size")


def _place(m: Mechanism, name: str, joint: str, kind: str) -> Sizing:
    """A component of a position or direction, or its zone."""
    _, _, body, *component = name.split(".")
    key = f"joints.{joint}.{kind}.{body}"
    off = getattr(m.data.joints[joint], kind)[body]
    if component:
        unit = "length" if kind == "position" else "angle"
        return _deviating(name, f"{key}.{component[0]}", off.by_component[component[0]], unit)
    if isinstance(off, ComponentDeviation):
        return _deviating(name, key, off, "angle")
    is_angle = isinstance(off, AxisDeviation) and off.angle is not None
    return _zone(name, key, off, "angle" if is_angle else "diameter", "angle" if is_angle else "length")


def _zone(name: str, key: str, entry: Any, measure: str, kind: str) -> Sizing:
    """What lies anywhere in a zone of one size."""
    table = _told(entry)

    def changes(size: float) -> RawTable:
        return {key: {**table, measure: size}}

    return Sizing(name, (name,), key, measure, kind, getattr(entry, measure) or 0.0, _changes=changes)


def _deviating(name: str, key: str, entry: Any, kind: str) -> Sizing:
    """A number with a tolerance and a law."""
    assert isinstance(entry, Deviating)
    limits = limits_of(entry.tolerance, entry.law)
    size = max(map(abs, limits))
    table = _told(entry)

    def changes(new: float) -> RawTable:
        return {key: {**table, **_toleranced(entry.tolerance, entry.law, size, new)}}

    return Sizing(name, (name,), key, "tolerance", kind, size, limits=limits, _changes=changes)


def _drive(m: Mechanism, index: int, name: str) -> Sizing:
    drive = list(m.data.drives)[m.compiled_sources[index].spec["drive"]]
    kind = m.coordinate_kind(m.driven_joint(index))
    return _off_its_command(name, f"drives.{drive}", m.data.drives[drive], kind)


def _off_its_command(name: str, key: str, entry: Drive | Follower, kind: str) -> Sizing:
    limits = limits_of(entry.error, entry.law)
    size = max(map(abs, limits))

    def changes(new: float) -> RawTable:
        told = _toleranced(entry.error, entry.law, size, new)
        return {f"{key}.error": told["tolerance"]} | ({f"{key}.law": told["law"]} if "law" in told else {})

    return Sizing(name, (name,), f"{key}.error", "tolerance", kind, size, limits=limits, _changes=changes)


def _backlash(m: Mechanism, index: int, name: str) -> Sizing:
    source = m.compiled_sources[index].spec
    if "drive" not in source:
        return _of_follower(m, name)
    kind = m.coordinate_kind(m.driven_joint(index))
    key = f"drives.{name}"
    play = m.data.drives[m.drives[source["drive"]]].backlashes[m.joints[source["joint"]]]
    return Sizing(name, (name,), key, "backlash", kind, play.width, _changes=lambda new: {key: play.resized(new)})


def _of_follower(m: Mechanism, name: str) -> Sizing:
    """Lost motion or error of a follower."""
    follower, what = name.rsplit(".", 1)
    entry, key = m.data.followers[follower], f"followers.{follower}"
    kind = m.coordinate_kind(m.joints.index(entry.joint))
    if what == "backlash":
        play = entry.backlash
        assert play is not None
        at = f"{key}.backlash"
        return Sizing(name, (name,), at, "backlash", kind, play.width, _changes=lambda new: {at: play.resized(new)})
    return _off_its_command(name, key, entry, kind)


def _toleranced(tolerance: ToleranceTable | None, law: object, size: float, new: float) -> RawTable:
    """Tolerance and law with another size."""
    if size == 0.0:
        return {"tolerance": new}
    factor = new / size
    if tolerance is not None:
        told: RawTable = {"tolerance": _times(_told(tolerance), factor)}
    else:
        low, high = limits_of(None, law if isinstance(law, LawTable) else None)
        told = {"tolerance": {"plus": high * factor, "minus": -low * factor}}
    return told | ({"law": _law(law, factor)} if isinstance(law, LawTable) else {})


def _law(law: LawTable, factor: float) -> RawTable:
    """A law with its numbers times a factor."""
    table = _told(law)
    if law.measured is not None:
        return {"measured": [value * factor for value in law.values]}
    for key in ("triangular", "pert"):
        if key in table:
            table[key] *= factor
    if law.normal is not None and law.normal.sigma is not None:
        # A width of nothing is none; at a size of zero the law does not matter.
        sigma = law.normal.sigma * factor
        table["normal"] = {k: v for k, v in table["normal"].items() if k != "sigma"} | (
            {"sigma": sigma} if sigma else {}
        )
    return table


def _clearance(m: Mechanism, name: str, joint: str) -> Sizing:
    entry, key, unit = m.data.joints[joint], f"joints.{joint}.clearance", m.units.length
    play = getattr(entry, "clearance")  # noqa: B009
    measures = {measure: getattr(play, measure, None) for measure in MEASURES}
    given = {measure: value for measure, value in measures.items() if value is not None}
    parts: list[Size] = []
    middle, is_bearing, fixed = 0.0, isinstance(play, BearingKeys) and play.bearing is not None, ""
    if isinstance(play, SizedClearance):
        middle, parts = sizes_of(play, m.units, lambda why, where: InputError(why, file=m.file, key=f"{key}.{where}"))
        if play.fit is not None or getattr(play, play.pair[0]) is not None or is_bearing:
            measure = next(iter(play.measures))
            largest = middle + sum(part.factor * part.centre + abs(part.factor) * part.half for part in parts)
            given = {measure: max(largest, 0.0) / unit, **given}
    measure = _measure(play, given)
    size = given[measure]
    if measure in play_measures(play) and parts and measures[measure] is not None:
        half = sum(abs(part.factor) * part.half for part in parts)
        largest = middle + half + sum(part.factor * part.centre for part in parts)
        size = largest / unit * (2.0 if measure == "diametral" else 1.0)
    size = max(size) if isinstance(size, tuple) else float(size)
    if is_bearing and any(source.startswith(f"{joint}.") for group in m.data.correlations for source in group.sources):
        fixed = "its sizes are named in [[correlations]]; only its group can be changed"

    def changes(new: float) -> RawTable:
        return {key: _scaled(play, parts, measure, size, new, unit)}

    return Sizing(
        name,
        (name,),
        key,
        measure,
        "angle" if measure == "backlash_angle" else "length",
        size,
        _diameter(play),
        is_bearing,
        fixed,
        tuple(parts),
        _changes=changes,
        _table=_told(play),
    )


def play_measures(play: object) -> tuple[str, ...]:
    """The keys in which a clearance that can scatter is given as one number."""
    return tuple(play.measures) if isinstance(play, SizedClearance) else ()


def _measure(play: Any, given: Mapping[str, Any]) -> str:
    """What the size of a clearance is: the first that is not zero, else the first that can be another one."""
    sized = [measure for measure, value in given.items() if (max(value) if isinstance(value, tuple) else value) > 0.0]
    can = [m for m in given if m == "axial" or not hasattr(play, "axial") or getattr(play, "length", None) is not None]
    return (sized or can or list(given))[0]


def _diameter(play: object) -> float | None:
    if not isinstance(play, SizedClearance) or (isinstance(play, BearingKeys) and play.bearing is not None):
        return None
    return play.nominal_size


def _scaled(play: Any, parts: list[Size], measure: str, size: float, new: float, unit: float) -> RawTable:
    """A clearance with another size, as the file has it."""
    table = _told(play)
    if size == 0.0:
        if measure in table or not isinstance(play, SizedClearance):
            return {**table, measure: [new, new] if measure == "slack" else new}
        return {**_without_play(table), measure: new}
    factor = new / size
    for key in (*MEASURES, "tolerance"):
        if key in table:
            table[key] = _times(table[key], factor)
    if isinstance(play, SizedClearance):
        if isinstance(play.size_law, LawTable):
            table["size_law"] = _law(play.size_law, factor)
        if not any(key in table for key in play.measures) and parts:
            table = {**_without_play(table), **_pair(play, parts, factor, unit)}
    return table


def _without_play(table: RawTable) -> RawTable:
    gone = {"fit", "diameter", "nominal", "bearing", "bore", "reduction", "hole", "pin", "slot", "slider"}
    return {key: value for key, value in table.items() if key not in gone}


def _pair(play: SizedClearance, parts: list[Size], factor: float, unit: float) -> RawTable:
    """Hole and pin, or slot and slider, that have a factor of the play: limits and difference of their nominal sizes.

    A ball bearing is the hole, in a bore of its size, and what mounting takes away makes the pin larger.
    """
    measure = "diameter" if play.pair == ("hole", "pin") else "width"
    outer = parts[0]
    is_bearing = isinstance(play, BearingKeys) and play.bearing is not None
    base = play.bore * unit if isinstance(play, BearingKeys) and is_bearing and play.bore else outer.nominal
    table: RawTable = {}
    for name, part in zip(play.pair, (*parts, None)[:2], strict=True):
        if part is None:
            table[name] = {measure: base / unit, "law": "uniform"}
            continue
        nominal = base if is_bearing else base - factor * (base - part.nominal)
        own = getattr(play, name, None)
        told: RawTable = {measure: nominal / unit}
        if own is not None and own.tolerance is not None:
            told["tolerance"] = _times(_told(own.tolerance), factor)
        else:
            told |= {"plus": part.high / unit * factor, "minus": -part.low / unit * factor}
        if own is not None and own.law is not None:
            told["law"] = _law(own.law, factor) if isinstance(own.law, LawTable) else own.law
        if part.deviation is not None:
            told["deviation"] = part.deviation / unit * factor
        table[name] = told
    return table


def _told(entry: Any) -> RawTable:
    """A table of the file with the keys that are given, its expressions as numbers."""
    return {key: value for key, value in as_data(entry).items() if value is not None}


def _times(value: Any, factor: float) -> Any:
    """A number, or a table or list of them, times a factor."""
    if isinstance(value, Mapping):
        return {key: _times(one, factor) for key, one in value.items() if one is not None}
    return [_times(one, factor) for one in value] if isinstance(value, list | tuple) else value * factor
