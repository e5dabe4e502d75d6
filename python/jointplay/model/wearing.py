"""What wears in a mechanism: the clearances of joints with `wear`, their sizes and rates in SI."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jointplay.core.sets import play_of
from jointplay.errors import InputError
from jointplay.model.gaps import clearance_of
from jointplay.model.mechanism import Mechanism
from jointplay.model.sizing import Sizing, play_measures


@dataclass(frozen=True)
class Wearing:
    """One clearance of the file that wears. Several bodies on one pin, and both pins of a cross, have one."""

    #: the source as results name it
    name: str
    #: `sources`, `joints`: its sources in the compiled mechanism, and the joint of each
    sources: tuple[int, ...]
    joints: tuple[int, ...]
    #: in which measure the file gives the clearance
    measure: str
    #: that measure per radius or gap on each side: 2 for a diameter
    factor: float
    #: specific wear rate of both faces together, m2/N; None where it is not given
    rate: float | None
    #: those of hole and pin
    of_both: tuple[float, float] | None
    #: growth of the radius or gap per cycle that was measured, SI
    growth: float
    #: `length`, `width`, `diameter`: of what slides, SI; nan where the file does not say and nothing needs it
    length: float
    width: float
    diameter: float

    @property
    def is_measured(self) -> bool:
        """Whether its growth was measured, so that it follows neither from loads nor from sliding."""
        return self.rate is None and self.of_both is None

    def clearance(self, m: Mechanism) -> float:
        """Radius or gap in the middle of its limits, SI."""
        return float(play_of(clearance_of(m, self.sources[0])[1]))


def wearings(m: Mechanism, sources: Sequence[Sizing]) -> list[Wearing]:
    """What wears, in the order of the sources.

    Parameters
    ----------
    m : Mechanism
        With its patterns written out.
    sources : sequence of Sizing
        Of the same mechanism.

    Raises
    ------
    InputError
        When nothing does.
    """
    found = [_wearing(m, source) for source in sources if _joint(source) in m.data.joints]
    worn = [one for one in found if one is not None]
    if not worn:
        problem = "no joint has `wear`: say how fast its clearance grows, such as wear = { rate = 1e-6, length = 20 }"
        raise InputError(problem, file=m.file, key="joints")
    return worn


def _joint(source: Sizing) -> str:
    """The joint of the file whose clearance a source is; empty for others."""
    head, _, rest = source.key.partition(".")
    joint, _, what = rest.partition(".")
    return joint if head == "joints" and what == "clearance" else ""


def _wearing(m: Mechanism, source: Sizing) -> Wearing | None:
    entry = m.data.joints[_joint(source)]
    wear, play = entry.wears, getattr(entry, "clearance", None)
    if wear is None:
        return None
    given = [measure for measure in play_measures(play) if getattr(play, measure) is not None]
    measure = (given or list(play_measures(play)))[0]
    factor = 2.0 if measure == "diametral" else 1.0
    unit, both = m.units.length, wear.of_both
    sizes = {key: _size(wear.size(play, key), unit) for key in ("length", "width", "diameter")}
    indices = tuple(m.sources.index(name) for name in source.sources)
    return Wearing(
        source.name,
        indices,
        tuple(m.compiled_sources[k].spec["joint"] for k in indices),
        measure,
        factor,
        None if wear.rate is None else wear.rate * m.units.wear,
        None if both is None else ((both[0] or 0.0) * m.units.wear, (both[1] or 0.0) * m.units.wear),
        0.0 if wear.growth is None else wear.growth * unit / factor,
        **sizes,
    )


def _size(value: Any, unit: float) -> float:
    """A size of the file in SI; nan for none."""
    return np.nan if value is None else float(value) * unit
