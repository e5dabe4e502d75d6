"""The methods that write the tables of a mechanism, with their keys.

Written from the schema of the file by tests/helpers/signatures.py; not by hand.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from .tables import (
    AxisDeviationDict,
    BacklashDict,
    BallClearanceDict,
    BallFrictionDict,
    BallStiffnessDict,
    BallWearDict,
    BearingClearanceDict,
    BeltClearanceDict,
    BlockWearDict,
    BoundsDict,
    ChoiceDict,
    CircleDict,
    ComponentDeviationDict,
    ErrorLimitsDict,
    FlankClearanceDict,
    FlankStiffnessDict,
    GuideClearanceDict,
    GuideFrictionDict,
    GuideStiffnessDict,
    GuideWearDict,
    JournalFrictionDict,
    JournalStiffnessDict,
    JournalWearDict,
    LawDict,
    LineDict,
    LockedAngleDict,
    MountStiffnessDict,
    PlacementDict,
    PlateClearanceDict,
    PlateStiffnessDict,
    PlateWearDict,
    PositionDict,
    RatioErrorDict,
    RevoluteClearanceDict,
    RunOutDict,
    ScrewClearanceDict,
    SleeveClearanceDict,
    SleeveStiffnessDict,
    SleeveWearDict,
    SlotClearanceDict,
    SlotFrictionDict,
    SlotStiffnessDict,
    StrandStiffnessDict,
    TargetDict,
    TargetDwellDict,
    TargetFunctionDict,
    ThreadFrictionDict,
    ToleranceDict,
    ToothFrictionDict,
    VariationDict,
)
from .values import Count, NumberLike, NumbersLike, RowsLike
from .writing import Writing


class Parts(Writing):
    """What the mechanism and a pattern of it are made of."""

    def revolute(
        self,
        name: str,
        /,
        *,
        clearance: BearingClearanceDict | None = None,
        stiffness: JournalStiffnessDict | None = None,
        wear: JournalWearDict | None = None,
        friction: NumberLike | JournalFrictionDict | None = None,
        on: Mapping[str, NumbersLike | PlacementDict] | None = None,
        bodies: Sequence[str] | None = None,
        at: NumbersLike | None = None,
        axis: NumberLike | NumbersLike | None = None,
        side: NumbersLike | None = None,
        position: Mapping[str, PositionDict] | None = None,
        direction: Mapping[str, NumberLike | AxisDeviationDict] | None = None,
        **places: NumbersLike | PlacementDict,
    ) -> None:
        """A pin in a hole.

        Parameters
        ----------
        name : str
            Its name.
        clearance : optional
            Play built into the joint.
        stiffness : optional
            How hard it is in the directions that it holds; rigid if left out.
        wear : optional
            How fast its clearance grows.
        friction : optional
            Friction against its motion, which counts where a direction of approach is asked for; a number: its
            coefficient.
        on : optional
            The bodies with the joint's place on each, in body axes; the first carries pin or guide.
        bodies : optional
            Instead of `on`: bodies described in one assembled reference configuration.
        at : optional
            With `bodies`: the joint's point, the same for all.
        axis : optional
            With `bodies`: its direction, the same for all.
        side : optional
            With `bodies`: a direction across the axis, the same for all (in space only).
        position : optional
            Deviation of its place, by the name of the body.
        direction : optional
            Deviation of the angle of its axis, by the name of the body; in space: deviation of its axis, by the name of
            the body.
        **places
            Its place on each body, by the name of the body: as in `on`.
        """
        self._joint("revolute", locals())

    def prismatic(
        self,
        name: str,
        /,
        *,
        clearance: GuideClearanceDict | None = None,
        stiffness: GuideStiffnessDict | None = None,
        wear: GuideWearDict | None = None,
        friction: NumberLike | GuideFrictionDict | None = None,
        on: Mapping[str, NumbersLike | PlacementDict] | None = None,
        bodies: Sequence[str] | None = None,
        at: NumbersLike | None = None,
        axis: NumberLike | NumbersLike | None = None,
        side: NumbersLike | None = None,
        position: Mapping[str, PositionDict] | None = None,
        direction: Mapping[str, NumberLike | AxisDeviationDict] | None = None,
        **places: NumbersLike | PlacementDict,
    ) -> None:
        """A slider in a guide, which the first body carries.

        Parameters
        ----------
        name : str
            Its name.
        clearance : optional
            Play built into the joint.
        stiffness : optional
            How hard it is in the directions that it holds; rigid if left out.
        wear : optional
            How fast its clearance grows.
        friction : optional
            Friction against its motion, which counts where a direction of approach is asked for; a number: its
            coefficient.
        on, bodies, at, axis, side, position, direction : optional
            As of `revolute`.
        **places
            Its place on each body, by the name of the body: as in `on`.
        """
        self._joint("prismatic", locals())

    def pin_in_slot(
        self,
        name: str,
        /,
        *,
        clearance: SlotClearanceDict | None = None,
        stiffness: SlotStiffnessDict | None = None,
        wear: BlockWearDict | None = None,
        friction: NumberLike | SlotFrictionDict | None = None,
        on: Mapping[str, NumbersLike | PlacementDict] | None = None,
        bodies: Sequence[str] | None = None,
        at: NumbersLike | None = None,
        axis: NumberLike | NumbersLike | None = None,
        position: Mapping[str, PositionDict] | None = None,
        direction: Mapping[str, NumberLike | ComponentDeviationDict] | None = None,
        **places: NumbersLike | PlacementDict,
    ) -> None:
        """A pin in a straight slot, which the first body carries.

        Parameters
        ----------
        name : str
            Its name.
        clearance : optional
            Play built into the joint.
        stiffness : optional
            How hard it is in the directions that it holds; rigid if left out.
        wear : optional
            How fast its clearance grows.
        friction : optional
            Friction against its motion, which counts where a direction of approach is asked for; a number: its
            coefficient.
        on, bodies, at, axis, position : optional
            As of `revolute`.
        direction : optional
            Deviation of the angle of its axis, by the name of the body.
        **places
            Its place on each body, by the name of the body: as in `on`.
        """
        self._joint("pin_in_slot", locals())

    def fixed(
        self,
        name: str,
        /,
        *,
        clearance: RevoluteClearanceDict | None = None,
        angle: LockedAngleDict | None = None,
        stiffness: MountStiffnessDict | None = None,
        on: Mapping[str, NumbersLike | PlacementDict] | None = None,
        bodies: Sequence[str] | None = None,
        at: NumbersLike | None = None,
        axis: NumberLike | NumbersLike | None = None,
        side: NumbersLike | None = None,
        position: Mapping[str, PositionDict] | None = None,
        direction: Mapping[str, NumberLike | AxisDeviationDict] | None = None,
        **places: NumbersLike | PlacementDict,
    ) -> None:
        """Two bodies locked together; an axis on them gives the mounting angle.

        Parameters
        ----------
        name : str
            Its name.
        clearance : optional
            Play of a pin whose angle is locked: a hinge that latches (in the plane only).
        angle : optional
            Error of the mounting angle; in space: error of the mounting angle about the axis.
        stiffness : optional
            How hard it is in the directions that it holds; rigid if left out.
        on, bodies, at, axis, side, position, direction : optional
            As of `revolute`.
        **places
            Its place on each body, by the name of the body: as in `on`.
        """
        self._joint("fixed", locals())

    def gear(
        self,
        name: str,
        /,
        *,
        ratio_error: NumberLike | RatioErrorDict | None = None,
        efficiency: NumberLike | NumbersLike | None = None,
        runout: Mapping[str, NumberLike | RunOutDict] | None = None,
        clearance: FlankClearanceDict | None = None,
        stiffness: FlankStiffnessDict | None = None,
        teeth: Sequence[Count] | None = None,
        module: NumberLike | None = None,
        radii: NumbersLike | None = None,
        internal: bool | None = None,
        pressure_angle: NumberLike | None = None,
        marks: Mapping[str, NumberLike | NumbersLike] | None = None,
        on: Mapping[str, NumbersLike | PlacementDict] | None = None,
        bodies: Sequence[str] | None = None,
        at: RowsLike | None = None,
        axis: NumberLike | NumbersLike | None = None,
        side: NumbersLike | None = None,
        position: Mapping[str, PositionDict] | None = None,
        direction: Mapping[str, NumberLike | AxisDeviationDict] | None = None,
        **places: NumbersLike | PlacementDict,
    ) -> None:
        """Two toothed wheels that mesh.

        Parameters
        ----------
        name : str
            Its name.
        ratio_error : optional
            Transmission error, a length at the pitch circle (of crossed gears that of the second wheel, of a screw
            along its axis).
        efficiency : optional
            Power out over power in, which counts where a direction of approach is asked for; of a pair the first where
            the first body drives, of a screw where its turning drives.
        runout : optional
            Eccentricity of its wheels, by the name of the body.
        clearance : optional
            Play built into the joint.
        stiffness : optional
            How hard it is in the directions that it holds; rigid if left out.
        teeth : optional
            Tooth counts of the wheels on the first and on the second body.
        module : optional
            Module: pitch diameter over tooth count.
        radii : optional
            Instead of the module: pitch radii of both wheels.
        internal : optional
            Whether the second body is a ring with teeth inside.
        pressure_angle : optional
            Pressure angle where the pitch circles touch, at most 45 degrees; 20 if left out.
        marks : optional
            Direction from the first centre to the second in the axes of each body, where the teeth mesh; as in the
            start if left out.
        on, bodies : optional
            As of `revolute`.
        at : optional
            With `bodies`: the joint's point on each of the two, as drawn.
        axis, side, position, direction : optional
            As of `revolute`.
        **places
            Its place on each body, by the name of the body: as in `on`.
        """
        self._joint("gear", locals())

    def rack(
        self,
        name: str,
        /,
        *,
        ratio_error: NumberLike | RatioErrorDict | None = None,
        efficiency: NumberLike | NumbersLike | None = None,
        runout: Mapping[str, NumberLike | RunOutDict] | None = None,
        clearance: FlankClearanceDict | None = None,
        stiffness: FlankStiffnessDict | None = None,
        radius: NumberLike | None = None,
        teeth: Count | None = None,
        module: NumberLike | None = None,
        pressure_angle: NumberLike | None = None,
        on: Mapping[str, NumbersLike | PlacementDict] | None = None,
        bodies: Sequence[str] | None = None,
        at: RowsLike | None = None,
        axis: NumberLike | NumbersLike | None = None,
        side: NumbersLike | None = None,
        position: Mapping[str, PositionDict] | None = None,
        direction: Mapping[str, NumberLike | AxisDeviationDict] | None = None,
        **places: NumbersLike | PlacementDict,
    ) -> None:
        """A rack on the first body, along the joint's axis, and a pinion on the second.

        Parameters
        ----------
        name : str
            Its name.
        ratio_error : optional
            Transmission error, a length at the pitch circle (of crossed gears that of the second wheel, of a screw
            along its axis).
        efficiency : optional
            Power out over power in, which counts where a direction of approach is asked for; of a pair the first where
            the first body drives, of a screw where its turning drives.
        runout : optional
            Eccentricity of its wheels, by the name of the body.
        clearance : optional
            Play built into the joint.
        stiffness : optional
            How hard it is in the directions that it holds; rigid if left out.
        radius : optional
            Pitch radius of the pinion.
        teeth : optional
            Tooth count of the pinion.
        module : optional
            Instead of the radius, with teeth: pitch diameter over tooth count.
        pressure_angle : optional
            Pressure angle, at most 45 degrees; 20 if left out.
        on, bodies : optional
            As of `revolute`.
        at : optional
            With `bodies`: the joint's point on each of the two, as drawn.
        axis, side, position, direction : optional
            As of `revolute`.
        **places
            Its place on each body, by the name of the body: as in `on`.
        """
        self._joint("rack", locals())

    def belt(
        self,
        name: str,
        /,
        *,
        ratio_error: NumberLike | RatioErrorDict | None = None,
        efficiency: NumberLike | NumbersLike | None = None,
        runout: Mapping[str, NumberLike | RunOutDict] | None = None,
        clearance: BeltClearanceDict | None = None,
        stiffness: StrandStiffnessDict | None = None,
        radii: NumbersLike | None = None,
        teeth: Sequence[Count] | None = None,
        pitch: NumberLike | None = None,
        crossed: bool | None = None,
        distance: NumberLike | None = None,
        marks: Mapping[str, NumberLike | NumbersLike] | None = None,
        on: Mapping[str, NumbersLike | PlacementDict] | None = None,
        bodies: Sequence[str] | None = None,
        at: RowsLike | None = None,
        axis: NumberLike | NumbersLike | None = None,
        side: NumbersLike | None = None,
        position: Mapping[str, PositionDict] | None = None,
        direction: Mapping[str, NumberLike | AxisDeviationDict] | None = None,
        **places: NumbersLike | PlacementDict,
    ) -> None:
        """A belt or chain around two pulleys.

        Parameters
        ----------
        name : str
            Its name.
        ratio_error : optional
            Transmission error, a length at the pitch circle (of crossed gears that of the second wheel, of a screw
            along its axis).
        efficiency : optional
            Power out over power in, which counts where a direction of approach is asked for; of a pair the first where
            the first body drives, of a screw where its turning drives.
        runout : optional
            Eccentricity of its wheels, by the name of the body.
        clearance : optional
            Slack of the belt or chain.
        stiffness : optional
            How hard it is in the directions that it holds; rigid if left out.
        radii : optional
            Pitch radii of the pulleys on the first and on the second body.
        teeth : optional
            Tooth counts of the pulleys or sprockets.
        pitch : optional
            Instead of the radii, with teeth: distance of two teeth of the belt or chain.
        crossed : optional
            Whether it is crossed, so that the pulleys turn against each other.
        distance : optional
            Distance of the centres at which it has its slack; as in the start if left out.
        marks : optional
            Direction from the first centre to the second in the axes of each body, where the teeth mesh; as in the
            start if left out.
        on, bodies : optional
            As of `revolute`.
        at : optional
            With `bodies`: the joint's point on each of the two, as drawn.
        axis, side, position, direction : optional
            As of `revolute`.
        **places
            Its place on each body, by the name of the body: as in `on`.
        """
        self._joint("belt", locals())

    def cylindrical(
        self,
        name: str,
        /,
        *,
        clearance: SleeveClearanceDict | None = None,
        stiffness: SleeveStiffnessDict | None = None,
        wear: SleeveWearDict | None = None,
        on: Mapping[str, NumbersLike | PlacementDict] | None = None,
        bodies: Sequence[str] | None = None,
        at: NumbersLike | None = None,
        axis: NumbersLike | None = None,
        side: NumbersLike | None = None,
        position: Mapping[str, PositionDict] | None = None,
        direction: Mapping[str, NumberLike | AxisDeviationDict] | None = None,
        **places: NumbersLike | PlacementDict,
    ) -> None:
        """A pin that turns and slides in its hole.

        Parameters
        ----------
        name : str
            Its name.
        clearance : optional
            Play built into the joint.
        stiffness : optional
            How hard it is in the directions that it holds; rigid if left out.
        wear : optional
            How fast its clearance grows.
        on, bodies, at : optional
            As of `revolute`.
        axis : optional
            With `bodies`: its direction, the same for all.
        side : optional
            With `bodies`: a direction across the axis, the same for all.
        position : optional
            As of `revolute`.
        direction : optional
            Deviation of its axis, by the name of the body.
        **places
            Its place on each body, by the name of the body: as in `on`.
        """
        self._joint("cylindrical", locals())

    def spherical(
        self,
        name: str,
        /,
        *,
        clearance: BallClearanceDict | None = None,
        stiffness: BallStiffnessDict | None = None,
        wear: BallWearDict | None = None,
        friction: NumberLike | BallFrictionDict | None = None,
        on: Mapping[str, NumbersLike | PlacementDict] | None = None,
        bodies: Sequence[str] | None = None,
        at: NumbersLike | None = None,
        axis: NumbersLike | None = None,
        side: NumbersLike | None = None,
        position: Mapping[str, PositionDict] | None = None,
        direction: Mapping[str, NumberLike | AxisDeviationDict] | None = None,
        **places: NumbersLike | PlacementDict,
    ) -> None:
        """A ball in a socket.

        Parameters
        ----------
        name : str
            Its name.
        clearance : optional
            Play built into the joint.
        stiffness : optional
            How hard it is in the directions that it holds; rigid if left out.
        wear : optional
            How fast its clearance grows.
        friction : optional
            Friction against its motion, which counts where a direction of approach is asked for; a number: its
            coefficient.
        on, bodies, at : optional
            As of `revolute`.
        axis : optional
            With `bodies`: its direction, the same for all.
        side : optional
            With `bodies`: a direction across the axis, the same for all.
        position : optional
            As of `revolute`.
        direction : optional
            Deviation of its axis, by the name of the body.
        **places
            Its place on each body, by the name of the body: as in `on`.
        """
        self._joint("spherical", locals())

    def universal(
        self,
        name: str,
        /,
        *,
        clearance: BearingClearanceDict | None = None,
        stiffness: JournalStiffnessDict | None = None,
        wear: JournalWearDict | None = None,
        friction: NumberLike | JournalFrictionDict | None = None,
        on: Mapping[str, NumbersLike | PlacementDict] | None = None,
        bodies: Sequence[str] | None = None,
        at: NumbersLike | None = None,
        axis: NumbersLike | None = None,
        side: NumbersLike | None = None,
        axes: RowsLike | None = None,
        position: Mapping[str, PositionDict] | None = None,
        direction: Mapping[str, NumberLike | AxisDeviationDict] | None = None,
        **places: NumbersLike | PlacementDict,
    ) -> None:
        """A cross whose two pins, at right angles, sit in one body each.

        Parameters
        ----------
        name : str
            Its name.
        clearance : optional
            Play of each of the two pins.
        stiffness : optional
            Of each of the two pins: how hard it is in the directions that it holds; rigid if left out.
        wear : optional
            Of each of the two pins: how fast its clearance grows.
        friction : optional
            Of each of the two pins: friction against its motion, which counts where a direction of approach is asked
            for; a number: its coefficient.
        on, bodies, at : optional
            As of `revolute`.
        axis : optional
            With `bodies`: its direction, the same for all.
        side : optional
            With `bodies`: a direction across the axis, the same for all.
        axes : optional
            With `bodies`: directions of the pin in the first and of the pin in the second body.
        position : optional
            As of `revolute`.
        direction : optional
            Deviation of its axis, by the name of the body.
        **places
            Its place on each body, by the name of the body: as in `on`.
        """
        self._joint("universal", locals())

    def planar(
        self,
        name: str,
        /,
        *,
        clearance: PlateClearanceDict | None = None,
        stiffness: PlateStiffnessDict | None = None,
        wear: PlateWearDict | None = None,
        on: Mapping[str, NumbersLike | PlacementDict] | None = None,
        bodies: Sequence[str] | None = None,
        at: NumbersLike | None = None,
        axis: NumbersLike | None = None,
        side: NumbersLike | None = None,
        position: Mapping[str, PositionDict] | None = None,
        direction: Mapping[str, NumberLike | AxisDeviationDict] | None = None,
        **places: NumbersLike | PlacementDict,
    ) -> None:
        """A plate between two planes; its axis is their normal.

        Parameters
        ----------
        name : str
            Its name.
        clearance : optional
            Play built into the joint.
        stiffness : optional
            How hard it is in the directions that it holds; rigid if left out.
        wear : optional
            How fast its clearance grows.
        on, bodies, at : optional
            As of `revolute`.
        axis : optional
            With `bodies`: its direction, the same for all.
        side : optional
            With `bodies`: a direction across the axis, the same for all.
        position : optional
            As of `revolute`.
        direction : optional
            Deviation of its axis, by the name of the body.
        **places
            Its place on each body, by the name of the body: as in `on`.
        """
        self._joint("planar", locals())

    def crossed_gear(
        self,
        name: str,
        /,
        *,
        ratio_error: NumberLike | RatioErrorDict | None = None,
        efficiency: NumberLike | NumbersLike | None = None,
        runout: Mapping[str, NumberLike | RunOutDict] | None = None,
        clearance: FlankClearanceDict | None = None,
        stiffness: FlankStiffnessDict | None = None,
        teeth: Sequence[Count] | None = None,
        radii: NumbersLike | None = None,
        hand: Literal["right", "left"] | None = None,
        spiral_angle: NumberLike | None = None,
        pressure_angle: NumberLike | None = None,
        marks: Mapping[str, NumbersLike] | None = None,
        friction: NumberLike | ToothFrictionDict | None = None,
        on: Mapping[str, NumbersLike | PlacementDict] | None = None,
        bodies: Sequence[str] | None = None,
        at: RowsLike | None = None,
        axis: NumbersLike | None = None,
        side: NumbersLike | None = None,
        axes: RowsLike | None = None,
        position: Mapping[str, PositionDict] | None = None,
        direction: Mapping[str, NumberLike | AxisDeviationDict] | None = None,
        **places: NumbersLike | PlacementDict,
    ) -> None:
        """Two toothed wheels whose axes cross or intersect: worm and wheel, crossed helical, bevel or hypoid gears.

        Parameters
        ----------
        name : str
            Its name.
        ratio_error : optional
            Transmission error, a length at the pitch circle (of crossed gears that of the second wheel, of a screw
            along its axis).
        efficiency : optional
            Power out over power in, which counts where a direction of approach is asked for; of a pair the first where
            the first body drives, of a screw where its turning drives.
        runout : optional
            Eccentricity of its wheels, by the name of the body.
        clearance : optional
            Play built into the joint.
        stiffness : optional
            How hard it is in the directions that it holds; rigid if left out.
        teeth : optional
            Tooth counts of the wheels on the first and on the second body; of a worm its threads.
        radii : optional
            Radii of both pitch circles, which touch each other.
        hand : optional
            Hand of the teeth or threads of the first wheel; straight teeth have none.
        spiral_angle : optional
            Only where the axes intersect: angle from straight teeth at the pitch point.
        pressure_angle : optional
            Pressure angle in the section across the teeth, at most 45 degrees; 20 if left out.
        marks : optional
            Direction from each centre to the pitch point in the axes of each body, where the teeth mesh; as in the
            start if left out.
        friction : optional
            Of teeth that slide where the pitch circles touch, as those of worms do: friction against its motion, which
            counts where a direction of approach is asked for; a number: its coefficient.
        on, bodies : optional
            As of `revolute`.
        at : optional
            With `bodies`: the joint's point on each of the two, as drawn.
        axis : optional
            With `bodies`: its direction, the same for all.
        side : optional
            With `bodies`: a direction across the axis, the same for all.
        axes : optional
            With `bodies`: directions of the axes of the first and of the second wheel.
        position : optional
            As of `revolute`.
        direction : optional
            Deviation of its axis, by the name of the body.
        **places
            Its place on each body, by the name of the body: as in `on`.
        """
        self._joint("crossed_gear", locals())

    def screw(
        self,
        name: str,
        /,
        *,
        ratio_error: NumberLike | RatioErrorDict | None = None,
        efficiency: NumberLike | NumbersLike | None = None,
        clearance: ScrewClearanceDict | None = None,
        stiffness: JournalStiffnessDict | None = None,
        lead: NumberLike | None = None,
        friction: NumberLike | ThreadFrictionDict | None = None,
        on: Mapping[str, NumbersLike | PlacementDict] | None = None,
        bodies: Sequence[str] | None = None,
        at: NumbersLike | None = None,
        axis: NumbersLike | None = None,
        side: NumbersLike | None = None,
        position: Mapping[str, PositionDict] | None = None,
        direction: Mapping[str, NumberLike | AxisDeviationDict] | None = None,
        **places: NumbersLike | PlacementDict,
    ) -> None:
        """A screw in a nut, which the first body carries or is.

        Parameters
        ----------
        name : str
            Its name.
        ratio_error : optional
            Transmission error, a length at the pitch circle (of crossed gears that of the second wheel, of a screw
            along its axis).
        efficiency : optional
            Power out over power in, which counts where a direction of approach is asked for; of a pair the first where
            the first body drives, of a screw where its turning drives.
        clearance : optional
            Play built into the joint.
        stiffness : optional
            How hard it is in the directions that it holds; rigid if left out.
        lead : optional
            Travel of the second body along the axis for one turn; negative for a left-hand one.
        friction : optional
            Of its thread: friction against its motion, which counts where a direction of approach is asked for; a
            number: its coefficient.
        on, bodies, at : optional
            As of `revolute`.
        axis : optional
            With `bodies`: its direction, the same for all.
        side : optional
            With `bodies`: a direction across the axis, the same for all.
        position : optional
            As of `revolute`.
        direction : optional
            Deviation of its axis, by the name of the body.
        **places
            Its place on each body, by the name of the body: as in `on`.
        """
        self._joint("screw", locals())

    def body(
        self,
        body: str,
        /,
        *,
        mass: NumberLike | None = None,
        centre: NumbersLike | None = None,
        rotational_inertia: NumberLike | NumbersLike | None = None,
        expansion: NumberLike | None = None,
        stiffness: NumberLike | None = None,
        E: NumberLike | None = None,
        area: NumberLike | None = None,
        inertia: NumberLike | NumbersLike | None = None,
        outline: Sequence[RowsLike] | None = None,
        G: NumberLike | None = None,
        torsion: NumberLike | None = None,
        side: NumbersLike | None = None,
    ) -> None:
        """Mass of a body, for its weight and its inertia, and what makes it elastic.

        Parameters
        ----------
        body : str
            Name of the body.
        mass : optional
            Mass in kg.
        centre : optional
            Centre of mass in body axes.
        rotational_inertia : optional
            Moment of inertia about the centre of mass, kg times length squared; acts with a speed; in space: [Ixx, Iyy,
            Izz] or [Ixx, Iyy, Izz, Ixy, Ixz, Iyz], the entries of the inertia matrix about the centre of mass in body
            axes, kg times length squared; acts with a speed.
        expansion : optional
            Coefficient of thermal expansion, 1/K; the one of the whole file if left out.
        stiffness : optional
            Axial stiffness of the whole member between its outermost joints, force per length.
        E : optional
            Modulus of elasticity, force per length squared.
        area : optional
            Area of the section: with E it can be stretched.
        inertia : optional
            Second moment of area of the section: with E it can be bent; in space: second moment of area; two of them
            for bending about `side` and about the direction across.
        outline : optional
            What drawings show of it: closed lines, of holes too, each a list of corners in body axes (in the plane
            only).
        G : optional
            Shear modulus, force per length squared (in space only).
        torsion : optional
            Torsion constant of the section (round: its polar moment): with G it can be twisted (in space only).
        side : optional
            Direction across the member, in body axes, to which its two inertias refer (in space only).
        """
        self._named("bodies", locals())

    def start(
        self,
        body: str,
        /,
        *,
        x: NumberLike | None = None,
        y: NumberLike | None = None,
        angle: NumberLike | None = None,
        z: NumberLike | None = None,
        rotation: NumbersLike | None = None,
    ) -> None:
        """Roughly where a body is. What is left out follows from the joints; it need not be exact.

        Parameters
        ----------
        body : str
            Name of the body.
        x, y : optional
            Position of the body's origin in ground axes.
        angle : optional
            Angle of the body's axes in ground axes (in the plane only).
        z : optional
            Position of the body's origin in ground axes (in space only).
        rotation : optional
            Rotation vector of the body's axes in ground axes: along the axis, as long as the angle (in space only).
        """
        self._named("start", locals())

    def drive(
        self,
        name: str,
        /,
        *,
        joint: str | None = None,
        joints: Mapping[str, NumberLike] | None = None,
        values: NumbersLike | None = None,
        csv: str | None = None,
        column: str | None = None,
        from_: NumberLike | None = None,
        to: NumberLike | None = None,
        count: Count | None = None,
        error: NumberLike | ToleranceDict | None = None,
        deviation: NumberLike | None = None,
        law: Literal["normal", "uniform", "triangular"] | LawDict | None = None,
        backlash: NumberLike | Mapping[str, NumberLike | BacklashDict] | BacklashDict | None = None,
        backlash_law: Literal["uniform", "boundary", "normal"] | None = None,
        stiffness: NumberLike | Mapping[str, NumberLike] | None = None,
        speed: NumberLike | NumbersLike | None = None,
        acceleration: NumberLike | NumbersLike | None = None,
        motion: Literal["trapezoid", "cycloidal", "poly5"] | None = None,
        duration: NumberLike | None = None,
        ramp: NumberLike | None = None,
        times: NumbersLike | None = None,
        time: str | None = None,
        rotor_inertia: NumberLike | None = None,
    ) -> None:
        """A joint coordinate that is commanded: the angle of a revolute joint, the distance along a guide or slot.

        Parameters
        ----------
        name : str
            Its name.
        joint : optional
            The joint whose coordinate it commands.
        joints : optional
            Instead of `joint`: several joints that one motor moves, each with the motion of its coordinate per motion
            of the motor.
        values : optional
            The commanded values, one per configuration.
        csv : optional
            Instead: file in the same folder with the values.
        column : optional
            With csv: the name of the column in its first row; that of the drive if left out.
        from_ : optional
            First of equally spaced values.
        to : optional
            Last of equally spaced values.
        count : optional
            How many equally spaced values.
        error : optional
            How far the drive may be off its command.
        deviation : optional
            The known error of its zero in one built specimen: actual minus commanded value.
        law : optional
            How it scatters: uniform if left out; see tolerances.
        backlash : optional
            Lost motion of the joint that it drives, from flank to flank, where the load decides: half of it to either
            side of the command, or { plus, minus }; with `joints` a table by joint.
        backlash_law : optional
            How it lies in its backlash in random specimens: uniform, boundary (on a flank), normal.
        stiffness : optional
            Force per length, or moment per angle in the file's units, by which it winds up beside its backlash; rigid
            if left out; with `joints` a table by joint.
        speed : optional
            How fast the value changes, per second (see units.turning_speed), or one per configuration: bodies with a
            mass then load the joints by their inertia; at rest if left out.
        acceleration : optional
            With speed: how fast that changes, in units.length or units.angle per second squared, or one per
            configuration.
        motion : optional
            With from, to and count: the law by which it goes there, from rest to rest, at equally spaced times:
            trapezoid (of speed), cycloidal, poly5 (polynomial of degree 5).
        duration : optional
            With motion: how long it takes, in seconds.
        ramp : optional
            With a trapezoid: the share of the duration for gaining speed, as for losing it; 0.25 if left out.
        times : optional
            With values: when it has them, in seconds; speeds are those of a spline of degree 5.
        time : optional
            With csv: the name of the column that has these times, in s or, as its unit says, in ms.
        rotor_inertia : optional
            Inertia of the motor, reduced to the value: kg times length squared of an angle, kg of a length; it takes
            part of the motor's moment.
        """
        self._named("drives", locals())

    def follower(
        self,
        name: str,
        /,
        *,
        joint: str | None = None,
        follows: str | None = None,
        polynomial: NumbersLike | None = None,
        origin: NumberLike | None = None,
        at: NumbersLike | None = None,
        values: NumbersLike | None = None,
        csv: str | None = None,
        columns: Sequence[str] | None = None,
        ends: Literal["natural", "clamped", "periodic"] | None = None,
        backlash: NumberLike | BacklashDict | None = None,
        backlash_law: Literal["uniform", "boundary", "normal"] | None = None,
        error: NumberLike | ToleranceDict | None = None,
        deviation: NumberLike | None = None,
        law: Literal["normal", "uniform", "triangular"] | LawDict | None = None,
        stiffness: NumberLike | None = None,
    ) -> None:
        """A joint coordinate that depends on that of another joint, as a cam makes it whose shape is not modelled.

        Parameters
        ----------
        name : str
            Its name.
        joint : optional
            The joint whose coordinate follows.
        follows : optional
            The joint whose coordinate it depends on.
        polynomial : optional
            Coefficients of the powers of the leading coordinate, from the constant on, in file units.
        origin : optional
            Of a polynomial: the leading coordinate from which its powers count; an angle counts within half a turn of
            it.
        at : optional
            Instead: values of the leading coordinate, rising.
        values : optional
            With `at`: the following coordinate there; between them a cubic spline.
        csv : optional
            Instead: file in the same folder with both.
        columns : optional
            With csv: names of the columns of the leading and of the following coordinate.
        ends : optional
            Of a table: without curvature (natural), without slope (clamped), or the same after a full turn of the
            leading joint (periodic).
        backlash : optional
            Lost motion of the following coordinate, from flank to flank, where the load decides: half to either side,
            or { plus, minus }.
        backlash_law : optional
            How it lies in its backlash in random specimens: uniform, boundary (on a flank), normal.
        error : optional
            How far the following coordinate may be off.
        deviation : optional
            The known error of the following coordinate in one built specimen.
        law : optional
            How it scatters: uniform if left out.
        stiffness : optional
            Force per length, or moment per angle, by which the following coordinate gives way.
        """
        self._named("followers", locals())

    def dimension(
        self,
        name: str,
        /,
        *,
        tolerance: NumberLike | ToleranceDict | None = None,
        deviation: NumberLike | None = None,
        law: Literal["normal", "uniform", "triangular"] | LawDict | None = None,
        body: str | None = None,
        between: Sequence[str] | None = None,
    ) -> None:
        """A named distance on one body; the second of the two points moves with its error.

        Parameters
        ----------
        name : str
            Its name.
        tolerance : optional
            How far it may be off.
        deviation : optional
            The known error of one built specimen.
        law : optional
            Normal (three sigma at the limits, default), uniform or triangular; or a table such as { pert = 0.01 }, {
            normal = { cpk = 1.33, shift = 0.5 } } or { csv = 'lot.csv', column = 'd' }.
        body : optional
            The body that has the distance.
        between : optional
            Two joints on the body, or "output"; the second point moves.
        """
        self._named("dimensions", locals())

    def link(
        self,
        name: str,
        /,
        *,
        body: str | None = None,
        between: Sequence[str] | None = None,
        x: NumberLike | ComponentDeviationDict | None = None,
        y: NumberLike | ComponentDeviationDict | None = None,
        angle: NumberLike | ComponentDeviationDict | None = None,
        z: NumberLike | ComponentDeviationDict | None = None,
        rx: NumberLike | ComponentDeviationDict | None = None,
        ry: NumberLike | ComponentDeviationDict | None = None,
        rz: NumberLike | ComponentDeviationDict | None = None,
        a: NumberLike | ComponentDeviationDict | None = None,
        alpha: NumberLike | ComponentDeviationDict | None = None,
        d: NumberLike | ComponentDeviationDict | None = None,
        theta: NumberLike | ComponentDeviationDict | None = None,
    ) -> None:
        """How far one joint of a body is from its place against another one.

        Parameters
        ----------
        name : str
            Its name.
        body : optional
            The body that has both joints.
        between : optional
            Two joints on the body; the second is displaced, or the "output".
        x : optional
            Deviation along the x axis of the body.
        y : optional
            Deviation along the y axis of the body.
        angle : optional
            Deviation of the angle (in the plane only).
        z : optional
            Deviation along the z axis of the body (in space only).
        rx : optional
            X of the rotation vector of the second joint, body axes (in space only).
        ry : optional
            Y of the rotation vector of the second joint, body axes (in space only).
        rz : optional
            Z of the rotation vector of the second joint, body axes (in space only).
        a : optional
            Denavit-Hartenberg: deviation along the common normal of the axes (in space only).
        alpha : optional
            Denavit-Hartenberg: deviation of the angle about the common normal (in space only).
        d : optional
            Denavit-Hartenberg: deviation along the axis of the first joint (in space only).
        theta : optional
            Denavit-Hartenberg: deviation of the angle about that axis (in space only).
        """
        self._named("links", locals())

    def spring(
        self,
        name: str,
        /,
        *,
        on: Mapping[str, str | NumbersLike] | None = None,
        joint: str | None = None,
        stiffness: NumberLike | None = None,
        free_length: NumberLike | None = None,
        free_angle: NumberLike | None = None,
        preload: NumberLike | None = None,
        **places: NumbersLike | str,
    ) -> None:
        """A spring: its force follows from the pose.

        Parameters
        ----------
        name : str
            Its name.
        on : optional
            Its two bodies, and where it is fixed on each: [x, y] in body axes, or a joint on the body; in space: its
            two bodies, and where it is fixed on each: [x, y, z] in body axes, or a joint on the body.
        joint : optional
            Instead of `on`: the joint about which a torsion spring acts, one whose coordinate is an angle.
        stiffness : optional
            Force per length; of a torsion spring moment per angle.
        free_length : optional
            Distance of its ends at which its tension is the preload.
        free_angle : optional
            Of a torsion spring: the joint's coordinate at which its moment is the preload; 0 if left out.
        preload : optional
            Tension at the free length, negative for a push; of a torsion spring moment at the free angle.
        **places
            Its place on each body, by the name of the body: as in `on`.
        """
        self._named("springs", locals())


class Whole(Parts):
    """What a mechanism has as a whole."""

    def cost(
        self,
        source: str,
        /,
        *,
        model: Literal["reciprocal", "exponential"] | None = None,
        a: NumberLike | None = None,
        b: NumberLike | None = None,
        k: NumberLike | None = None,
        from_: NumberLike | None = None,
        to: NumberLike | None = None,
        choices: Sequence[ChoiceDict] | None = None,
    ) -> None:
        """What a source costs, by its size.

        Parameters
        ----------
        source : str
            Name of the source.
        model : optional
            Reciprocal: a + b / t^k; exponential: a + b exp(-k t); t is the size in the units of the file.
        a : optional
            What it costs in any case; 0 if left out.
        b : optional
            What tightness costs; not negative.
        k : optional
            How fast the cost falls as the size grows; 1 if left out, of a reciprocal cost.
        from_ : optional
            Smallest size that can be made.
        to : optional
            Largest size that is considered.
        choices : optional
            Instead of a model: what can be ordered, with prices.
        """
        self._named("costs", locals())

    def path(
        self,
        *,
        csv: str | None = None,
        x: NumbersLike | None = None,
        y: NumbersLike | None = None,
        angle: NumbersLike | None = None,
        z: NumbersLike | None = None,
        rx: NumbersLike | None = None,
        ry: NumbersLike | None = None,
        rz: NumbersLike | None = None,
    ) -> None:
        """Target values of the output, from which the drives are solved.

        Parameters
        ----------
        csv : optional
            Instead: file in the same folder, whose columns have the names of the components.
        x : optional
            Positions of the output along the ground's x axis.
        y : optional
            Positions of the output along the ground's y axis.
        angle : optional
            Angles of the output body (in the plane only).
        z : optional
            Positions of the output along the ground's z axis (in space only).
        rx : optional
            X of the rotation vector of the output body (in space only).
        ry : optional
            Y of the rotation vector of the output body (in space only).
        rz : optional
            Z of the rotation vector of the output body (in space only).
        """
        self._single("path", locals())

    def assembly(self, *, base: str | None = None, steps: Sequence[Sequence[str]] | None = None) -> None:
        """The order in which a mechanism is assembled.

        Parameters
        ----------
        base : optional
            The body that everything is assembled on, and that errors refer to.
        steps : optional
            The bodies that each step adds; every body is added once.
        """
        self._single("assembly", locals())

    def limits(
        self,
        *,
        position: NumberLike | None = None,
        rotation: NumberLike | None = None,
        x: NumberLike | NumbersLike | BoundsDict | None = None,
        y: NumberLike | NumbersLike | BoundsDict | None = None,
        angle: NumberLike | NumbersLike | BoundsDict | None = None,
        probability: NumberLike | None = None,
        contact: Literal["scattered", "loaded"] | None = None,
        singular_value: NumberLike | None = None,
        drives: Mapping[str, NumbersLike] | None = None,
        joints: Mapping[str, NumbersLike] | None = None,
        drive_torques: Mapping[str, NumberLike | NumbersLike] | None = None,
        reactions: Mapping[str, NumberLike] | None = None,
        z: NumberLike | NumbersLike | BoundsDict | None = None,
        rx: NumberLike | NumbersLike | BoundsDict | None = None,
        ry: NumberLike | NumbersLike | BoundsDict | None = None,
        rz: NumberLike | NumbersLike | BoundsDict | None = None,
    ) -> None:
        """What is acceptable.

        Parameters
        ----------
        position : optional
            Largest acceptable position error.
        rotation : optional
            Largest acceptable rotation error.
        x : optional
            Acceptable error along the ground's x axis: 0.1 for 0.1 to both sides, [-0.05, 0.1], or { high = 0.1 }.
        y : optional
            Acceptable error along the ground's y axis: 0.1 for 0.1 to both sides, [-0.05, 0.1], or { high = 0.1 }.
        angle : optional
            Acceptable error of the angle: a number for both sides, [low, high], or one of them such as { high = 0.1 }
            (in the plane only).
        probability : optional
            Share of the specimens that must keep to the limits in `random`; such as 0.9973.
        contact : optional
            Where clearances are in these specimens: offsets that scatter, or those that the load decides; both count
            where it is left out and there are loads.
        singular_value : optional
            Smallest acceptable singular value of the length-scaled Jacobian.
        drives : optional
            Range of each drive.
        joints : optional
            Range of each joint's coordinate.
        drive_torques : optional
            Acceptable moment or force of each drive in `forces`: 5 for 5 in both directions, or [lowest, highest].
        reactions : optional
            Largest acceptable reaction force at each joint in `forces`.
        z : optional
            Acceptable error along the ground's z axis: 0.1 for 0.1 to both sides, [-0.05, 0.1], or { high = 0.1 } (in
            space only).
        rx : optional
            Acceptable error about the x axis: a number for both sides, [low, high], or one of them such as { high = 0.1
            } (in space only).
        ry : optional
            Acceptable error about the y axis: a number for both sides, [low, high], or one of them such as { high = 0.1
            } (in space only).
        rz : optional
            Acceptable error about the z axis: a number for both sides, [low, high], or one of them such as { high = 0.1
            } (in space only).
        """
        self._single("limits", locals())

    def target(
        self,
        *,
        points: RowsLike | None = None,
        timed: bool | None = None,
        line: LineDict | None = None,
        circle: CircleDict | None = None,
        function: TargetFunctionDict | None = None,
        dwell: TargetDwellDict | None = None,
        tolerance: NumberLike | None = None,
    ) -> None:
        """What the output ought to do ideally: one of points, line, circle, function, dwell.

        Parameters
        ----------
        points : optional
            Positions [x, y] of the output point; in space: positions [x, y, z] of the output point.
        timed : optional
            Of points: whether each belongs to the configuration of its number; if not, the nearest point of the
            polyline through them counts.
        line : optional
            A straight line.
        circle : optional
            A circle.
        function : optional
            A function of the drives.
        dwell : optional
            A coordinate that stays as it is.
        tolerance : optional
            Largest acceptable structural error.
        """
        self._single("target", locals())

    def design(
        self,
        *,
        vary: Mapping[str, NumbersLike | VariationDict] | None = None,
        aim: Literal[
            "worst_position",
            "worst_rotation",
            "loaded_position",
            "loaded_rotation",
            "structural",
            "structural_worst",
            "outside",
            "drive_force",
            "size",
            "cost",
        ]
        | Sequence[
            Literal[
                "worst_position",
                "worst_rotation",
                "loaded_position",
                "loaded_rotation",
                "structural",
                "structural_worst",
                "outside",
                "drive_force",
                "size",
                "cost",
            ]
        ]
        | None = None,
        weights: Mapping[str, NumberLike] | None = None,
        question: Literal["worst", "loaded"] | None = None,
        transmission: Mapping[str, NumberLike] | None = None,
    ) -> None:
        """Which values may be chosen anew, what is to be small, and what has to hold beside the limits.

        Parameters
        ----------
        vary : optional
            Bounds or catalogues by the key of a value, as `--set` takes it, in quotes.
        aim : optional
            What is to be small, at the configuration where it is largest; of two there is a front.
        weights : optional
            Instead of aim: several, each times its weight, whose sum is to be small.
        question : optional
            In which question the limits of the error and of forces have to hold.
        transmission : optional
            Smallest acceptable transmission angle, by joint: between the lines along its two bodies.
        """
        self._single("design", locals())

    def document(
        self,
        *,
        title: str | None = None,
        author: str | None = None,
        revision: str | None = None,
        date: str | None = None,
        checked_by: str | None = None,
        approved_by: str | None = None,
    ) -> None:
        """What reports print in their heads, and whose signatures they ask for; questions do not read it.

        Parameters
        ----------
        title : optional
            Title of the report; that of the mechanism if left out.
        author : optional
            Who wrote it.
        revision : optional
            Its revision, such as B.
        date : optional
            Its date; that of the day if left out.
        checked_by : optional
            Who checked it.
        approved_by : optional
            Who approved it.
        """
        self._single("document", locals())

    def output(
        self,
        name: str | None = None,
        /,
        *,
        body: str | None = None,
        at: str | NumbersLike | None = None,
        relative_to: str | None = None,
        limits: ErrorLimitsDict | None = None,
        target: TargetDict | None = None,
        leads: bool | None = None,
    ) -> None:
        """The point whose error is asked, or one of several.

        Parameters
        ----------
        name : str, optional
            Its name where there are several.
        body : optional
            The body that carries the output point.
        at : optional
            The output point: [x, y] in body axes, or a joint on the body; in space: the output point: [x, y, z] in body
            axes, or a joint on the body.
        relative_to : optional
            The body against which the output is measured, in the axes of that body; the ground if left out.
        limits : optional
            Its own limits, in place of those of [limits].
        target : optional
            What it ought to do ideally, see [target].
        leads : optional
            Whether it is the one that [path] and a [grid] of positions speak of.
        """
        self._output(locals())

    def load(
        self,
        case: str | None = None,
        /,
        *,
        body: str | None = None,
        at: str | NumbersLike | None = None,
        axes: str | None = None,
        force: NumbersLike | RowsLike | None = None,
        moment: NumberLike | NumbersLike | RowsLike | None = None,
    ) -> None:
        """A load: dead in ground axes, or a follower in those of a body.

        Parameters
        ----------
        case : str, optional
            The load case in which it acts; in every case if left out. Without anything else, a case without loads of
            its own.
        body : optional
            The loaded body; the output body if left out.
        at : optional
            Where: [x, y] in body axes or a joint on the body; the output point if left out; in space: where: [x, y, z]
            in body axes or a joint on the body; the output point if left out.
        axes : optional
            Axes of force and moment: "ground" (default), "body" for those of the loaded body, with which the load
            turns, or the name of another body.
        force : optional
            Force [fx, fy], or a list of them, one per configuration; in space: force [fx, fy, fz], or a list of them,
            one per configuration.
        moment : optional
            Moment, counter-clockwise, or one per configuration; in space: moment [mx, my, mz], or a list of them, one
            per configuration.
        """
        self._load(case, locals())

    def correlation(
        self, *, sources: Sequence[str] | None = None, rank: NumberLike | None = None, ranks: RowsLike | None = None
    ) -> None:
        """Sources that scatter together, such as three holes of one reamer.

        Parameters
        ----------
        sources : optional
            Names of sizes, dimensions, angles, ratio errors and drive errors.
        rank : optional
            Rank correlation of every two of them.
        ranks : optional
            Instead of rank: the matrix of rank correlations, row by row.
        """
        self._listed("correlations", locals())


class Repeated(Parts):
    """What a pattern has in another way."""

    def limits(
        self, *, drives: Mapping[str, NumbersLike] | None = None, joints: Mapping[str, NumbersLike] | None = None
    ) -> None:
        """Ranges of the drives and joints of a pattern.

        Parameters
        ----------
        drives : optional
            Range of each drive.
        joints : optional
            Range of each joint's coordinate.
        """
        self._single("limits", locals())

    def load(
        self,
        *,
        body: str | None = None,
        at: str | NumbersLike | None = None,
        axes: str | None = None,
        force: NumbersLike | RowsLike | None = None,
        moment: NumberLike | NumbersLike | RowsLike | None = None,
    ) -> None:
        """A load: dead in ground axes, or a follower in those of a body.

        Parameters
        ----------
        body : optional
            The loaded body; the output body if left out.
        at : optional
            Where: [x, y] in body axes or a joint on the body; the output point if left out; in space: where: [x, y, z]
            in body axes or a joint on the body; the output point if left out.
        axes : optional
            Axes of force and moment: "ground" (default), "body" for those of the loaded body, with which the load
            turns, or the name of another body.
        force : optional
            Force [fx, fy], or a list of them, one per configuration; in space: force [fx, fy, fz], or a list of them,
            one per configuration.
        moment : optional
            Moment, counter-clockwise, or one per configuration; in space: moment [mx, my, mz], or a list of them, one
            per configuration.
        """
        self._listed("loads", locals())
