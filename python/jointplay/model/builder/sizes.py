"""Clearances in short: what is read as ``{"radial": 0.05}`` in a file is ``radial(0.05)``."""

from __future__ import annotations

from typing import Literal, Unpack

from .tables import ClearanceDict
from .values import NumberLike


def radial(size: NumberLike, /, **keys: Unpack[ClearanceDict]) -> ClearanceDict:
    """A clearance by its radial size.

    Parameters
    ----------
    size : float or str
        Hole radius minus pin radius, in the length of the file.
    **keys
        What else the clearance has, such as `length` and `axial` in space, `law` or `tolerance`.

    Returns
    -------
    dict
        The table of the file.

    Examples
    --------
    >>> radial(0.02, axial=0.05, length=30)
    {'radial': 0.02, 'axial': 0.05, 'length': 30}
    """
    return {"radial": size, **keys}


def diametral(size: NumberLike, /, **keys: Unpack[ClearanceDict]) -> ClearanceDict:
    """A clearance by its diametral size.

    Parameters
    ----------
    size : float or str
        Hole diameter minus pin diameter, in the length of the file.
    **keys
        What else the clearance has.

    Returns
    -------
    dict
        The table of the file.
    """
    return {"diametral": size, **keys}


def gap(size: NumberLike, /, **keys: Unpack[ClearanceDict]) -> ClearanceDict:
    """The clearance of a slider, of a plate, or of a pin in its slot.

    Parameters
    ----------
    size : float or str
        Gap on each side, in the length of the file.
    **keys
        What else the clearance has, such as `length`; in space `width` and `height`.

    Returns
    -------
    dict
        The table of the file.
    """
    return {"gap": size, **keys}


def fit(classes: str, /, **keys: Unpack[ClearanceDict]) -> ClearanceDict:
    """A clearance by tolerance classes of ISO 286.

    Parameters
    ----------
    classes : str
        Of the hole and of the pin, such as ``"H7/g6"``.
    **keys
        What else the clearance has: `diameter`, or `nominal` between flat faces.

    Returns
    -------
    dict
        The table of the file.
    """
    return {"fit": classes, **keys}


def bearing(group: Literal["C2", "CN", "N", "C3", "C4", "C5"], /, **keys: Unpack[ClearanceDict]) -> ClearanceDict:
    """The clearance of a deep groove ball bearing.

    Parameters
    ----------
    group : str
        Group of ISO 5753-1, such as ``"C3"``.
    **keys
        What else the clearance has: `bore`, and `reduction` by mounting.

    Returns
    -------
    dict
        The table of the file.
    """
    return {"bearing": group, **keys}


def backlash(size: NumberLike, /, **keys: Unpack[ClearanceDict]) -> ClearanceDict:
    """Backlash of teeth.

    Parameters
    ----------
    size : float or str
        From flank to flank, an arc at the pitch circle, in the length of the file.
    **keys
        What else the clearance has.

    Returns
    -------
    dict
        The table of the file.
    """
    return {"backlash": size, **keys}
