"""Mechanisms written in Python: the tables of the file, one call for each entry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

from jointplay.errors import InputError
from jointplay.file import document
from jointplay.model.mechanism import Mechanism, plain

from .entries import Repeated, Whole
from .tables import AboutDict, GridRangeDict, TemperatureDict, UnitsDict
from .values import Count, NumberLike, NumbersLike
from .writing import WrittenTables

#: what stands for the name of a file in messages that no line of the program is to blame for
NAME = "<builder>"


class Pattern(Repeated):
    """A part of a mechanism that is repeated; `Builder.pattern` makes one.

    It has the methods of the builder that write joints, bodies, starts, drives, dimensions, links, springs, loads and
    limits. What they write is there once for every copy, under the name ``NAME_1``, ``NAME_2`` and so on.
    """

    def __init__(self, tables: WrittenTables, name: str) -> None:
        self._tables = tables
        self._above = ("patterns", name)


class Builder(Whole):
    """A mechanism written in Python. It reads like the file, and is checked by the same schema.

    Each method writes one entry of the file, whose keys are its parameters; `from`, which Python keeps for itself, is
    `from_`. A body of a joint is a parameter by its name. A table inside an entry is a ``dict`` with the keys of the
    file, or one of the short forms `radial`, `diametral`, `gap`, `fit`, `bearing` and `backlash`. Numbers and arrays
    of NumPy may stand wherever the file has numbers and lists.

    Parameters
    ----------
    space : {"planar", "spatial"}
        Plane or space.
    units : mapping
        Units of every number, such as ``{"length": "mm", "angle": "deg", "force": "N"}``.
    title : str, optional
        One line that says what the mechanism is.
    gravity : array-like, optional
        Acceleration of gravity in m/s^2, in ground axes.
    temperature : float or mapping, optional
        Difference in kelvin from the temperature at which the lengths hold.
    expansion : float, optional
        Coefficient of thermal expansion in 1/K of every body without its own.
    friction : float, optional
        Coefficient of friction of every joint that names none.

    Examples
    --------
    >>> import jointplay as jp
    >>> b = jp.Builder(space="planar", units={"length": "mm", "angle": "deg", "force": "N"})
    >>> b.revolute("J1", ground=(0, 0), crank=(0, 0), clearance=jp.radial(0.05))
    >>> b.drive("theta", joint="J1", from_=0, to=90, count=4)
    >>> b.output(body="crank", at=(100, 0))
    >>> m = b.mechanism()
    >>> jp.worst(m).worst_position.round(3).values.tolist()
    [0.05, 0.05, 0.05, 0.05]
    """

    def __init__(
        self,
        *,
        space: Literal["planar", "spatial"],
        units: UnitsDict,
        title: str | None = None,
        gravity: NumbersLike | None = None,
        temperature: NumberLike | TemperatureDict | None = None,
        expansion: NumberLike | None = None,
        friction: NumberLike | None = None,
    ) -> None:
        head = {"title": title, "gravity": gravity, "temperature": temperature, "expansion": expansion}
        head["friction"] = friction
        given = {key: value for key, value in head.items() if value is not None}
        self._tables = WrittenTables({"format": 1})
        self._above = ()
        for key, value in {"space": space, "units": units, **given}.items():
            self._tables.put((key,), value)

    def variables(self, **values: NumberLike) -> None:
        """Numbers by name, or expressions, for the expressions that stand where a number may.

        Parameters
        ----------
        **values
            The variables.
        """
        for name, value in values.items():
            self._tables.put(("variables", name), value)

    def grid(self, **axes: NumberLike | NumbersLike | GridRangeDict) -> None:
        """What is mapped: ranges of drives or of components of the output.

        Parameters
        ----------
        **axes
            For each drive or component its values, ``{"from": 0, "to": 90, "count": 10}``, or the number that is held.
        """
        self._tables.put(("grid",), axes)

    def pattern(
        self,
        name: str,
        /,
        *,
        count: Count | None = None,
        about: AboutDict | None = None,
        values: Mapping[str, NumberLike | Sequence[NumberLike] | NumbersLike] | None = None,
        shared: Sequence[str] | None = None,
    ) -> Pattern:
        """A part of the mechanism that is repeated, such as the legs of a platform.

        Parameters
        ----------
        name : str
            Its name.
        count : int, optional
            How many copies there are; as many as `values` has if left out.
        about : mapping, optional
            What the copies are turned about: the same numbers in the axes of the ground and of every shared body.
        values : mapping, optional
            Variables of the pattern: a list with one value for each copy, or an expression for all.
        shared : sequence of str, optional
            Bodies that all copies have in common, beside the ground.

        Returns
        -------
        Pattern
            It has the methods that write what is repeated.
        """
        self._named("patterns", locals())
        return Pattern(self._tables, name)

    def mechanism(self) -> Mechanism:
        """The mechanism of what has been written so far.

        Returns
        -------
        Mechanism
            Immutable: what is written later does not change it.

        Raises
        ------
        InputError
            When it is not a valid mechanism; the message names the line of the program that wrote the entry, its key
            and value, and what would be valid.
        """
        try:
            return Mechanism(self.tables(), NAME)
        except InputError as error:
            raise self._tables.at_its_line(error) from None

    def tables(self) -> dict[str, Any]:
        """What has been written so far, as the file would give it: plain tables, lists and values. A copy.

        Returns
        -------
        dict
            It can be changed, and read by `Mechanism`.
        """
        return dict(plain(self._tables.data))

    def text(self) -> str:
        """What has been written so far, as the text of a file. It need not be a valid mechanism yet.

        Returns
        -------
        str
            TOML.
        """
        return next(document.texts(None, self.tables()))
