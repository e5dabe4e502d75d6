"""W12: a six-axis arm whose drives have play: as lost motion of the drive, and as trains of gears between bodies."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

import jointplay as jp
from harness import Contender, Report, Spread, Target, interleave, number, ratio

CONFIGURATIONS = 9
SPECIMENS = 512
#: axes of the joints, from each to the next (mm), and how far each goes (deg)
AXES = "zyyxyx"
STEPS = np.array([[0, 0, 200], [100, 0, 250], [0, 0, 450], [150, 0, 100], [300, 0, 0], [80, 0, 0]], dtype=float)
FAR = (40.0, 35.0, -30.0, 50.0, 45.0, 60.0)
#: where wheels stand beside a joint
BESIDE = {"x": np.array([0.0, 1.0, 0.0]), "y": np.array([0.0, 0.0, 1.0]), "z": np.array([1.0, 0.0, 0.0])}
#: of the pair at the motor, and of the pair at the joint; the module is 1 mm
TEETH = ((20, 80), (20, 120))
#: masses and gravity such that every torque is decided
HEAD = (
    'format = 1\nspace = "spatial"\nunits = { length = "mm", angle = "deg", force = "N" }\ngravity = [2.0, 3.0, -9.0]'
)


def way(axis: str) -> list[float]:
    """The direction of an axis."""
    return [float(axis == name) for name in "xyz"]


def pin(name: str, first: str, second: str, at: np.ndarray, axis: str) -> str:
    """A pin with play and with a given axis."""
    told = (
        f'[joints.{name}]\ntype = "revolute"\nbodies = ["{first}", "{second}"]\nat = {at.tolist()}\naxis = {way(axis)}'
    )
    return f"{told}\nclearance = {{ radial = 0.005, axial = 0.005, length = 60 }}"


def drive(number: str, joint: str, values: np.ndarray, more: str = "") -> str:
    """A drive with its values."""
    return f'[drives.q{number}]\njoint = "{joint}"\nvalues = {values.round(6).tolist()}\n{more}'


def gear(
    name: str, wheels: tuple[str, str], at: tuple[np.ndarray, np.ndarray], teeth: tuple[int, int], axis: str
) -> str:
    """A pair of wheels with backlash."""
    told = f'[joints.{name}]\ntype = "gear"\nbodies = {list(wheels)}\nat = {[one.tolist() for one in at]}'
    return f"{told}\naxis = {way(axis)}\nteeth = {list(teeth)}\nmodule = 1\nclearance = {{ backlash = 0.05 }}"


def trains(k: int, before: str, at: np.ndarray, values: np.ndarray) -> Iterator[str]:
    """Two pairs of wheels between a motor's shaft and a joint."""
    axis, link = AXES[k], f"link{k}"
    (first, second), (third, fourth) = TEETH
    shaft = at + BESIDE[axis] * (third + fourth) / 2
    rotor = shaft + BESIDE[axis] * (first + second) / 2
    for body, place in ((f"shaft{k}", shaft), (f"rotor{k}", rotor)):
        yield f"{pin(f'of_{body}', before, body, place, axis)}\n[bodies.{body}]\nmass = 0.5"
    yield gear(f"A{k}", (f"rotor{k}", f"shaft{k}"), (rotor, shaft), (first, second), axis)
    yield gear(f"B{k}", (f"shaft{k}", link), (shaft, at), (third, fourth), axis)
    yield drive(str(k), f"of_rotor{k}", values * second / first * fourth / third)


def serial(k: int, at: np.ndarray) -> Iterator[str]:
    """Two more links behind a joint, with a drive each."""
    for which, axis in ((1, {"x": "y", "y": "x", "z": "x"}[AXES[k]]), (2, AXES[k])):
        own, before = f"link{k}_{which}", f"link{k}" if which == 1 else f"link{k}_1"
        yield f"{pin(f'of_{own}', before, own, at + 3.0 * which, axis)}\n[bodies.{own}]\nmass = 0.5"
        yield drive(f"{k}_{which}", f"of_{own}", np.zeros(CONFIGURATIONS))


def arm(kind: str) -> jp.Mechanism:
    """The arm: plain, with lost motion, with two pairs of gears a joint, or with as many bodies in a row."""
    parts, at, before = [HEAD], np.zeros(3), "ground"
    for k, step in enumerate(STEPS):
        at, link = at + step, f"link{k}"
        centre = (STEPS[min(k + 1, 5)] / 2 + 7.0).tolist()
        parts += [
            pin(f"J{k}", before, link, at, AXES[k]),
            f"[bodies.{link}]\nmass = {3 - 0.4 * k:g}\ncentre = {centre}",
        ]
        values = np.linspace(0.3 * FAR[k], FAR[k], CONFIGURATIONS)
        if kind == "gears":
            parts += trains(k, before, at, values)
        else:
            parts.append(drive(str(k), f"J{k}", values, "backlash = 0.1" * (kind == "lost motion")))
        before = link
        if kind == "in a row":
            parts += serial(k, at)
            before = f"{link}_2"
    parts.append(f'[output]\nbody = "{before}"\nat = [80, 10, 5]\n[[loads]]\nforce = [10, 20, -50]')
    return jp.loads("\n".join(parts))


def questions(m: jp.Mechanism) -> dict[str, Callable[[], object]]:
    """What is asked, through public calls."""
    return {
        "solve": partial(jp.solve, m),
        "given": partial(jp.given, m),
        "loaded": partial(jp.loaded, m),
        "worst": partial(jp.worst, m),
        "compensate": partial(jp.compensate, m, "loaded"),
        "random": partial(jp.random, m, samples=SPECIMENS, contact="loaded"),
    }


def measure(rounds: int) -> Report:
    """Measure the four arms."""
    jp.progress(False)
    arms = {kind: arm(kind) for kind in ("plain", "lost motion", "gears", "in a row")}
    asked = {kind: questions(m) for kind, m in arms.items()}
    rows, most = [], dict.fromkeys(("lost motion", "gears"), 0.0)
    for name in asked["plain"]:
        seconds = interleave([Contender(kind, asked[kind][name], 1) for kind in arms], rounds)
        ratios = {kind: ratio(seconds, kind, "plain") for kind in arms if kind != "plain"}
        times = (number(one.median) for one in ratios.values())
        rows.append([f"`{name}`", Spread.of(seconds["plain"]).text(1e3), *times])
        most = {kind: max(one, ratios[kind].median) for kind, one in most.items()}
    targets = [
        Target("W12: lost motion, the most", 1.2, True, most["lost motion"]),
        Target("W12: gears, the most", 3, True, most["gears"]),
    ]
    sizes = [f"{kind}: {len(m.bodies)} bodies, {len(m.sources)} sources" for kind, m in arms.items()]
    header = ["question", "plain, ms", "lost motion", "12 gears", "18 links in a row"]
    return Report("W12", "Play in the drives of an arm", header, rows, targets, [f"{'; '.join(sizes)}."])
