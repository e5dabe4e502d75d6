"""Examples that are written from a few sizes: the values they take, and how numbers stand in their files."""

import math
from collections.abc import Mapping
from dataclasses import Field, dataclass, fields
from typing import Any, ClassVar, Self

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.errors import InputError, not_known, shown


@dataclass(frozen=True)
class Template:
    """The sizes of an example, in mm and degrees. Every field is a value that `--set` gives."""

    name: ClassVar[str]
    #: what a text may be, by field
    words: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    #: fields whose value may be zero
    may_vanish: ClassVar[tuple[str, ...]] = ("radial", "axial", "gap")
    #: fields whose value may be negative as well
    signed: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def sizes(cls) -> tuple[str, ...]:
        """Names of the values that it takes."""
        return tuple(field.name for field in fields(cls))

    @classmethod
    def of(cls, settings: Mapping[str, Any]) -> Self:
        """With these values, and the usual ones for the others.

        Raises
        ------
        InputError
            When there is no such value, or a value is of the wrong kind.
        """
        known = {field.name: field for field in fields(cls)}
        for key in settings:
            if key not in known:
                raise InputError(not_known(key, f"a value of {cls.name}", known), file=cls.name)
        return cls(**{key: cls._checked(known[key], value) for key, value in settings.items()})

    @classmethod
    def _checked(cls, field: Field[Any], value: Any) -> Any:
        key = field.name
        if key in cls.words:
            if value not in cls.words[key]:
                raise InputError(not_known(str(value), "known here", cls.words[key]), file=cls.name, key=key)
            return value
        if isinstance(field.default, bool):
            if not isinstance(value, bool):
                raise InputError(f"true or false is needed, not {shown(value)}", file=cls.name, key=key)
            return value
        bound = ", 0 or more," if key in cls.may_vanish else ", more than 0,"
        is_number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        if key in cls.signed:
            bound = ""
        elif is_number and (value < 0 or (value == 0 and key not in cls.may_vanish)):
            is_number = False
        if not is_number:
            raise InputError(f"a number{bound} is needed, not {shown(value)}", file=cls.name, key=key)
        return value

    def refuse(self, key: str, problem: str) -> InputError:
        """The error for sizes that contradict each other."""
        return InputError(problem, file=self.name, key=key)

    def command(self) -> str:
        """Comment lines with the command that writes this file."""
        values = {key: getattr(self, key) for key in self.sizes()}
        words = [f"--set {key}={str(v).lower() if isinstance(v, bool) else v}" for key, v in values.items()]
        lines = [f"#   jointplay new {self.name}"]
        for word in words:
            if len(lines[-1]) + len(word) > 108:
                lines[-1] += " \\"
                lines.append("#      ")
            lines[-1] += f" {word}"
        return "\n".join(lines)

    def text(self) -> str:
        """The file."""
        raise NotImplementedError


def around(angle: float) -> tuple[Floats, Floats]:
    """Unit vectors away from the z axis and along the circle around it, at an angle in degrees."""
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    return np.array([c, s, 0.0]), np.array([-s, c, 0.0])
