"""The verdict on a map: what becomes of the limits at every node."""

import numpy as np

from jointplay.basics.arrays import Array
from jointplay.result import Result, counted

from .judging import play_alone, together
from .margins import TAKEN
from .outcome import HELD, LOOSE, MISSED, NOT_SHOWN, UNRELIABLE
from .shares import CONTACTS, yields


def of_nodes(result: Result) -> tuple[Array, str] | None:
    """The outcome at every node, and what it rests on; empty at nodes without a pose or where the machine cannot be.

    None where there is nothing to keep to.
    """
    if "structural_error" in result.data:
        return _of_tolerance(result)
    if "limit" not in result.data or not np.isfinite(result.get("limit")).any():
        return None
    status = result.get("status")
    # Beyond its workspace a machine has no error.
    counts = counted(status) & (status != "not_assembled")
    known = counts & ~np.isin(status, UNRELIABLE)
    if "contact" in result.data:
        known &= ~np.isin(result.get("contact"), LOOSE).any(axis=-1)
    if "contact_loaded" in result.data:
        known &= ~np.isin(result.get("contact_loaded"), LOOSE)
    if "outside" in result.data:
        missed, is_open, has_number = _of_shares(result)
        basis = play_alone(result) + _contacts(result)
        if "required_yield" not in result.attrs:
            return None
    elif "margin" in result.data:
        limited = np.isfinite(result.get("limit")).any(axis=-1)
        margin, met = (result.get(name)[..., limited] for name in ("margin", "limit_met"))
        missed = np.asarray((np.isfinite(margin) & ~met.astype(bool)).any(axis=-1))
        has_number = np.asarray(np.isfinite(margin).all(axis=-1))
        is_open = np.zeros_like(missed)
        words = TAKEN.get(str(result.attrs.get("sizes", "")), "")
        basis = together(result) + (f" {words}" if words else "")
    else:
        return None
    outcomes = np.full(status.shape, "", dtype="U9")
    outcomes[counts] = NOT_SHOWN
    outcomes[known & has_number & ~is_open] = HELD
    outcomes[known & missed] = MISSED
    return outcomes, basis


def _of_shares(result: Result) -> tuple[Array, Array, Array]:
    """Where a required yield is missed, left open, and known."""
    required = float(result.attrs.get("required_yield", np.nan))
    every = [name for name in ("outside", "outside_loaded") if name in result.data]
    ends = [(result.get(f"{name}_low"), result.get(f"{name}_high")) for name in every]
    shares = [result.get(name) for name in every]
    both = [yields(share, low, high, required) for share, (low, high) in zip(shares, ends, strict=True)]
    missed, is_open = np.logical_or.reduce(both)
    return missed, is_open, np.logical_and.reduce([np.isfinite(share) for share in shares])


def _contacts(result: Result) -> str:
    own = CONTACTS.get(str(result.attrs.get("contact", "")), "")
    return f"{own} and{CONTACTS['loaded']}" if "outside_loaded" in result.data else own


def _of_tolerance(result: Result) -> tuple[Array, str] | None:
    """Whether the structural error keeps to the tolerance of the target, where the target asks for something."""
    error, tolerance = result.get("structural_error"), float(result.get("tolerance"))
    known = counted(result.get("status")) & np.isfinite(error)
    return (np.select([~known, error > tolerance], ["", MISSED], HELD), "") if np.isfinite(tolerance) else None
