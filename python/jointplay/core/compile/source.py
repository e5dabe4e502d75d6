"""What can be off, as one thing: a source of error."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from jointplay.core.sets import between
from jointplay.core.spec import SourcePart, SourceSpec
from jointplay.file.schema import ToleranceLaw, ToleranceTable, law_in_core, limits_of

#: two points closer than this share of the mechanism's length have no direction between them
COINCIDENT = 1e-9
#: kinds of sources whose offsets the load decides
LOOSE = ("clearance", "backlash")


@dataclass(frozen=True)
class CompiledSource:
    """One thing that can be off."""

    name: str
    #: ``clearance``, ``size``, ``angle``, ``ratio``, ``runout``, ``position``, ``direction``, ``dimension``, ``link``,
    #: ``drive``, ``backlash`` or ``thermal``
    kind: str
    #: what each of its parameters is called
    components: tuple[str, ...]
    #: SI per file unit of each parameter
    factors: tuple[float, ...]
    #: known deviation of each parameter, SI
    centre: tuple[float, ...]
    #: the rest of it as the core wants it
    spec: SourcePart = field(repr=False)
    #: where the file says it, if that does not follow from its name
    key: str = ""

    @property
    def shape(self) -> str:
        """The shape of the set of its offsets."""
        return next(iter(self.spec["set"]))

    @property
    def size(self) -> dict[str, float]:
        """The sizes of this set, SI."""
        return self.spec["set"][self.shape]

    @property
    def limits(self) -> tuple[float, float] | None:
        """Lowest and highest offset where it has one, SI; None of larger sets."""
        return (self.size["low"], self.size["high"]) if "low" in self.size else None

    def with_size(self, size: dict[str, float]) -> CompiledSource:
        """The same with other sizes of its set."""
        return replace(self, spec={**self.spec, "set": {self.shape: size}})

    @property
    def as_spec(self) -> SourceSpec:
        """All of it as the core wants it."""
        return {"kind": self.kind, "centre": list(self.centre), **self.spec}


def interval(tolerance: ToleranceTable | None, law: ToleranceLaw, factor: float) -> SourcePart:
    """The set and the law of one component, SI."""
    low, high = (limit * factor for limit in limits_of(tolerance, law))
    own = "gauss" if tolerance is not None and tolerance.sigma is not None else law_in_core(law, low, high, factor)
    return {"set": between(low, high), "law": own}
