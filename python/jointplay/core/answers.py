"""What the core answers: arrays by name, first dimension the configuration; SI units and radians.

The columns are declared in the core (`_core.COLUMNS`); these are their names and types for the type checker.
`NotRequired` are those that not every mechanism has, or that are only given on request.
"""

from typing import NotRequired, TypedDict

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Codes, Flags, Floats

Counts = NDArray[np.uint64]


class Assembled(TypedDict):
    """The nominal mechanism, put together from its guess: one pose of all bodies."""

    poses: Floats
    residual: float
    converged: bool


class Traced(TypedDict):
    """Nominal poses alone."""

    poses: Floats
    output: Floats
    status: Codes


class TracedGrid(Traced):
    """Nominal poses of a grid, and where ways to next nodes and from seeds end, at a singular pose or anywhere."""

    crossing: Floats
    seed_crossing: Floats
    seed_end: Floats


class Measured(TypedDict):
    """How near nominal configurations are to a singular one."""

    singular_value: Floats
    singular_motion: Floats


class Reached(Traced):
    """Nominal configurations at targets of the output."""

    drives: Floats
    mismatch: Floats


class Moving(TypedDict):
    """How all bodies move at the core's origins: velocities with angular ones, and their derivatives by time."""

    velocity: Floats
    acceleration: Floats
    status: Codes


class Nearness(TypedDict):
    """Nearness to singularities; motions and twists are length-scaled, their largest part one."""

    values: NotRequired[Floats]
    motions: NotRequired[Floats]
    twists: NotRequired[Floats]
    closure: Floats
    sign: Floats


class EquilibriumTerms(TypedDict):
    """What equilibrium is made of at given poses."""

    #: closure Jacobian, shape (configuration, row, unknown)
    jacobian: Floats
    #: what loads and springs do along the twists of all bodies
    loads: Floats
    #: of both points of every joint, from the core's origin of the body, ground axes
    levers: Floats
    #: of every joint its axes as the first body carries them, ground axes
    axes: Floats


class Given(TypedDict):
    """Poses for given offsets and deviations."""

    error: Floats
    error_first_order: Floats
    poses: Floats
    residual: Floats
    status: Codes
    # over-constrained
    prestress: NotRequired[Floats]
    deformation: NotRequired[Floats]
    lack_of_fit: NotRequired[Floats]


class Sensitivity(TypedDict):
    """First-order maps."""

    source: Floats
    drive: Floats
    status: Codes


class Jacobians(TypedDict):
    """Derivatives of the output's pose where the loads deform the nominal one, clearances held."""

    error: Floats
    parameter: Floats
    drive: Floats
    load: Floats
    compliance: Floats
    defined: Flags
    status: Codes


class Loaded(TypedDict):
    """Where the load pushes every joint."""

    error: Floats
    undetermined: Floats
    iterations: Counts
    equilibria: Counts
    status: Codes
    fallbacks: int
    # on request
    offset: NotRequired[Floats]
    error_first_order: NotRequired[Floats]
    undetermined_contribution: NotRequired[Floats]
    decided: NotRequired[Flags]
    reaction: NotRequired[Floats]
    drive_force: NotRequired[Floats]
    contribution: NotRequired[Floats]
    # over-constrained
    clearance_factor: NotRequired[Floats]
    prestress: NotRequired[Floats]
    force: NotRequired[Floats]
    deformation: NotRequired[Floats]
    contribution_elastic: NotRequired[Floats]
    gap: NotRequired[Floats]
    lack_of_fit: NotRequired[Floats]


class LoadedSpecimens(TypedDict):
    """Specimens under load in one configuration; first dimension the specimen."""

    clearance_factor: Floats
    poses: Floats
    force: Floats
    reaction: Floats
    offset: Floats
    status: Codes


class Worst(TypedDict):
    """The largest errors."""

    position: Floats
    position_first_order: Floats
    position_bound: Floats
    rotation: Floats
    rotation_first_order: Floats
    rotation_bound: Floats
    component: Floats
    component_first_order: Floats
    direction: Floats
    rotation_direction: Floats
    offset: Floats
    contribution: Floats
    contribution_elastic: Floats
    fallbacks: Counts
    unsettled: Counts
    status: Codes


class Certificate(TypedDict):
    """What the largest errors certainly do not exceed."""

    position: Floats
    rotation: Floats
    component: Floats
    assembled: Flags
    parts: Counts
    reason: Counts


class Region(TypedDict):
    """The region of the output point's error."""

    extent: Floats
    extent_first_order: Floats
    error: Floats
    unsettled: Counts
    status: Codes


class Random(TypedDict):
    """Scatter from specimen to specimen."""

    mean: Floats
    mean_standard_error: Floats
    std_standard_error: Floats
    covariance: Floats
    mean_first_order: Floats
    covariance_first_order: Floats
    contribution: Floats
    quantile: Floats
    quantile_standard_error: Floats
    quantile_resolution: Floats
    histogram: Counts
    edges: Floats
    outside: Floats
    outside_standard_error: Floats
    outside_quantity: Floats
    outside_quantity_standard_error: Floats
    largest: Floats
    failures: Counts
    fallbacks: Counts
    interference: Floats
    status: Codes
    # over-constrained, or under load
    clearance_factor: NotRequired[Floats]
    force: NotRequired[Floats]
    contribution_elastic: NotRequired[Floats]
    # on request; first dimension the sample
    kept_parameters: NotRequired[Floats]
    kept_errors: NotRequired[Floats]
    kept_status: NotRequired[Codes]


class Cones(TypedDict):
    """Answers of cone programs; first dimension the program."""

    outcome: Codes
    displacements: Floats
    multipliers: Floats
    factor: Floats
    value: Floats
    dual_value: Floats
    gap: Floats
    alone: Counts
    compared: Counts
    difference: Floats
