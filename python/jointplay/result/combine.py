"""Results put together: one behind the other along a new dimension, or side by side under their questions."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from jointplay.basics.arrays import Array

from .names import coordinate_names
from .origin import Origin
from .structure import Result, Variable

#: dimensions whose labels may differ between mechanisms
NAMED = ("source", "joint", "parameter", "body", "drive", "member", "elastic", "acting_load")
#: attributes on which verdicts rest, and which may differ between mechanisms or values of a sweep
JUDGED_BY = ("required_yield", "contact", "sizes")
#: dimensions of several outputs and load cases
SEVERAL = ("output", "load_case")


def stack(results: Sequence[Result], along: Variable, attrs: Mapping[str, str | int | float]) -> Result:
    """Results of the same shape along a new leading dimension.

    Coordinates that are the same in all of them stay as they are. What only some of them have, such as shares under a
    load, is nan in the others.

    Parameters
    ----------
    along : Variable
        The new coordinate; its one dimension is the new one.
    attrs : mapping
        Attributes of the whole.
    """
    (dim,) = along.dims
    if len({frozenset(result.data) for result in results}) > 1:
        results = [_completed(result, results) for result in results]
    coords: dict[str, Variable] = {dim: along}
    for name, first in results[0].coords.items():
        variables = [result.coords[name] for result in results]
        same = all(_same(first.values, v.values) for v in variables)
        coords[name] = first if same else _stacked(variables, dim)
    data = {name: _stacked([result.data[name] for result in results], dim) for name in results[0].data}
    # Of two mechanisms, or values, each keeps to its own.
    for name in JUDGED_BY:
        values = [result.attrs.get(name) for result in results]
        if any(value != values[0] for value in values):
            missing = np.nan if isinstance(next(filter(None, values)), float) else ""
            coords[name] = Variable((dim,), np.array([missing if value is None else value for value in values]))
            attrs = {key: value for key, value in attrs.items() if key != name}
    return Result(coords, data, attrs, results[0].origin)


def beside(results: Sequence[Result], dim: str, labels: Sequence[str], words: str, same: Sequence[str] = ()) -> Result:
    """Results of the outputs, or of the load cases, of one mechanism along a new leading dimension.

    Attributes that differ become coordinates; `same` names variables that do not depend on it.
    """
    first = results[0]
    known = {name for result in results for name in result.attrs}
    values = {name: [result.attrs.get(name, np.nan) for result in results] for name in sorted(known)}
    apart = {name: v for name, v in values.items() if any(value != v[0] for value in v)}
    attrs = {name: value for name, value in first.attrs.items() if name not in apart}
    along = Variable((dim,), np.array(labels, dtype=str), "", words)
    stacked = stack(results, along, attrs)
    coords = {name: Variable((dim,), np.array(v)) for name, v in apart.items()}
    data = {name: first.data[name] if name in same and name in first.data else v for name, v in stacked.data.items()}
    return Result({**stacked.coords, **coords}, data, attrs, stacked.origin)


def parts(result: Result) -> list[tuple[str, Result]]:
    """The results of every output and load case, each with its heading; the result itself where there are none."""
    dims = [dim for dim in SEVERAL if dim in result.sizes]
    found = [("", result)]
    for dim in dims:
        labels = result.labels(dim)
        word = dim.replace("_", " ")
        found = [
            (f"{heading}, {word} {label}" if heading else f"{word.capitalize()} {label}", part.isel(dim, k))
            for heading, part in found
            for k, label in enumerate(labels)
        ]
    return [(heading, _with_own_attributes(part) if dims else part) for heading, part in found]


def _with_own_attributes(result: Result) -> Result:
    own = {name: v.values.item() for name, v in result.coords.items() if not v.dims and name not in SEVERAL}
    known = {name: value for name, value in own.items() if value == value}
    return Result(result.coords, result.data, {**result.attrs, **known})


def judged_alone(result: Result) -> Result:
    """One mechanism of a comparison, or value of a sweep, with those attributes of its own that verdicts rest on."""
    own = {name: result.coords[name].values.item() for name in JUDGED_BY if name in result.coords}
    known = {name: value for name, value in own.items() if value == value and value != ""}
    return replace(result, attrs={**result.attrs, **known})


def _same(a: Array, b: Array) -> bool:
    return a.shape == b.shape and bool(np.array_equal(a, b, equal_nan=a.dtype.kind == "f" and b.dtype.kind == "f"))


def _stacked(variables: Sequence[Variable], dim: str) -> Variable:
    first = variables[0]
    # Both mechanisms' units, where a variable of one has another unit than that of the other.
    units = ", ".join(dict.fromkeys(v.units for v in variables))
    return Variable((dim, *first.dims), np.stack([v.values for v in variables]), units, first.long_name)


def align(results: Sequence[Result]) -> list[Result]:
    """The results with the union of their sources, joints, ... as labels, and nan where one of them has none."""
    unions: dict[str, list[str]] = {}
    for dim in NAMED:
        labels = [label for result in results if dim in result.coords for label in result.labels(dim)]
        unions[dim] = list(dict.fromkeys(labels))
    aligned = []
    for result in results:
        data = {name: _spread(v, result, unions) for name, v in result.data.items()}
        coords = {name: _spread(v, result, unions) for name, v in result.coords.items() if name not in NAMED}
        for dim in NAMED:
            if dim in result.coords:
                coords[dim] = Variable((dim,), np.array(unions[dim], dtype=str))
        aligned.append(Result(coords, data, result.attrs))
    # Words that belong to a label (its unit, its kind) come from the first result that has the label.
    for name in {name for result in aligned for name, v in result.coords.items() if v.values.dtype.kind == "U"}:
        versions = [result.coords[name] for result in aligned if name in result.coords]
        values = versions[0].values
        for other in versions[1:]:
            values = np.where(values == "", other.values, values)
        filled = Variable(versions[0].dims, values, versions[0].units, versions[0].long_name)
        for k, result in enumerate(aligned):
            if name in result.coords:
                aligned[k] = Result({**result.coords, name: filled}, result.data, result.attrs)
    return [_completed(result, aligned) for result in aligned]


def _completed(result: Result, every: Sequence[Result]) -> Result:
    """With what only others have, such as the forces of a structure beside a mechanism without redundant members."""
    coords = {name: v if "configuration" not in v.dims else _nothing(v) for r in every for name, v in r.coords.items()}
    data = {name: _nothing(v) for r in every for name, v in r.data.items()}
    return Result({**coords, **result.coords}, {**data, **result.data}, result.attrs)


def _nothing(variable: Variable) -> Variable:
    values = variable.values
    empty = np.full(values.shape, "", dtype=values.dtype) if values.dtype.kind == "U" else np.full(values.shape, np.nan)
    return Variable(variable.dims, empty, variable.units, variable.long_name)


def _spread(variable: Variable, result: Result, unions: Mapping[str, list[str]]) -> Variable:
    values = variable.values
    for axis, dim in enumerate(variable.dims):
        labels = result.labels(dim) if dim in unions else []
        if dim not in unions or labels == unions[dim]:
            continue
        shape = list(values.shape)
        shape[axis] = len(unions[dim])
        text = values.dtype.kind == "U"
        spread = np.full(shape, "", dtype=values.dtype) if text else np.full(shape, np.nan)
        index = [unions[dim].index(label) for label in labels]
        np.moveaxis(spread, axis, 0)[index] = np.moveaxis(values, axis, 0)
        values = spread
    return Variable(variable.dims, values, variable.units, variable.long_name)


def merge(results: Mapping[str, Result]) -> Result:
    """Results of several questions on one mechanism as one.

    A variable that only says what it is together with its question gets the question in front: `loaded_error`,
    `worst_contribution`, `random_error_mean`, `worst_status`. `nominal` is the same for all and stays.
    """
    if len(results) == 1:
        return next(iter(results.values()))
    count = max(result.sizes.get("configuration", 0) for result in results.values())
    results = {question: _padded(result, count) for question, result in results.items()}
    coords: dict[str, Variable] = {}
    data: dict[str, Variable] = {}
    attrs: dict[str, str | int | float] = {}
    for question, result in results.items():
        coords |= {name: v for name, v in result.coords.items() if name not in result.drives}
        for name, variable in result.data.items():
            if name == "nominal":
                data[name] = variable
            else:
                data[name if name.startswith(f"{question}_") else f"{question}_{name}"] = variable
        attrs |= result.attrs
    attrs["question"] = ", ".join(results)
    drives = _drives(list(results.values()), {*Result(coords, data).sizes, *coords, *data, *attrs})
    attrs |= {"drives": ", ".join(drives)} if drives else {}
    return Result({**coords, **drives}, data, attrs, _origin(results))


def _origin(results: Mapping[str, Result]) -> Origin | None:
    """Of all questions: their options stand under their names."""
    known = {question: result.origin for question, result in results.items() if result.origin is not None}
    if not known:
        return None
    first = next(iter(known.values()))
    return replace(first, options={question: origin.options for question, origin in known.items()})


def _drives(results: Sequence[Result], taken: set[str]) -> dict[str, Variable]:
    """The drives, which the results may call differently: a name that one of them has to give up is given up."""
    known = [result.drives for result in results if result.drives]
    names = [max(several, key=len) for several in zip(*known, strict=True)]
    return dict(zip(coordinate_names(names, taken), known[0].values() if known else (), strict=True))


def _padded(result: Result, count: int) -> Result:
    """A result that was interrupted, with nothing in the configurations that it has not come to."""
    missing = count - result.sizes.get("configuration", count)
    if not missing:
        return result

    def pad(variable: Variable) -> Variable:
        values = variable.values
        fill: str | float = "" if values.dtype.kind == "U" else np.nan
        shape = [missing if dim == "configuration" else n for dim, n in zip(variable.dims, values.shape, strict=True)]
        axis = variable.dims.index("configuration")
        padded = np.concatenate([values, np.full(shape, fill)], axis=axis)
        return Variable(variable.dims, padded, variable.units, variable.long_name)

    # Which configuration it is, at which drive values and poses, the other results know.
    own = {name: v for name, v in result.data.items() if name != "nominal"}
    data = {name: pad(v) if "configuration" in v.dims else v for name, v in own.items()}
    coords = {name: v for name, v in result.coords.items() if "configuration" not in v.dims}
    return Result(coords, data, result.attrs)
