"""How a single number scatters between its limits: the laws of tolerances, drive errors and sizes.

| law | density |
|---|---|
| `normal` | three sigma at the limits and cut off there; or a process with its own sigma, shift and drift |
| `uniform` | the same all over |
| `triangular` | to the likeliest value and down again |
| `beta` | of `(x - low) / (high - low)` in proportion to `x^(a - 1) (1 - x)^(b - 1)` |
| `pert` | beta with `a = 1 + 4 (mode - low) / (high - low)` and `b = 6 - a` |
| `measured` | as the values of a column, interpolated |
"""

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import ConfigDict, Discriminator, Field, Tag, model_validator

from jointplay.errors import shown

from .values import EXPRESSION, Number, Omittable, Positive, Table, Tolerance, ToleranceTable, omitted, problem

#: sigmas from the middle to the limits of a process that just fits
SIGMAS = 3.0
#: more sigmas than any process is off, and capabilities that any process has
MOST_SIGMAS = 6.0
LEAST_CPK, MOST_CPK = 0.1, 10.0
#: exponents of a beta law
LEAST_EXPONENT, MOST_EXPONENT = 0.1, 1000.0
#: values of a column
MOST_VALUES = 100_000
#: the keys of a table, of which it has one
WAYS = ("normal", "triangular", "beta", "pert", "measured", "csv")

LAW = (
    "normal (three sigma at the limits, default), uniform or triangular; or a table such as { pert = 0.01 },"
    " { normal = { cpk = 1.33, shift = 0.5 } } or { csv = 'lot.csv', column = 'd' }"
)

Exponent = Annotated[float, Field(ge=LEAST_EXPONENT, le=MOST_EXPONENT), EXPRESSION]
Sigmas = Annotated[float, Field(ge=-MOST_SIGMAS, le=MOST_SIGMAS), EXPRESSION]
Drift = Annotated[float, Field(ge=0.0, le=MOST_SIGMAS), EXPRESSION]
Cpk = Annotated[float, Field(ge=LEAST_CPK, le=MOST_CPK), EXPRESSION]


class Process(Table):
    """What a process makes: normal about a mean that may be shifted and may drift."""

    example: ClassVar[str] = "{ sigma = 0.01 } or { cpk = 1.33, shift = 0.5 }"

    sigma: Omittable[Positive] = omitted(
        "standard deviation; a third of the way from the middle to the limits if left out"
    )
    cpk: Omittable[Cpk] = omitted("instead of sigma: (distance from the mean to the nearer limit) / (3 sigma)")
    shift: Sigmas = Field(0.0, description="how far the mean is above the middle of the limits, in sigmas")
    drift: Drift = Field(0.0, description="how far the mean drifts to either side, evenly, in sigmas")
    sorted: bool = Field(True, description="whether what is beyond the limits is sorted out")

    @model_validator(mode="after")
    def _one_width(self) -> Self:
        if self.sigma is not None and self.cpk is not None:
            raise problem("give sigma or cpk, not both")
        return self

    def width(self, half: float) -> float:
        """Its standard deviation, of limits that are so far from their middle."""
        if self.sigma is not None:
            return self.sigma
        if self.cpk is not None:
            return half / (SIGMAS * self.cpk + abs(self.shift))
        return half / SIGMAS


class LawTable(Table):
    """A law with numbers of its own; exactly one of its kinds."""

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": [way]} for way in WAYS]})
    example: ClassVar[str] = "{ pert = 0.01 }, { normal = { cpk = 1.33 } } or { csv = 'lot.csv', column = 'd' }"

    normal: Omittable[Process] = omitted("a process with its sigma, shift and drift")
    triangular: Omittable[Number] = omitted("the likeliest value, as the tolerance is given")
    beta: Omittable[Annotated[tuple[Exponent, Exponent], Field(strict=False)]] = omitted(
        "beta law: exponents [a, b] at the lower and at the upper limit"
    )
    pert: Omittable[Number] = omitted("PERT: the likeliest value, as the tolerance is given")
    measured: Omittable[Annotated[tuple[Number, ...], Field(strict=False, max_length=MOST_VALUES)]] = omitted(
        "measured values, two or more"
    )
    csv: Omittable[str] = omitted("file in the same folder with measured values")
    column: Omittable[str] = omitted("with csv: the name of the column in its first row")
    nominal: Number = Field(
        0.0, description="with measured values: what is subtracted from them, if they are whole sizes"
    )

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        ways = [way for way in WAYS if getattr(self, way) is not None]
        if len(ways) != 1:
            raise problem(f"a law has one of {', '.join(WAYS)}; here: {' and '.join(ways) or 'none'}")
        if self.csv is not None:
            # `load` has put the values in the place of the file.
            raise problem(
                "a table is read where the file that names it is read, not in a text or a change; write it in the file,"
                " or the values as measured"
            )
        if self.measured is not None and len(self.measured) < 2:
            raise problem(f"measured: two or more values are needed, not {len(self.measured)}")
        if self.column is not None:
            raise problem("'column' goes with csv")
        if self.nominal and self.measured is None:
            raise problem("'nominal' goes with measured values")
        return self

    @property
    def values(self) -> list[float]:
        """Measured values as deviations, in ascending order."""
        return sorted(value - self.nominal for value in self.measured or ())

    def mistake(self, low: float, high: float) -> str:
        """What is wrong with it between two limits; nothing if it fits."""
        limits = f"from {low:g} to {high:g}"
        for key in ("triangular", "pert"):
            mode = getattr(self, key)
            if mode is not None and not low <= mode <= high:
                return f"{key} = {mode:g}, the likeliest value, is not within the limits, {limits}"
        for value in self.values[:1] + self.values[-1:]:
            if not low <= value <= high:
                return (
                    f"the measured value {value + self.nominal:g} is beyond the limits, {limits}; correct or remove it"
                )
        if self.normal is not None and self.normal.sigma is not None and low < high:
            half = (high - low) / 2.0
            if not half / 1000.0 <= self.normal.sigma <= 100.0 * half:
                return f"sigma = {self.normal.sigma:g} does not fit to limits {limits}"
        return ""


def _tag(value: Any) -> str:
    """Which member of the union a law is. In angle brackets, because no key of a file can look like that."""
    return "<table>" if isinstance(value, dict | LawTable) else "<name>"


LawName = Literal["normal", "uniform", "triangular"]
#: a law by its name, or a table
ToleranceLaw = Annotated[Annotated[LawName, Tag("<name>")] | Annotated[LawTable, Tag("<table>")], Discriminator(_tag)]


def limits_of(tolerance: ToleranceTable | None, law: LawName | LawTable | None) -> tuple[float, float]:
    """How far a number may be off, in units of the file; where only measured values say so, as far as they are."""
    if tolerance is not None:
        return tolerance.low, tolerance.high
    if isinstance(law, LawTable) and law.values:
        return min(law.values[0], 0.0), max(law.values[-1], 0.0)
    return 0.0, 0.0


def check_law(tolerance: ToleranceTable | None, law: LawName | LawTable | None) -> None:
    """Refuse a law beside `sigma`, which is one already, and one that its limits do not fit to."""
    if law is not None and tolerance is not None and tolerance.sigma is not None:
        name = shown(law) if isinstance(law, str) else "{ ... }"
        raise problem(f"sigma already says how it scatters (normal, not truncated); leave out law = {name}")
    if isinstance(law, LawTable) and (wrong := law.mistake(*limits_of(tolerance, law))):
        raise problem(f"law: {wrong}")


def law_in_core(law: str | LawTable, low: float, high: float, unit: float, about: float = 0.0) -> Any:
    """A law as the core reads it, for a number between two limits.

    Parameters
    ----------
    law : str or LawTable
        Its numbers are in units of the file, from where the limits count.
    low, high : float
        The limits, SI.
    unit : float
        SI per unit of the file.
    about : float
        What the core's number counts from, SI.
    """
    middle, half = (low + high) / 2.0 - about, (high - low) / 2.0
    if law == "triangular":
        return {"triangular": {"mode": middle}} if half > 0.0 else "uniform"
    if not isinstance(law, LawTable):
        return law
    if law.values:
        return {"measured": {"values": [value * unit - about for value in law.values]}}
    if half <= 0.0:
        return "uniform"
    if law.triangular is not None:
        return {"triangular": {"mode": law.triangular * unit - about}}
    if law.beta is not None:
        return {"beta": dict(zip("ab", law.beta, strict=True))}
    if law.pert is not None:
        a = 1.0 + 4.0 * (law.pert * unit - low) / (high - low)
        return {"beta": {"a": a, "b": 6.0 - a}}
    process = law.normal or Process.model_validate({})
    sigma = process.width(half / unit) * unit
    mean = middle + process.shift * sigma
    return {"process": {"mean": mean, "sigma": sigma, "drift": process.drift * sigma, "sorted": process.sorted}}


class Deviating(Table):
    """A length or an angle: its tolerance, and its known error in a built specimen."""

    tolerance: Omittable[Tolerance] = omitted("how far it may be off")
    deviation: Number = Field(0.0, description="the known error of one built specimen")
    law: Omittable[ToleranceLaw] = omitted(LAW)

    @model_validator(mode="after")
    def _law(self) -> Self:
        check_law(self.tolerance, self.law)
        return self
