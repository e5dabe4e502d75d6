"""The compiled core: whole arrays in, dictionaries of whole arrays out; SI units and radians."""

from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__all__ = ["STATUSES", "Mechanism", "cone_programs", "recordings", "simd"]

STATUSES: list[str]

def simd(limit: str | None = None) -> str: ...
def recordings() -> tuple[int, int, int]: ...
def cone_programs(
    question: str,
    blocks: str,
    maps: NDArray[np.float64],
    forces: NDArray[np.float64],
    rights: NDArray[np.float64],
    alone: bool = False,
) -> dict[str, NDArray[Any]]: ...

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
    def assemble(self, drives: NDArray[np.float64]) -> dict[str, Any]: ...
    def regular(self, drives: NDArray[np.float64]) -> bool: ...
    def jacobian(self, poses: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def gaps(self, drives: NDArray[np.float64], poses: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def solve(self, drives: NDArray[np.float64]) -> dict[str, NDArray[Any]]: ...
    def trace(self, drives: NDArray[np.float64]) -> dict[str, NDArray[Any]]: ...
    def trace_grid(
        self,
        shape: list[int],
        drives: NDArray[np.float64],
        seed_nodes: list[int],
        seed_drives: NDArray[np.float64],
        seed_poses: NDArray[np.float64],
        spread: bool = True,
    ) -> dict[str, NDArray[Any]]: ...
    def drive_values(self, poses: NDArray[np.float64], near: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def measure(self, drives: NDArray[np.float64], poses: NDArray[np.float64]) -> dict[str, NDArray[Any]]: ...
    def inverse(
        self, targets: NDArray[np.float64], weights: NDArray[np.float64], drives0: NDArray[np.float64]
    ) -> dict[str, NDArray[Any]]: ...
    def given(
        self, drives: NDArray[np.float64], poses: NDArray[np.float64], u: NDArray[np.float64]
    ) -> dict[str, NDArray[Any]]: ...
    def sensitivity(self, drives: NDArray[np.float64], poses: NDArray[np.float64]) -> dict[str, NDArray[Any]]: ...
    def loaded(
        self,
        drives: NDArray[np.float64],
        poses: NDArray[np.float64],
        exact: bool = True,
        offset: bool = True,
        details: bool = True,
        partly: bool = False,
    ) -> dict[str, NDArray[Any]]: ...
    def loaded_along(
        self, drives: NDArray[np.float64], exact: bool = True, offset: bool = True, details: bool = True
    ) -> dict[str, NDArray[Any]]: ...
    def loaded_specimens(
        self, drives: NDArray[np.float64], poses: NDArray[np.float64], u: NDArray[np.float64]
    ) -> dict[str, NDArray[Any]]: ...
    def worst(
        self,
        drives: NDArray[np.float64],
        poses: NDArray[np.float64],
        starts: int = 24,
        lanes: bool = True,
        partly: bool = False,
    ) -> dict[str, NDArray[Any]]: ...
    def specimens(self, samples: int, seed: int, law: str | None = None) -> NDArray[np.float64]: ...
    def tied(self, drives: NDArray[np.float64], poses: NDArray[np.float64]) -> list[int]: ...
    def random(
        self,
        drives: NDArray[np.float64],
        poses: NDArray[np.float64],
        samples: int,
        seed: int,
        probabilities: NDArray[np.float64],
        limit_position: float,
        limit_rotation: float,
        law: str | None = None,
        threads: int = 0,
        keep: bool = False,
        loaded: bool = False,
        partly: bool = False,
    ) -> dict[str, NDArray[Any]]: ...
