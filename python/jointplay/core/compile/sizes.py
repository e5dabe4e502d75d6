"""The sizes that make a clearance, in SI.

gap = gap in the middle + sum of factor * size      size: difference from the middle of its limits

Hole and pin are given as diameters and make a radius: their factors are 1/2 and -1/2, and so are those of slot and
slider, which make a gap on each side.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

from jointplay.basics.units import Units
from jointplay.errors import InputError
from jointplay.file import standards
from jointplay.file.schema import (
    BearingKeys,
    LawName,
    LawTable,
    Machined,
    RadialClearance,
    SizedClearance,
    ToleranceTable,
    limits_of,
)

from .placing import Refuse

#: the standards are in millimetres and micrometres
MILLIMETRE, MICROMETRE = 1e-3, 1e-6


@dataclass(frozen=True)
class Size:
    """One size that scatters. Lengths are in SI; those from the nominal size are small, so it does not round them."""

    #: ``hole``, ``pin``, ``slot``, ``slider``, ``size`` or ``reduction``
    name: str
    #: what the radius or the gap of the clearance is per unit of it
    factor: float
    #: nominal size
    nominal: float
    #: `low`, `high`: its limits, from the nominal size
    low: float
    high: float
    #: how it scatters between them
    law: str | LawTable
    #: its known deviation from the nominal size
    deviation: float | None = None

    @property
    def middle(self) -> float:
        """Middle of its limits, from the nominal size."""
        return (self.low + self.high) / 2.0

    @property
    def half(self) -> float:
        """Half of the distance of its limits."""
        return (self.high - self.low) / 2.0

    @property
    def centre(self) -> float:
        """Known deviation from the middle of its limits."""
        return 0.0 if self.deviation is None else self.deviation - self.middle


def sizes_of(play: SizedClearance, units: Units, refuse: Refuse) -> tuple[float, list[Size]]:
    """Radius or gap of a clearance in the middle of its sizes, and these sizes; none where it is one number.

    Parameters
    ----------
    refuse : callable
        Makes the error from a sentence and the key below the clearance.

    Raises
    ------
    InputError
        When a standard has no such class or group for the size, or no pair of hole and pin has play.
    """
    law = play.size_law or "normal"
    if play.fit is not None:
        nominal = float(getattr(play, play.nominal_key))
        classes = zip(play.pair, standards.fit(play.fit), strict=True)
        sizes = [_limits(name, nominal, text, law, units, lambda why: refuse(why, "fit")) for name, text in classes]
        return _gap(sizes), sizes
    parts = [getattr(play, key) for key in play.pair]
    if all(isinstance(part, Machined) for part in parts):
        sizes = [_machined(name, part, law, units, refuse) for name, part in zip(play.pair, parts, strict=True)]
        gap = _gap(sizes)
        if gap + sum(abs(size.factor) * size.half for size in sizes) < 0.0:
            first, second = play.pair
            raise refuse(
                f"no {second} has play in its {first}: even the smallest one is larger than the largest {first}", ""
            )
        return gap, sizes
    if isinstance(play, BearingKeys) and play.bearing is not None and play.bore is not None:
        return _bearing(play, play.bore, play.bearing, law, units, refuse)
    return _plain(play, law, units)


def _gap(sizes: list[Size]) -> float:
    return sum(size.factor * size.nominal for size in sizes) + sum(size.factor * size.middle for size in sizes)


def _plain(play: SizedClearance, law: LawName | LawTable, units: Units) -> tuple[float, list[Size]]:
    """A clearance that is given as one number, with or without a tolerance."""
    is_diametral = isinstance(play, RadialClearance) and play.diametral is not None
    factor = 0.5 if is_diametral else 1.0
    value = next((v for v in (getattr(play, key) for key in play.measures) if v is not None), 0.0)
    if play.tolerance is None:
        return factor * value * units.length, []
    size = _toleranced("size", factor, value, play.tolerance, law, units)
    return _gap([size]), [size]


def _toleranced(
    name: str, factor: float, nominal: float, tolerance: ToleranceTable | None, law: LawName | LawTable, units: Units
) -> Size:
    unit = units.length
    low, high = (limit * unit for limit in limits_of(tolerance, law))
    own = "gauss" if tolerance is not None and tolerance.sigma is not None else law
    return Size(name, factor, nominal * unit, low, high, own)


def _machined(name: str, part: Machined, law: LawName | LawTable, units: Units, refuse: Refuse) -> Size:
    law, unit = part.law or law, units.length
    if part.iso_class is not None:
        size = _limits(name, part.nominal, part.iso_class, law, units, lambda why: refuse(why, f"{name}.class"))
    elif part.plus is not None and part.minus is not None:
        size = Size(name, _factor(name), part.nominal * unit, -part.minus * unit, part.plus * unit, law)
    else:
        size = _toleranced(name, _factor(name), part.nominal, part.tolerance, law, units)
    return size if part.deviation is None else replace(size, deviation=part.deviation * unit)


def _factor(name: str) -> float:
    return 0.5 if name in ("hole", "slot") else -0.5


def _limits(
    name: str, nominal: float, text: str, law: LawName | LawTable, units: Units, refuse: Callable[[str], InputError]
) -> Size:
    """A size with the limits of a tolerance class."""
    size = nominal * units.length
    try:
        limits = standards.limits(size / MILLIMETRE, text)
    except standards.NotInStandard as error:
        raise refuse(str(error)) from None
    return Size(name, _factor(name), size, limits.lower * MICROMETRE, limits.upper * MICROMETRE, law)


def _bearing(
    play: BearingKeys, bore: float, group: str, law: LawName | LawTable, units: Units, refuse: Refuse
) -> tuple[float, list[Size]]:
    """The travel of a ball bearing, of which the radius is half, and what mounting takes away."""
    try:
        least, most = standards.travel(bore * units.length / MILLIMETRE, group)
    except standards.NotInStandard as error:
        raise refuse(str(error), "bearing") from None
    sizes = [Size("size", 0.5, 0.0, least * MICROMETRE, most * MICROMETRE, law)]
    if play.reduction is not None:
        low, high = (value * units.length for value in play.reduction)
        if low >= most * MICROMETRE:
            most_given = most * MICROMETRE / units.length
            problem = f"takes away all of the clearance, which is at most {most_given:.4g} {units.length_name}"
            raise refuse(f"{problem}: {play.reduction[0]:g}", "reduction")
        sizes.append(Size("reduction", -0.5, 0.0, low, high, law))
    return _gap(sizes), sizes


def described(play: object) -> str:
    """How the file gives a clearance that scatters, in its units.

    Examples
    --------
    >>> from jointplay.file.schema import RevoluteClearance
    >>> described(RevoluteClearance.model_validate({"fit": "H7/g6", "diameter": 12}))
    'H7/g6 of 12'
    """
    assert isinstance(play, SizedClearance)
    if play.fit is not None:
        return f"{play.fit} of {getattr(play, play.nominal_key):g}"
    parts = [(key, getattr(play, key)) for key in play.pair]
    if all(isinstance(part, Machined) for _, part in parts):
        return ", ".join(" ".join(filter(None, (key, f"{part.nominal:g}", part.iso_class))) for key, part in parts)
    if isinstance(play, BearingKeys) and play.bearing is not None:
        return (
            f"bearing {play.bearing}, bore {play.bore:g}, {'before mounting' if play.reduction is None else 'mounted'}"
        )
    return next(f"{key} {getattr(play, key):g}" for key in play.measures if getattr(play, key) is not None)
