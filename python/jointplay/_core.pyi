"""The compiled core: whole arrays in, dictionaries of whole arrays out; SI units and radians."""

from typing import final

from jointplay.answers import (
    Assembled,
    Cones,
    Floats,
    Given,
    Loaded,
    LoadedSpecimens,
    Nearness,
    Random,
    Reached,
    Sensitivity,
    Solved,
    Traced,
    Worst,
)

__all__ = ["COLUMNS", "STATUSES", "Mechanism", "cone_programs", "recordings", "simd"]

STATUSES: list[str]
#: of every question the columns: element, and dimensions beside the configuration
COLUMNS: dict[str, dict[str, tuple[str, list[str]]]]

def simd(limit: str | None = None) -> str: ...
def recordings() -> tuple[int, int, int]: ...
def cone_programs(
    question: str, blocks: str, maps: Floats, forces: Floats, rights: Floats, alone: bool = False
) -> Cones: ...

@final
class Mechanism:
    """A checked, immutable mechanism."""

    def __new__(cls, spec: str) -> Mechanism: ...
    @property
    def parameters(self) -> list[tuple[int, str]]: ...
    @property
    def rows(self) -> list[tuple[int, str]]: ...
    @property
    def elastic_rows(self) -> list[tuple[int, str]]: ...
    @property
    def deformations(self) -> list[tuple[int, str]]: ...
    @property
    def isostatic(self) -> bool: ...
    def assemble(self, drives: Floats) -> Assembled: ...
    def regular(self, drives: Floats) -> bool: ...
    def jacobian(self, poses: Floats) -> Floats: ...
    def gaps(self, drives: Floats, poses: Floats) -> Floats: ...
    def nearness(self, poses: Floats, length: float, components: list[int], details: bool = True) -> Nearness: ...
    def solve(self, drives: Floats) -> Solved: ...
    def trace(self, drives: Floats, start: Floats | None = None) -> Traced: ...
    def trace_grid(
        self,
        shape: list[int],
        drives: Floats,
        seed_nodes: list[int],
        seed_drives: Floats,
        seed_poses: Floats,
        spread: bool = True,
    ) -> Traced: ...
    def drive_values(self, poses: Floats, near: Floats) -> Floats: ...
    def output(self, poses: Floats) -> Floats: ...
    def measure(self, drives: Floats, poses: Floats) -> Solved: ...
    def inverse(self, targets: Floats, weights: Floats, drives0: Floats) -> Reached: ...
    def given(self, drives: Floats, poses: Floats, u: Floats) -> Given: ...
    def sensitivity(self, drives: Floats, poses: Floats) -> Sensitivity: ...
    def loaded(
        self,
        drives: Floats,
        poses: Floats,
        exact: bool = True,
        offset: bool = True,
        details: bool = True,
        partly: bool = False,
    ) -> Loaded: ...
    def loaded_along(self, drives: Floats, exact: bool = True, offset: bool = True, details: bool = True) -> Loaded: ...
    def loaded_specimens(self, drives: Floats, poses: Floats, u: Floats) -> LoadedSpecimens: ...
    def worst(
        self, drives: Floats, poses: Floats, starts: int = 24, lanes: bool = True, partly: bool = False
    ) -> Worst: ...
    def specimens(self, samples: int, seed: int, law: str | None = None) -> Floats: ...
    def tied(self, drives: Floats, poses: Floats) -> list[int]: ...
    def random(
        self,
        drives: Floats,
        poses: Floats,
        samples: int,
        seed: int,
        probabilities: Floats,
        limit_position: float,
        limit_rotation: float,
        law: str | None = None,
        threads: int = 0,
        keep: bool = False,
        loaded: bool = False,
        partly: bool = False,
    ) -> Random: ...
