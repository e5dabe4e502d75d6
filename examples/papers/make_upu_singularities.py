"""Draw where the joints of a 3-UPU lose hold, by the general analysis and by its closed form.

python examples/papers/make_upu_singularities.py --into FOLDER

The general analysis knows nothing of the robot but its file: 13 bodies, a Jacobian of 78 rows. The closed form
is the determinant of the three couples n that the legs hold the platform with,

    det[n1 n2 n3] = (sqrt3 / 2) z (3 D^2 - (3 / 4)(x^2 + y^2)) / product of l sin psi,

D the difference of the radii of base and platform, l the legs' lengths, psi their angles from the pins on the base.
"""

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import jointplay as jp
from into import folder

BASE, PLATFORM, HEIGHT = 300.0, 150.0, 400.0
#: edge of the square that is looked at, and places along it, mm
REACH, COUNT = 400.0, 33
HEADER = "x_mm,y_mm,constraint_singular_value,determinant_of_couples"

Array = NDArray[np.float64]


def places() -> Array:
    """Positions of the platform, row by row, every other row backwards so that neighbours follow one another."""
    line = np.linspace(-REACH, REACH, COUNT)
    rows = [np.column_stack([line[::sign], np.full(COUNT, y)]) for y, sign in zip(line, [1, -1] * COUNT, strict=False)]
    return np.concatenate([np.column_stack([row, np.full(COUNT, HEIGHT)]) for row in rows])


def legs(positions: Array) -> tuple[Array, Array]:
    """Vectors along the legs, [position, leg, 3], and the directions of the pins on the base, [leg, 3]."""
    angles = np.radians([0, 120, 240])
    outwards = np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], axis=-1)
    return positions[:, None] - (BASE - PLATFORM) * outwards, np.cross([0.0, 0.0, 1.0], outwards)


def couples(positions: Array) -> Array:
    """Determinant of the three couples."""
    vectors, pins = legs(positions)
    across = vectors - np.einsum("plc,lc->pl", vectors, pins)[..., None] * pins
    return np.asarray(np.linalg.det(across / np.linalg.norm(across, axis=-1, keepdims=True)))


def general(positions: Array) -> Array:
    """Constraint singular values by the general analysis."""
    lengths = np.linalg.norm(legs(positions)[0], axis=-1)
    drives = {f"drives.l{k + 1}.values": lengths[:, k] for k in range(3)}
    result = jp.singularities(jp.loads(jp.examples.text("3-upu")).with_({"path": None} | drives), path=False)
    reached = result.nominal.sel(component=["x", "y", "z"]).values
    if not np.allclose(reached, positions, rtol=0, atol=1e-3):
        raise RuntimeError("the robot has left its translational mode")
    return np.asarray(result.constraint_singular_value)


def numbers() -> str:
    """What is drawn, as a table."""
    positions = places()
    columns = np.column_stack([positions[:, :2], general(positions), couples(positions)])
    stream = io.StringIO()
    np.savetxt(stream, columns, fmt=["%g", "%g", "%.5f", "%.5f"], delimiter=",", header=HEADER, comments="")
    # What rounds to zero has no sign.
    return stream.getvalue().replace("-0.00000", "0.00000")


def table(text: str) -> Array:
    """The numbers of a table."""
    return np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1)


def draw(rows: Array, path: Path) -> None:
    """Both maps side by side, with the circle of the closed form in each."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    mpl.rcParams["svg.hashsalt"] = "jointplay"
    order = np.lexsort((rows[:, 0], rows[:, 1]))
    x, y, value, determinant = rows[order].T.reshape(4, COUNT, COUNT)
    figure = Figure(figsize=(10, 4.4), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    circle = np.linspace(0, 2 * np.pi, 181)
    for ax, field, title in (
        (axes[0], value, "general analysis: constraint singular value"),
        (axes[1], np.abs(determinant), "closed form: |det[n1 n2 n3]|"),
    ):
        drawn = ax.contourf(x, y, field, levels=16, cmap="viridis")
        radius = 2 * (BASE - PLATFORM)
        ax.plot(radius * np.cos(circle), radius * np.sin(circle), "w--", linewidth=1.2)
        ax.set(title=title, xlabel="x of the platform, mm", aspect="equal")
        figure.colorbar(drawn, ax=ax, shrink=0.9)
    axes[0].set_ylabel("y of the platform, mm")
    figure.savefig(path, metadata={"Date": None})


def main() -> None:
    """Entry point."""
    place, text = folder("Draw the singularities of a 3-UPU."), numbers()
    (place / "upu-singularities.csv").write_text(text, encoding="utf-8")
    draw(table(text), place / "img" / "upu-singularities.svg")


if __name__ == "__main__":
    main()
