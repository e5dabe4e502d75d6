"""Names of drives beside the names that a result has already.

Variables, coordinates, dimensions and attributes of a result are reached as attributes of its `xarray.Dataset`. A
drive is a coordinate under its own name; one whose name something else has, or which an attribute of xarray's own
would hide, is called `drive_NAME`.
"""

import keyword
from collections.abc import Iterable

from jointplay.file.carried import LETTERS, TEXT

#: attributes of xarray.Dataset and xarray.DataArray, so that names depend neither on its version nor on importing it
HIDING = frozenset(
    """
    T all any apply argmax argmin argsort as_numpy assign assign_attrs assign_coords astype attrs bfill
    broadcast_equals broadcast_like chunk chunks chunksizes clip close coarsen combine_first compute conj conjugate
    convert_calendar coords copy count cumprod cumsum cumulative cumulative_integrate curvefit data data_vars diff
    differentiate dims dot drop drop_attrs drop_dims drop_duplicates drop_encoding drop_indexes drop_isel drop_sel
    drop_vars dropna dt dtype dtypes dump_to_store encoding equals eval expand_dims ffill fillna filter_by_attrs
    from_dataframe from_dict from_iris from_series get get_axis_num get_index groupby groupby_bins head identical
    idxmax idxmin imag indexes info integrate interp interp_calendar interp_like interpolate_na isel isin isnull
    item items keys load load_async load_store loc map map_blocks max mean median merge min name nbytes ndim notnull
    pad persist pipe plot polyfit prod quantile query rank real reduce reindex reindex_like rename rename_dims
    rename_vars reorder_levels resample reset_coords reset_encoding reset_index roll rolling rolling_exp round
    searchsorted sel set_close set_coords set_index set_xindex shape shift size sizes sortby squeeze stack std str
    sum swap_dims tail thin to_array to_dask_dataframe to_dataarray to_dataframe to_dataset to_dict to_index to_iris
    to_masked_array to_netcdf to_numpy to_pandas to_series to_stacked_array to_unstacked_dataset to_zarr transpose
    unify_chunks unstack update values var variable variables weighted where xindexes
    """.split()  # noqa: SIM905 (quoted one by one they fill three times the lines)
)
#: attributes that a result gets after its drives are named
LATER = (
    "coordinates",
    "drives",
    "fingerprint",
    "grid",
    "incomplete",
    "sweep",
    "sweep_by",
    "created",
    "options",
    *(f"{TEXT}{which}{letter}" for which in ("", "_hash") for letter in ("", *LETTERS)),
)


def coordinate_names(own: Iterable[str], taken: Iterable[str], prefix: str = "drive_") -> list[str]:
    """What drives are called among other names.

    Parameters
    ----------
    own : iterable of str
        Names of the drives.
    taken : iterable of str
        Names of the variables, coordinates, dimensions and attributes of the result.
    prefix : str
        Put in front, as often as it takes, of a name that is not free.

    Examples
    --------
    >>> coordinate_names(["theta", "error", "mean", "drive_error"], ["error", "status"])
    ['theta', 'drive_drive_error', 'drive_mean', 'drive_error']
    """
    used, names = {*taken, *LATER}, list(own)

    def is_free(name: str) -> bool:
        return not (name in used or name in HIDING or keyword.iskeyword(name) or name.startswith("_"))

    # A drive that can keep its name does so, whatever the others are called.
    renamed = []
    for k, name in enumerate(names):
        if is_free(name):
            used.add(name)
        else:
            renamed.append(k)
    for k in renamed:
        while not is_free(names[k]):
            names[k] = prefix + names[k]
        used.add(names[k])
    return names
