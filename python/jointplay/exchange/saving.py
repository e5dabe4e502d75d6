"""Results as files for those who ask: a workbook says what to order as well, which only the mechanism knows."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from jointplay.analyses import ordering
from jointplay.basics.typed import typed
from jointplay.errors import InputError
from jointplay.file.carried import text_in
from jointplay.model.mechanism import loads
from jointplay.result import Result, attributes, from_dataset
from jointplay.result.table import ResultTable
from jointplay.result.write import write

if TYPE_CHECKING:
    import xarray as xr


@typed
def save(result: Result | xr.Dataset, path: str | os.PathLike[str], *, csv_dialect: str = "comma") -> None:
    """Write a result; the extension says how.

    Parameters
    ----------
    result : xarray.Dataset
        Of any question.
    path : path-like
        Ending in `.nc`, `.zarr`, `.csv`, `.json`, or, with the extra `tables`, `.parquet` or `.xlsx`; or in `.md`,
        `.tex` or `.html`: what the command prints, without the numbers behind it. An existing result is replaced.
        Tables have one row for each value, like `frame`; a workbook has the answer, and the sizes to order, on sheets
        in front.
    csv_dialect : {"comma", "semicolon"}, optional
        Of a `.csv`: commas between the cells and decimal points, or semicolons and decimal commas, as office programs
        expect it in countries that write decimals with a comma.

    Raises
    ------
    InputError
        When the extension or the dialect is another one, or the file cannot be written.

    Examples
    --------
    >>> import jointplay as jp, pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "solved.csv")
    ...     jp.save(jp.solve(jp.loads(jp.examples.text("four-bar"))), path, csv_dialect="semicolon")
    ...     lines = path.read_text().splitlines()
    >>> lines[0]
    'variable;configuration;theta1;component;body;joint;value;text;unit'
    """
    light = result if isinstance(result, Result) else from_dataset(result)
    save_all({str(light.attrs.get("question", "")): light}, Path(path), csv_dialect=csv_dialect)


def save_all(results: Mapping[str, Result], target: Path, *, csv_dialect: str) -> None:
    """Write the results of several questions as one file; see `save`."""
    first = next(iter(results.values()))
    write(results, target, csv_dialect, lambda: _sizes(first))


def _sizes(result: Result) -> list[ResultTable]:
    """The sizes to order of the mechanism that a result is of, or of the first of several."""
    text = text_in(attributes(result))
    try:
        found = ordering.table(loads(text)) if isinstance(text, str) else None
    except InputError:
        # The result is one of another version, which knew other keys.
        found = None
    return [] if found is None else [found]
