"""`assemble`: the precision of an assembly, step by step.

After every step what is assembled is a mechanism of its own: the bodies that are there, on the base. It is solved with
the deviations of the built unit, the clearances taken up as its loads push them, and what is left free held at its
nominal place. Nothing is carried over from one step to the next: without friction what is assembled rests where its
loads and its elasticity want it, whatever the order in which it came together.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from jointplay.analyses.nominal import Progress
from jointplay.model import Mechanism
from jointplay.result import Result, to_dataset

from . import unit

if TYPE_CHECKING:
    import xarray as xr


def assemble(m: Mechanism, *, configuration: int = 0) -> xr.Dataset:
    """Follow the assembly of one built unit, step by step.

    Parameters
    ----------
    m : Mechanism
        With an order of assembly, and the known deviations of the unit.
    configuration : int
        At which of its configurations it is assembled.

    Returns
    -------
    xarray.Dataset
        Over `step`: `kind` (``fixed``, ``connected``, ``closing``, ``redundant``, ``loose``), `members`, `links`,
        `mobility` and `redundancy` of what is assembled, `held` (what is free and therefore held at its nominal
        place), `error_shaft` and `error_bearing` (of the centre on the first and on the second body of every joint),
        `undetermined_shaft` and `undetermined_bearing` (half-width of what the loads do not decide of them), `error`
        and `undetermined` of the output, `sensitivity` of the output (per parameter), `clearance_offset`, `contact`
        (per source), `reaction`, `member_force` (tension positive), `clearance_factor` (smallest factor on all
        clearances with which everything goes together without strain), `status`. What is not there yet is nan.

    Raises
    ------
    InputError
        When the file has no order of assembly.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("four-bar"))
    >>> m = m.with_({"assembly.steps": [["crank"], ["coupler", "rocker"]]})
    >>> jp.assemble(m).kind.values.tolist()
    ['fixed', 'connected']
    """
    return to_dataset(compute(m, configuration=configuration))


def compute(m: Mechanism, *, configuration: int = 0, progress: Progress | None = None) -> Result:
    """The light form of `assemble`."""
    return unit.compute(m, configuration, progress)
