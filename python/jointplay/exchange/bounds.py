"""The numbers of a foreign file are those of something that can be built, before anything is computed with them."""

from collections.abc import Iterator

import numpy as np

from jointplay.errors import InputError

from .skeleton import Skeleton, Vector

#: the largest number of a file, in its own unit
LARGEST = 1e12
#: metres; the mechanism file has room for no more
FARTHEST = 1e9
#: how far rounding may keep a direction from being a unit vector
ROUNDING = 1e-6


def require_bounded(skeleton: Skeleton) -> None:
    """Refuse what is farther away, or heavier, than anything is, and directions that are none."""
    for what, values in _numbers(skeleton):
        largest = float(np.abs(values).max(initial=0.0))
        # What is no number is no larger, and refused as well.
        if not largest <= FARTHEST:
            raise InputError(f"a number is too large, or none: {largest:g}, in SI units", key=what)
    for joint in skeleton.joints:
        for place in (joint.place, joint.second):
            if place is not None and place.axis is not None and not abs(np.hypot.reduce(place.axis) - 1.0) <= ROUNDING:
                raise InputError("its axis is no direction", key=f"joint '{joint.name}'")


def _numbers(skeleton: Skeleton) -> Iterator[tuple[str, Vector]]:
    for name, body in skeleton.bodies.items():
        yield (
            f"link '{name}'",
            np.array([*body.frame.at, *body.frame.axes.ravel(), *body.centre, *body.inertia.ravel(), body.mass]),
        )
    for joint in skeleton.joints:
        own = [*joint.place.at, *([] if joint.second is None else joint.second.at), joint.coordinate, joint.lead]
        own += [] if joint.follows is None else joint.follows[1:]
        own += [] if joint.curve is None else joint.curve[1]
        own += joint.motion or ()
        yield f"joint '{joint.name}'", np.array(own)
    for name, (_, frame) in skeleton.frames.items():
        yield f"frame '{name}'", np.array([*frame.at, *frame.axes.ravel()])
    yield "gravity", np.array(skeleton.gravity)
