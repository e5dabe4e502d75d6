"""The four-bar in closed form: in C (closed_form.c, the limit) and with NumPy."""

import ctypes
import os
import shutil
import subprocess
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scatter import BINS, Problem

Array = NDArray[np.float64]
BUILD = Path(__file__).parent.parent / "build" / "benchmarks"
FLAGS = ("-O3", "-march=native", "-ffast-math", "-shared", "-fPIC")


def compiled(source: Path, name: str) -> ctypes.CDLL:
    """Compile C with the machine's own compiler and load it."""
    compiler = os.environ.get("CC", "cc")
    if shutil.which(compiler) is None:
        raise RuntimeError("the benchmarks need a C compiler: cc, or the one that CC names")
    BUILD.mkdir(parents=True, exist_ok=True)
    library = BUILD / f"{name}.so"
    subprocess.run([compiler, *FLAGS, "-o", str(library), str(source), "-lm"], check=True)
    return ctypes.CDLL(str(library))


def pointer(array: NDArray[Any]) -> ctypes.c_void_p:
    """Where a contiguous array stands."""
    return array.ctypes.data_as(ctypes.c_void_p)


#: in the order of the C structure
NUMBERS = (
    *("pivot_x", "pivot_y", "crank", "coupler", "rocker", "cosine", "sine", "side"),
    *("x", "y", "along_x", "along_y", "radius", "tolerance"),
)


class _Linkage(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_double) for name in NUMBERS),
        ("low", ctypes.c_double * 5),
        ("density", ctypes.c_double * 5),
    )


class _Statistics(ctypes.Structure):
    _fields_ = (
        ("count", ctypes.c_double),
        ("failed", ctypes.c_double),
        ("sum", ctypes.c_double * 3),
        ("product", ctypes.c_double * 6),
        ("largest", ctypes.c_double * 5),
        ("bins", ctypes.c_uint64 * (5 * BINS)),
    )


def linkage(p: Problem) -> dict[str, float]:
    """What the closed form needs to know of four-bar.toml, SI units."""
    spec = p.mechanism.spec()
    at = {k: joint["first"] for k, joint in enumerate(spec["joints"])}
    place = np.array([point["at"][:2] for point in spec["points"]])
    rocker_pin = spec["joints"][2]["second"]
    x, y, angle = p.mechanism.core.trace(p.drives)["output"][0]
    pivot = place[at[3]]
    radii = [size for kind, size in p.sets if kind == "disc"]
    crank, coupler = place[at[1]][0], place[at[2]][0]
    end = crank * np.array([np.cos(p.drives[0, 0]), np.sin(p.drives[0, 0])])
    # The rocker's pin lies to the left or to the right of the line from the rocker's pivot to the crank's end.
    (dx, dy), (rx, ry) = end - pivot, np.array([x, y]) - pivot
    return {
        "pivot_x": pivot[0],
        "pivot_y": pivot[1],
        "crank": crank,
        "coupler": coupler,
        "rocker": place[rocker_pin][0],
        "cosine": np.cos(p.drives[0, 0]),
        "sine": np.sin(p.drives[0, 0]),
        "side": float(np.sign(dx * ry - dy * rx)),
        "x": x,
        "y": y,
        "along_x": np.cos(angle),
        "along_y": np.sin(angle),
        "radius": radii[0],
        "tolerance": p.sets[-1][1],
    }


class InC:
    """closed_form.c on one problem."""

    def __init__(self, p: Problem) -> None:
        self._library = compiled(Path(__file__).with_name("closed_form.c"), "closed_form")
        self._linkage = _Linkage(**linkage(p))
        self._linkage.low[:] = p.edges[:, 0]
        self._linkage.density[:] = BINS / (p.edges[:, 1] - p.edges[:, 0])

    def monte_carlo(self, samples: int, phases: int = 3) -> dict[str, Array]:
        """Draw, solve and count, or only the first of these phases."""
        found, numbers = _Statistics(), (ctypes.c_uint64(1), ctypes.c_int64(samples), ctypes.c_int(phases))
        self._library.monte_carlo(ctypes.byref(self._linkage), *numbers, ctypes.byref(found))
        product = np.zeros((3, 3))
        product[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]] = found.product
        return {"sum": np.array(found.sum), "product": product, "bins": np.array(found.bins).reshape(5, BINS)}

    def in_threads(self, samples: int) -> Callable[[int], object]:
        """As many Monte Carlos at a time as there are threads; they share nothing."""

        def run(count: int) -> None:
            threads = [threading.Thread(target=self.monte_carlo, args=(samples,)) for _ in range(count)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()

        return run

    def solve(self, offsets: Array) -> Array:
        """Errors of given offsets."""
        errors = np.empty((len(offsets), 3))
        self._library.solve_given(
            ctypes.byref(self._linkage), ctypes.c_int64(len(offsets)), pointer(offsets), pointer(errors)
        )
        return errors


def in_numpy(p: Problem) -> Callable[[Array], Array]:
    """The same closed form on arrays."""
    n = linkage(p)

    def solve(u: Array) -> Array:
        crank, coupler, rocker = (n[name] + u[:, 8 + k] for k, name in enumerate(("crank", "coupler", "rocker")))
        qx, qy = n["pivot_x"] + u[:, 6], n["pivot_y"] + u[:, 7]
        dx = u[:, 0] + crank * n["cosine"] + u[:, 2] + u[:, 4] - qx
        dy = u[:, 1] + crank * n["sine"] + u[:, 3] + u[:, 5] - qy
        square = dx * dx + dy * dy
        along = 0.5 * (1.0 + (rocker * rocker - coupler * coupler) / square)
        across = n["side"] * np.sqrt(rocker * rocker / square - along * along)
        rx, ry = along * dx - across * dy, along * dy + across * dx
        turned = np.arcsin((n["along_x"] * ry - n["along_y"] * rx) / rocker)
        return np.stack([qx + rx - n["x"], qy + ry - n["y"], turned], axis=1)

    return solve
