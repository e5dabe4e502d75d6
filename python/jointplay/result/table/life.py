"""How clearances wear: their growth, and clearances and errors at some ages."""

from collections.abc import Iterator

import numpy as np

from jointplay.result import Result, first_largest
from jointplay.result.conclusions.wear import MANY

from .layout import NOTHING, Column, ResultTable, numbers, some, words

#: more clearances are not shown age by age
MOST_COLUMNS = 6
#: relative difference of growth with every second configuration from which on the path is called coarse
COARSE = 0.01


def overview(result: Result) -> list[ResultTable]:
    """The tables of `life`."""
    tables = [ResultTable("Wear of the clearances", tuple(_sources(result)), tuple(_notes(result)))]
    if result.sizes.get("age", 0):
        tables.append(ResultTable("Clearances and errors by age", tuple(_ages(result)), tuple(_about_ages(result))))
    return tables


def _sources(result: Result) -> Iterator[Column]:
    yield words("source", result.labels("source"), is_key=True)
    yield Column("measure", "", tuple(result.labels("source_measure")), left=True, spare=3)
    unit = result.unit("size")
    growth = MANY * result.get("growth")
    both = numbers("", "", np.concatenate([result.get("size"), result.get("size_worn")])).cells
    yield Column("new", unit, both[: len(growth)])
    if np.isfinite(result.get("size_worn")).any():
        yield Column("worn", unit, both[len(growth) :])
    yield numbers(f"growth in\n{MANY:,} cycles", unit, growth)
    fastest = np.nanmax(growth, initial=0.0)
    if fastest > 0.0 and len(growth) > 1:
        yield numbers("of the\nfastest", "%", 100.0 * growth / fastest, digits=3)
    for name, head, spare in (("sliding", "sliding\nper cycle", 2), ("pressure", "pressure\nmost", 1)):
        if np.isfinite(result.get(name)).any():
            column = numbers(head, result.unit(name), result.get(name))
            yield Column(column.name, column.unit, column.cells, spare=spare)
    if np.isfinite(result.get("used_without")).any():
        yield numbers("without its\nwear used", "%", 100.0 * result.get("used_without"), digits=3)


def _ages(result: Result) -> Iterator[Column]:
    ages = np.array(result.labels("age"), dtype=float)
    yield Column("cycles", "", tuple(f"{age:,.0f}" for age in ages), is_key=True)
    names, clearances = result.labels("source"), result.get("clearance")
    if len(names) <= MOST_COLUMNS:
        cells = numbers("", "", clearances.reshape(-1)).cells
        for k, name in enumerate(names):
            yield Column(name, result.unit("clearance"), cells[k :: len(names)], spare=1)
    for name in ("position", "rotation"):
        values = result.get(name)
        known = np.asarray(np.isfinite(values).any(axis=1))
        largest = np.where(known, np.max(np.where(np.isfinite(values), values, -np.inf), axis=1), np.nan)
        yield numbers(f"{name}\nlargest", result.unit(name), largest)
        places = first_largest(np.where(np.isfinite(values), values, -np.inf)).tolist()
        cells = tuple(str(place) if ok else NOTHING for place, ok in zip(places, known.tolist(), strict=True))
        column = Column(f"{name}\nat #", "", cells, spare=2)
        if values.shape[1] > 1:
            yield column
    if "used" in result.data:
        used = result.get("used")
        column = numbers("of the\nlimits", "%", 100.0 * used)
        yield Column(column.name, column.unit, column.cells, alarms=tuple(np.flatnonzero(used > 1.0).tolist()))


def _about_ages(result: Result) -> Iterator[str]:
    asked = str(result.attrs["asked"])
    what = {"random": "95 % of the specimens are below them", "loaded": "under the loads", "worst": "in the worst case"}
    yield f"Errors: {what[asked]}, the largest over the configurations."


def _notes(result: Result) -> Iterator[str]:
    if "incomplete" in result.attrs:
        yield f"{str(result.attrs['incomplete']).capitalize()}."
    names = np.array(result.labels("source"), dtype=str)
    growth, coarse = result.get("growth"), result.get("growth_coarse")
    off = np.abs(np.divide(coarse, growth, out=np.ones_like(growth), where=growth > 0.0) - 1.0)
    if (off > COARSE).any():
        k = int(np.nanargmax(off))
        yield (
            f"The path is coarse: with every second configuration the growth of {names[k]} is {100.0 * off[k]:.2g} %"
            " different. Give the drives a larger count."
        )
    if "without_wear" in result.attrs:
        yield f"Without wear, as they are: {some(str(result.attrs['without_wear']).split(', '))}."
    unknown = names[~np.isfinite(growth)].tolist()
    if unknown and str(result.get("status")) == "undetermined":
        shares = "Joints without clearance and stiffness share a load in a way that is not known"
        yield f"The growth of {some(unknown)} is not known. {shares}."
    if "steps" in result.attrs:
        yield "The load jumps from joint to joint as they wear; the growth is that in short steps."
    if "rate_factor" in result.attrs:
        yield "Uniform growth by Archard's law: no running-in, no lubrication, no change of the shape of contacts."
