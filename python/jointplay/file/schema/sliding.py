"""The sizes of what slides in a joint: its own, or those that the clearance gives."""

from typing import Any, ClassVar

from .clearances import SizedClearance
from .values import Table, problem


class SlidingKeys(Table):
    """What is said of faces that slide on each other."""

    #: sizes that are needed, of the faces themselves or of the clearance
    needed: ClassVar[tuple[str, ...]] = ()

    def size(self, play: Any, key: str) -> float | None:
        """A size of what slides: its own, or that of the clearance; None where neither has it.

        Parameters
        ----------
        play : Clearance or None
            That of the joint.
        key : str
            ``diameter``, ``length``, ``width`` or ``height``.
        """
        found = getattr(self, key, None)
        if found is None and key == "diameter" and isinstance(play, SizedClearance):
            found = play.nominal_size
        elif found is None:
            found = getattr(play, key, None)
        return None if found is None else float(found)

    def require(self, play: Any, what: str, needs: str) -> None:
        """Refuse what lacks a size.

        Parameters
        ----------
        play : Clearance or None
            That of the joint.
        what, needs : str
            What is said, and what needs the sizes.

        Raises
        ------
        ValueError
            When a size is missing.
        """
        for key in self.needed:
            if self.size(play, key) is None:
                meaning = type(self).model_fields[key].description
                raise problem(f"{what}: '{key}' is missing ({meaning}), which {needs} needs")
