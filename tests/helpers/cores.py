"""Long measurements on all cores of the machine, a process for each."""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")

#: of a process among as many as there are cores: threads of the core, of BLAS
ALONE = {"RAYON_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def on_all_cores(function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
    """``function(item)`` for every item, in their order.

    The function is one of a module, and its answers do not depend on the number of threads. Processes begin anew: a
    copy of one with threads would stand still.
    """
    os.environ.update(ALONE)  # what a new process finds before it loads anything
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        yield from pool.map(function, items)
