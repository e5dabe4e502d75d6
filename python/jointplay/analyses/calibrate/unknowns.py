"""What is found out about one built machine: deviations and, where a load tells them, sizes of clearances.

A deviation has the statistics of the file as its prior: mean and standard deviation of its law, those of the limits of
a normal law being three standard deviations away. Without a tolerance it is held, unless somebody frees it.
"""

import fnmatch
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.compile import LOOSE
from jointplay.errors import InputError, listed, not_known
from jointplay.model.mechanism import Mechanism
from jointplay.model.sizing import Sizing, sizings
from jointplay.result import axes_of

#: kinds of sources that are no deviation: where a part lies in its play, and the sizes that make a clearance
NO_DEVIATION = (*LOOSE, "size")
#: standard deviations from the middle to the limits of a normal law
SIGMAS = 3.0
#: unknowns of one machine
MOST = 1000


@dataclass(frozen=True, eq=False)
class Unknown:
    """One number of a machine."""

    #: as results name the parameter, or the source of a size
    name: str
    #: where the file has it
    key: str
    #: ``length``, ``angle`` or ``temperature``
    kind: str
    #: SI per unit of the file
    factor: float
    #: index of a deviation among the parameters; -1 for a number of the file
    parameter: int
    #: `mean`, `sigma`: of the prior, SI; infinite where there is none
    mean: float
    sigma: float
    #: of a size
    sizing: Sizing | None = field(default=None, repr=False)

    @property
    def of_file(self) -> bool:
        """Whether it is a number of the file and no deviation: a size, or any other that was freed by its key."""
        return self.parameter < 0


@dataclass(frozen=True, eq=False)
class Unknowns:
    """All of them, and the mechanism with its patterns written out that they are of.

    Attributes
    ----------
    m : Mechanism
    unknowns : tuple of Unknown
        Deviations first.
    correlation : ndarray
        Of the priors; that of one without prior with others is zero.
    keys : mapping
        By every parameter that can be written the key of its source and its place in a list of deviations.
    """

    m: Mechanism
    unknowns: tuple[Unknown, ...]
    correlation: Floats
    places: Mapping[int, tuple[Sizing, int, int]]

    def __len__(self) -> int:
        return len(self.unknowns)

    def of_parameters(self, x: Floats) -> Floats:
        """All parameters with the unknown ones as found, SI."""
        u = self.m.centre.copy()
        for unknown, value in zip(self.unknowns, x, strict=True):
            if not unknown.of_file:
                u[unknown.parameter] = value
        return u

    def changes(self, x: Floats) -> dict[str, object]:
        """Changes of the file that give it the sizes and other numbers as found."""
        changes: dict[str, object] = {}
        for unknown, value in zip(self.unknowns, x, strict=True):
            if unknown.sizing is not None:
                changes |= unknown.sizing.resized(max(float(value) / unknown.factor, 0.0))
            elif unknown.of_file:
                changes[unknown.key] = float(value)
        return changes


def unknowns_of(
    m: Mechanism, free: Mapping[str, float | None], fixed: Iterable[str], *, sizes: bool = False
) -> Unknowns:
    """What is unknown of a machine.

    Parameters
    ----------
    free : mapping
        Names of parameters, of sources, or keys of the file, with ``*`` for several, that are unknown whatever their
        tolerance: a standard deviation in units of the file, or None for no prior.
    fixed : iterable of str
        The same of what is held as the file has it.
    sizes : bool
        Whether sizes of clearances are unknown.

    Raises
    ------
    InputError
        When a name is not known, or nothing is unknown.
    """
    base, sources = sizings(_with_drives(m, free))
    places = places_of(base, sources)
    names = _Names(base, places)
    freed: dict[int, float | None] = {}
    numbers: list[Unknown] = []
    for word, sigma in free.items():
        if not names.known(word) and (value := _number(base, word)) is not None:
            if sigma is not None and not sigma > 0.0:
                raise InputError(f"{sigma:g} is no standard deviation, which is above zero", key=f"free {word}")
            numbers.append(Unknown(word, word, "", 1.0, -1, value, np.inf if sigma is None else sigma))
            continue
        for parameter in names.meant(word, "free"):
            freed[parameter] = sigma
    held = {parameter for word in fixed for parameter in names.meant(word, "fix")}
    if both := sorted(names.of(parameter) for parameter in held & set(freed)):
        raise InputError(f"{listed(both)} would be free and held; choose one", key="fix")
    mean, covariance = _prior(base)
    kinds = axes_of(base)["parameter"].kinds
    found: list[Unknown] = []
    for k, (sizing, _, _) in places.items():
        own = float(np.sqrt(covariance[k, k]))
        sigma = freed.get(k, own / base.parameter_factors[k])
        if k in held or (k not in freed and own == 0.0):
            continue
        spread = np.inf if sigma is None else sigma * base.parameter_factors[k]
        if not spread > 0.0:
            raise InputError(f"{sigma:g} is no standard deviation, which is above zero", key=f"free {names.of(k)}")
        about = float(base.centre[k] + (mean[k] if k not in freed else 0.0))
        factor = float(base.parameter_factors[k])
        found.append(Unknown(names.of(k), deviation_key(sizing), kinds[k], factor, k, about, float(spread)))
    correlation = _correlation(found, covariance, freed)
    found += numbers
    if sizes:
        found += [_size(base, sizing) for sizing in sources if is_play(base, sizing)]
    correlation = _grown(correlation, len(found))
    if not found:
        problem = "nothing is unknown: no dimension, link, drive or other deviation has a tolerance; --free names some"
        raise InputError(problem, file=m.file)
    if len(found) > MOST:
        raise InputError(f"{len(found)} numbers are unknown; at most {MOST} are fitted, --fix names some", file=m.file)
    return Unknowns(base, tuple(found), correlation, places)


def _with_drives(m: Mechanism, free: Mapping[str, float | None]) -> Mechanism:
    """The mechanism in which drives that are to be free can be off."""
    changes: dict[str, object] = {}
    base = None
    for word in free:
        name = word.removeprefix("drives.").removesuffix(".deviation")
        if name in m.drives and not m.data.drives[name].error and not m.data.drives[name].deviation:
            base = base or sizings(m)[0]
            changes[f"drives.{name}.error"] = 0.0
    return m if base is None else base.with_(changes)


class _Names:
    """Finds the parameters that somebody names."""

    def __init__(self, m: Mechanism, places: Mapping[int, tuple[Sizing, int, int]]) -> None:
        self.m, self.places = m, places

    def of(self, parameter: int) -> str:
        """The shortest name: that of the source where it has one number."""
        source = int(self.m.parameter_source[parameter])
        alone = int((self.m.parameter_source == source).sum()) == 1
        return self.m.sources[source] if alone else self.m.parameters[parameter]

    def known(self, word: str) -> list[int]:
        """The parameters of a name, if any."""
        return [k for k in self.places if any(fnmatch.fnmatchcase(name, word) for name in self._called(k))]

    def meant(self, word: str, option: str) -> list[int]:
        """The same of a name that has some.

        Raises
        ------
        InputError
            When there is none.
        """
        found = self.known(word)
        if not found:
            what = "a deviation of this file" + (", or the key of a number" if option == "free" else "")
            raise InputError(not_known(word, what, [self.of(k) for k in self.places]), key=option)
        return found

    def _called(self, parameter: int) -> list[str]:
        sizing = self.places[parameter][0]
        source = self.m.sources[int(self.m.parameter_source[parameter])]
        key = deviation_key(sizing)
        return [self.of(parameter), self.m.parameters[parameter], source, key, key.removesuffix(".deviation")]


def places_of(m: Mechanism, sources: Sequence[Sizing]) -> dict[int, tuple[Sizing, int, int]]:
    """Of every parameter whose deviation the file can say its source, its place there, and how many there are."""
    by_name = {name: sizing for sizing in sources for name in sizing.sources}
    found: dict[int, tuple[Sizing, int, int]] = {}
    for s, (name, kind) in enumerate(zip(m.sources, m.source_kinds, strict=True)):
        if kind in NO_DEVIATION:
            continue
        parameters = np.flatnonzero(m.parameter_source == s).tolist()
        # A cylinder in which an axis shifts and tilts has a known shift only.
        determined = parameters[:2] if len(parameters) > 3 else parameters
        for place, k in enumerate(determined):
            found[k] = (by_name[name], place, len(determined))
    return found


def deviation_key(sizing: Sizing) -> str:
    """Where the file has the deviation of a source."""
    return f"{sizing.key.removesuffix('.error')}.deviation"


def _prior(m: Mechanism) -> tuple[Floats, Floats]:
    """Mean, from the known deviations, and covariance of all parameters."""
    mean, covariance = m.core.parameter_moments()
    for k, source in enumerate(m.compiled_sources):
        if source.spec["law"] == "normal" and source.limits is not None:
            # The density of what is cut off at its limits is that of the whole law within them.
            p = int(np.flatnonzero(m.parameter_source == k)[0])
            wider = (source.limits[1] - source.limits[0]) / 2.0 / SIGMAS
            narrow = np.sqrt(covariance[p, p])
            if narrow > 0.0:
                covariance[p] *= wider / narrow
                covariance[:, p] *= wider / narrow
    return mean, covariance


def _correlation(found: Sequence[Unknown], covariance: Floats, freed: Mapping[int, float | None]) -> Floats:
    correlation = np.eye(len(found))
    for i, first in enumerate(found):
        for j, second in enumerate(found[:i]):
            both = (first.parameter, second.parameter)
            if covariance[both] and not set(both) & set(freed):
                size = np.sqrt(covariance[both[0], both[0]] * covariance[both[1], both[1]])
                correlation[i, j] = correlation[j, i] = covariance[both] / size
    return correlation


def _number(m: Mechanism, key: str) -> float | None:
    """The number at a key of the file, if there is one."""
    try:
        value = m.value(key)
    except InputError:
        return None
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _grown(correlation: Floats, count: int) -> Floats:
    whole = np.eye(count)
    whole[: len(correlation), : len(correlation)] = correlation
    return whole


def is_play(m: Mechanism, sizing: Sizing) -> bool:
    """Whether a source is a clearance or backlash that has some size."""
    return any(m.source_kinds[m.sources.index(name)] in LOOSE for name in sizing.sources) and sizing.size > 0.0


def _size(m: Mechanism, sizing: Sizing) -> Unknown:
    factor = float(getattr(m.units, sizing.kind))
    return Unknown(sizing.name, sizing.key, sizing.kind, factor, -1, sizing.size * factor, np.inf, sizing)
