"""`loaded`: where the load pushes every joint.

Each joint's offset lies where its clearance supports the reaction it transmits; the pose is the one of largest work of
the loads over all admissible offsets.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jointplay.errors import InputError
from jointplay.model import Mechanism
from jointplay.result import Builder, Result, to_dataset
from jointplay.typed import typed

from .nominal import Nominal, finished, nominal, report

if TYPE_CHECKING:
    import xarray as xr


@typed
def loaded(m: Mechanism, *, exact: bool = True, details: bool = True) -> xr.Dataset:
    """Find the error that the loads cause by taking up the clearances.

    Parameters
    ----------
    m : Mechanism
        With loads or gravity.
    exact : bool
        Whether the closure is solved again with contact and reactions in agreement. If not, everything is told to
        first order at the nominal pose, several times faster: `error` then is `error_first_order`, and reactions are
        the nominal ones.
    details : bool
        Whether more is told than `error`, `undetermined`, `iterations`, `status` and, of an over-constrained mechanism,
        `clearance_factor`. Of very many configurations the rest takes most of the time and the memory.

    Returns
    -------
    xarray.Dataset
        Over `configuration`: `error`, `error_first_order`, `undetermined` (half-width of what the load does not
        decide), `undetermined_contribution` (per source), `decided` (whether the load decides where a clearance goes),
        `reaction` (force and moment on the second body of every joint, at the joint, ground axes), `offset`
        (where every clearance is), `contribution` (per source; they add up to the first-order error), `iterations`
        (until contact and reactions agreed), `nominal`, `status`.

        An over-constrained or elastic mechanism has as well: `clearance_factor` (the smallest factor on all clearances
        with which rigid bodies go together), `prestress` (reactions without any load), `lack_of_fit` (largest misfit of
        the nominal mechanism), `duality_gap` (of the last cone program: how far it is from the optimum at most),
        `deformation` (of every elastic joint), `contribution_elastic` (part of its compliance in the first-order error;
        all of them together are the part of the load), and of elastic bodies `member_force` (tension positive) and
        `member_elongation`. Reactions that rigid joints without clearance share in a way that nothing decides are nan.

    Raises
    ------
    InputError
        When nothing loads the mechanism.

    Examples
    --------
    >>> import jointplay as jp
    >>> result = jp.loaded(jp.loads(jp.examples.text("four-bar")))
    >>> result.error.sel(component=["x", "y"])[0].values.round(4)
    array([ 0.9505, -3.1031])
    """
    return to_dataset(compute(m, exact=exact, details=details))


def compute(
    m: Mechanism, *, exact: bool = True, details: bool = True, offset: bool = False, at: Nominal | None = None
) -> Result:
    """The light form of `loaded`; `offset` asks for the offsets without the other details."""
    require_loads(m)
    at = at or nominal(m)
    found = m.core.loaded(at.drives, at.poses, exact, offset or details, details, partly=True)
    count, done = len(at), len(found["status"])
    at = at.first(done)
    pose = ("configuration", "component")
    builder = report(m, "loaded", at)
    words = "error of the output, actual - nominal" + ("" if exact else ", to first order")
    builder.add("error", pose, found["error"], words, "component")
    builder.add("undetermined", pose, found["undetermined"], "half-width of what the load leaves open", "component")
    if offset or details:
        builder.add("offset", ("configuration", "parameter"), found["offset"], "offset of the parameter", "parameter")
    if details:
        _details(builder, found)
    builder.add("iterations", "configuration", found["iterations"].astype(np.int64), "steps until contact was settled")
    if not m.core.isostatic:
        words = "smallest factor on the clearances with which rigid bodies go together"
        builder.add("clearance_factor", "configuration", found["clearance_factor"], words)
        if details:
            _strain(m, builder, found)
    builder.status(at.worse(found["status"]))
    return finished(builder, done, count)


def _details(builder: Builder, found: dict[str, NDArray[Any]]) -> None:
    """What every joint and every source does."""
    words = "error to first order"
    builder.add("error_first_order", ("configuration", "component"), found["error_first_order"], words, "component")
    builder.add(
        "undetermined_contribution",
        ("configuration", "source", "component"),
        found["undetermined_contribution"],
        "part of the source in what the load leaves open",
        "component",
    )
    words = "whether the load decides where the clearance goes"
    builder.add("decided", ("configuration", "source"), found["decided"], words)
    builder.add(
        "reaction",
        ("configuration", "joint", "wrench"),
        found["reaction"],
        "force and moment on the second body of the joint",
        "wrench",
    )
    builder.add(
        "contribution",
        ("configuration", "source", "component"),
        found["contribution"],
        "part of the source in the first-order error",
        "component",
    )


def _strain(m: Mechanism, builder: Builder, found: dict[str, NDArray[Any]]) -> None:
    """What over-constrained and elastic mechanisms tell beside."""
    words = "reaction without any load"
    builder.add("prestress", ("configuration", "joint", "wrench"), found["prestress"], words, "wrench")
    words = "largest misfit of the nominal mechanism, angles at its characteristic length"
    builder.add("lack_of_fit", "configuration", found["lack_of_fit"], words, "length")
    builder.add("duality_gap", "configuration", found["gap"], "relative duality gap of the last cone program")
    if not m.core.deformations:
        return
    words = "elastic deformation of the joint"
    builder.add("deformation", ("configuration", "elastic"), found["deformation"], words, "elastic")
    dims = ("configuration", "joint", "component")
    words = "part of the joint's compliance in the first-order error"
    builder.add("contribution_elastic", dims, found["contribution_elastic"], words, "component")
    if m.members:
        forces, deformations = m.core.rows, m.core.deformations
        along = [forces.index((member.joint, "along")) for member in m.members]
        words = "force of the member, tension positive"
        builder.add("member_force", ("configuration", "member"), found["force"][:, along], words, "force")
        elongation = np.zeros((len(found["force"]), len(along)))
        for k, member in enumerate(m.members):
            # A member that only bends keeps its length.
            if (member.joint, "along") in deformations:
                elongation[:, k] = found["deformation"][:, deformations.index((member.joint, "along"))]
        words = "elastic elongation of the member"
        builder.add("member_elongation", ("configuration", "member"), elongation, words, "length")


def require_loads(m: Mechanism) -> None:
    """Refuse a mechanism on which nothing acts; redundant members may load each other."""
    if not m.has_loads and m.core.isostatic:
        problem = "nothing loads the mechanism: add [[loads]] with a force or a moment, or gravity and masses"
        raise InputError(problem, file=m.file, key="loads")
