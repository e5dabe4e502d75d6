"""The grid of a map in numbers: which drives or components of the output run over which values, and what is held."""

from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.errors import InputError, listed, not_known
from jointplay.file.schema import GridRange, MechanismFile

from .drives import Commands


@dataclass(frozen=True)
class Grid:
    """Nodes of a map."""

    #: whether it asks for poses of the output, not for values of the drives
    of_output: bool
    #: names of the drives or components along the axes, in the order of the dimensions
    axes: tuple[str, ...]
    #: values along each axis, SI and radians
    values: tuple[Floats, ...]
    #: the same in file units
    labels: tuple[Floats, ...]
    #: the single value of every other drive or asked component, SI and radians
    held: dict[str, float]

    @property
    def shape(self) -> tuple[int, ...]:
        """Nodes along each axis."""
        return tuple(len(values) for values in self.values)


def compile_grid(
    data: MechanismFile, commands: Commands, components: tuple[str, ...], component_factors: Floats, file: str
) -> Grid | None:
    """Check the grid against drives and output and bring it to SI."""
    if data.grid is None:
        return None
    of_output = _of_output(data.grid, commands, components, file)
    names, factors = (components, component_factors) if of_output else (commands.names, commands.factors)
    si = {
        name: np.array(along.nodes) * factors[names.index(name)] for name, along in data.grid.items() if name in names
    }
    axes = tuple(name for name, values in si.items() if len(values) > 1)
    held = {name: float(values[0]) for name, values in si.items() if len(values) == 1}
    if of_output:
        _check_asked(commands, components, axes, held, file)
    else:
        held = _held_drives(data, commands, axes, held, file)
    labels = tuple(np.array(data.grid[name].nodes) for name in axes)
    return Grid(of_output, axes, tuple(si[name] for name in axes), labels, held)


def _of_output(grid: dict[str, GridRange], commands: Commands, components: tuple[str, ...], file: str) -> bool:
    """Whether the grid is one of output positions; a name that drives and components share means the drive."""
    of_drives = [name for name in grid if name in commands.names]
    of_output = [name for name in grid if name in components and name not in commands.names]
    for name in grid:
        if name not in (*of_drives, *of_output):
            known = [*commands.names, *components]
            raise InputError(not_known(name, "a drive or a component of the output", known), file=file, key="grid")
    if of_drives and of_output:
        problem = f"a grid is one of drives ({listed(of_drives)}) or one of the output ({listed(of_output)}), not both"
        raise InputError(problem, file=file, key="grid")
    return bool(of_output)


def _check_asked(
    commands: Commands, components: tuple[str, ...], axes: tuple[str, ...], held: dict[str, float], file: str
) -> None:
    asked, drives = [*axes, *held], len(commands.names)
    if len(asked) != drives:
        count = f"{drives} drive{'s' * (drives != 1)}"
        free = [name for name in components if name not in asked]
        hint = f"; hold others with a number, such as {free[0]} = 0" if len(asked) < drives and free else ""
        problem = (
            f"{listed(asked)}: {count} can bring the output to {drives} asked component{'s' * (drives != 1)}{hint}"
        )
        raise InputError(problem, file=file, key="grid")
    rotations = [name for name in ("rx", "ry", "rz") if name in asked]
    turning = [name for name in rotations if name in axes]
    if turning or len(rotations) not in (0, 3):
        problem = "the attitude of the output is held as a whole: rx, ry and rz are a number each"
        raise InputError(problem, file=file, key=f"grid.{(turning or rotations)[0]}")


def _held_drives(
    data: MechanismFile, commands: Commands, axes: tuple[str, ...], held: dict[str, float], file: str
) -> dict[str, float]:
    """The value of every drive that is not an axis: of the grid, else the single one of the file."""
    found = dict(held)
    for name, factor in zip(commands.names, commands.factors, strict=True):
        if name in axes or name in found:
            continue
        values = data.drives[name].commands
        if len(values) != 1:
            problem = f"the grid does not say where drive '{name}' is: give it a range, or a number that holds it"
            raise InputError(problem, file=file, key="grid")
        found[name] = values[0] * float(factor)
    return found
