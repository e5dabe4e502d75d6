"""The kinds of joint in the plane and in space: the classes of joints.py, spatial_joints.py and couplings.py."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Union

from pydantic import BeforeValidator, Discriminator, Tag

from jointplay.errors import listed, nearest, shown, suggestion

from . import couplings  # noqa: F401  (its kinds are found where their classes are)
from .joints import JointTable, PlanarJoint
from .spatial_joints import SpatialJoint
from .values import problem

Kinds = Mapping[str, type[JointTable]]


def _kinds(base: type[JointTable]) -> Kinds:
    """The classes below a base that are a kind of joint, by the `type` that a file writes, as they are defined."""
    found: dict[str, type[JointTable]] = {}
    for joint in base.__subclasses__():
        field = joint.model_fields.get("type")
        found |= {str(field.annotation.__args__[0]): joint} if field else _kinds(joint)  # type: ignore[union-attr]
    return found


PLANAR = _kinds(PlanarJoint)
SPATIAL = _kinds(SpatialJoint)


def with_coordinate(coordinate: str) -> tuple[str, ...]:
    """The kinds whose coordinate is an `angle`, or a distance `along` the axis."""
    every = [*PLANAR.items(), *SPATIAL.items()]
    return tuple(dict.fromkeys(kind for kind, joint in every if joint.coordinate == coordinate))


def _checker(here: Sequence[str], known: str, there: Sequence[str], elsewhere: str) -> Callable[[Any], Any]:
    """A validator that refuses joints of no kind, or of a kind that there is only `elsewhere`."""

    def check(value: Any) -> Any:
        if isinstance(value, JointTable):
            return value
        if not isinstance(value, dict):
            raise problem(f'a table such as {{ type = "revolute", on = {{ ... }} }} is needed, not {shown(value)}')
        if "type" not in value:
            near = nearest("type", map(str, value))
            raise problem(f"'type' is missing (one of {listed(here)})" + (f"; is it '{near}'?" if near else ""))
        kind = value["type"]
        if kind in there and kind not in here:
            raise problem(f"{shown(kind)} is a joint {elsewhere}; {known} there are {listed(here)}")
        if kind not in here:
            raise problem(f"type = {shown(kind)} is not a joint; {suggestion(str(kind), here)}")
        return value

    return check


def _tag(value: Any) -> str:
    """Which member of the union a joint is. In angle brackets, because no key of a file can look like that."""
    return f"<{value.kind if isinstance(value, JointTable) else value['type']}>"


def _any_of(kinds: Kinds, known: str, others: Kinds, elsewhere: str) -> Any:
    tagged = tuple(Annotated[joint, Tag(f"<{kind}>")] for kind, joint in kinds.items())
    check = _checker(list(kinds), known, list(others), elsewhere)
    return Annotated[Union[tagged], Discriminator(_tag), BeforeValidator(check)]  # noqa: UP007


if TYPE_CHECKING:
    Joint = PlanarJoint
    AnySpatialJoint = SpatialJoint
else:
    Joint = _any_of(PLANAR, "in the plane", SPATIAL, "in space")
    AnySpatialJoint = _any_of(SPATIAL, "in space", PLANAR, "in the plane")
