"""The documentation page: a template with every number filled in from what is printed and from the study."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from string import Template

import numpy as np

from . import fivebar, published
from . import fixed as fixed_link
from .determinate import CENTRES as CENTRES_OF_STEPS
from .published import CLEARANCE, PLACES, TURN, Floats
from .study import LOCKED, SAMPLES, Study

TEMPLATE = Path(__file__).parent / "page.md"
#: endpoints of Table 3 with the centre beside them in the same joint
PAIRS = ("A", "B", "D", "E", "F")
#: centres of the file that the endpoints of Table 3 are
CENTRES = {
    "A": ("A", "shaft"),
    "A1": ("A", "bearing"),
    "B": ("B", "shaft"),
    "B1": ("B", "bearing"),
    "D": ("D/ED", "shaft"),
    "D1": ("D/ED", "bearing"),
    "E": ("E", "shaft"),
    "E1": ("E", "bearing"),
    "F": ("F", "shaft"),
    "F1": ("F", "bearing"),
    "I": ("I", "shaft"),
}
#: what the page calls the centres of the determinate structure
VERTICES = {"D/ED": "D"}
#: what is smaller is rounding
NOTHING = 5e-7


def fixed(value: float, digits: int) -> str:
    """A number for reading: fixed digits, a true minus sign, no negative zero."""
    text = f"{value:.{digits}f}"
    return text.replace("-", "−") if float(text) else text.lstrip("-")


def pair(values: Iterable[float], digits: int = 3) -> str:
    """A point or a displacement."""
    return "(" + ", ".join(fixed(value, digits) for value in values) + ")"


def matrix(m: Floats) -> str:
    """A matrix in a row."""
    return "[" + "; ".join(", ".join(fixed(value, 3) for value in row) for row in m) + "]"


def table(header: Sequence[str], body: Iterable[Sequence[str]]) -> str:
    """A Markdown table: first column left, all others right aligned."""
    lines = [header, [":--", *["--:"] * (len(header) - 1)], *body]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def geometry() -> str:
    """Lengths of Table 1 beside those between the points of the drawing."""
    body = []
    for bar, (length, deviation) in published.lengths().items():
        drawn = float(np.linalg.norm(PLACES[bar[0]] - PLACES[bar[1]]))
        body.append([bar, fixed(length, 2), fixed(drawn, 3), fixed(deviation, 2)])
    return table(["bar", "printed [mm]", "between the points [mm]", "deviation [mm]"], body)


def jacobians(study: Study) -> str:
    """Printed, by the formulas twice, and by the engine, in the axes of the formulas and in those of Table 3."""
    b, c, alpha = published.angles()
    right, slipped = published.formulas(b, c, alpha), published.formulas(published.angle_used(), c, alpha)
    names = ("λ₁, by the lengths of BD and ED", "λ₂, by B", "λ₃, by E")
    body = []
    for k, name in enumerate(names):
        own = study.jacobians[k]
        turned = TURN @ own if k == 0 else TURN @ own @ TURN.T
        printed = published.jacobians()[k]
        body.append([name, *map(matrix, (printed, slipped[k], right[k], turned, own))])
    header = [
        "",
        "printed",
        f"formulas, β − ε = {fixed(published.angle_used(), 2)}°",
        f"formulas, β − ε = {fixed(b, 2)}°",
    ]
    return table([*header, "jointplay, x down the cabin", "jointplay, x along the panels"], body)


def contact(study: Study) -> str:
    """Forces on the bases for a unit force on D."""
    body = []
    for force, words in ((1, "DF"), (2, "DI")):
        printed = published.contact_forces(force)
        body += [
            [f"{joint}, force along {words}", pair(printed[joint]), pair(study.contact[force][joint])]
            for joint in ("B", "E")
        ]
        total = [printed["B"] + printed["E"], study.contact[force]["B"] + study.contact[force]["E"]]
        body.append([f"B and E together, force along {words}", *map(pair, total)])
    return table(["", "printed", "jointplay, the dyad alone"], body)


def endpoints(study: Study) -> str:
    """Table 3 beside the built unit after the last step."""
    printed, last = published.errors(), study.unit.isel(step=-1)
    body = []
    for name, error in printed.items():
        joint, end = CENTRES[name]
        own = last[f"error_{end}"].sel(joint=joint, component=["x", "y"]).values
        half = last[f"undetermined_{end}"].sel(joint=joint, component=["x", "y"]).values
        body.append([name, pair(error), pair(own), pair(half, 2)])
    return table(["endpoint", "printed [mm]", "jointplay [mm]", "left open by the play ± [mm]"], body)


def plays() -> str:
    """How far the two centres of a joint are apart in Table 3."""
    printed = published.errors()
    body = []
    for name in PAIRS:
        between = printed[f"{name}1"] - printed[name]
        angle = float(np.degrees(np.arctan2(between[1], between[0])))
        body.append([name, pair(between), fixed(float(np.linalg.norm(between)), 3), fixed(angle, 1)])
    return table(["joint", "between its two centres [mm]", "distance [mm]", "direction [°]"], body)


def leads() -> str:
    """What some numbers of Table 3 are made of: directions of (41) times twice the clearance, an angle along a bar."""
    printed, force = published.errors(), published.contact_forces(1)
    unit = {joint: vector / np.linalg.norm(vector) for joint, vector in force.items()}
    clearance = float(np.linalg.norm(printed["A1"] - printed["A"]))
    length, deviation = published.lengths()["AF"]
    body = [
        [
            "B₁ − B",
            pair(printed["B1"] - printed["B"]),
            "2 r_c times the direction of (41) in B",
            pair(2 * clearance * unit["B"]),
        ],
        ["E₁ − E", pair(printed["E1"] - printed["E"]), "−2 r_c times that in E", pair(-2 * clearance * unit["E"])],
        [
            "x of F",
            fixed(float(printed["F"][0]), 3),
            "x of A₁ + deviation of AF − length of AF × 1.5°",
            fixed(float(printed["A1"][0] + deviation - length * np.radians(1.5)), 3),
        ],
    ]
    return table(["number", "printed [mm]", "read as", "gives [mm]"], body)


def steps(study: Study) -> str:
    """The sequence with what it takes."""
    unit, bare = study.unit, study.without_play
    body = []
    for k, step in enumerate(unit.step.values.tolist()):
        redundant = int(unit.redundancy[k]) > 0
        forces = bare.member_force.values[k]
        body.append(
            [
                str(step),
                str(unit.links[k].item()),
                str(unit.kind[k].item()),
                fixed(float(unit.clearance_factor[k]), 3) if redundant else "–",
                fixed(float(study.needed[k]), 4) if redundant else "–",
                fixed(float(np.nanmax(np.abs(forces), initial=0.0)) / 1e3, 2) if redundant else "0",
                fixed(float(study.worst.worst_clearance_factor[k]), 2) if redundant else "–",
                fixed(100.0 * float(study.scatter.probability_of_fit[k]), 1),
            ]
        )
    header = ["step", "adds", "kind", "clearance factor", "clearance needed [mm]", "largest force without play [kN]"]
    return table([*header, "worst factor", "specimens that fit [%]"], body)


def single(study: Study) -> str:
    """The link that is fixed: by the formulas, and by the engine."""
    f = study.fixed
    body = [
        ["its pin's centre, (1)", pair(f.near[0]), "–", pair(f.near[1])],
        ["its end, right angle, (4)", pair(f.straight[0]), "–", pair(f.straight[1])],
    ]
    for theta in fixed_link.THETAS:
        name = f"its end, angle off by {fixed(theta, 0)}°, (5)"
        body.append([name, pair(f.printed[theta]), pair(f.across[theta]), pair(f.exact[theta])])
    return table(["error of", "as printed [mm]", "across the link [mm]", "jointplay [mm]"], body)


def halves(study: Study) -> str:
    """Where the centres of a joint go under a force: half each, and as the closure says."""
    body = []
    for joint, (shaft, bearing) in study.centres.items():
        apart = bearing - shaft
        body.append([joint, pair(-apart / 2), pair(apart / 2), pair(shaft), pair(bearing)])
    header = ["joint", "shaft, (33) [mm]", "bearing, (33) [mm]", "shaft, jointplay [mm]", "bearing, jointplay [mm]"]
    return table(header, body)


def ways(study: Study) -> str:
    """The four ways to assemble a five-bar."""
    body = []
    for letter, loop in study.loops.items():
        reach = loop.worst.worst_shaft.sel(joint="D").values
        for k, step in enumerate(loop.unit.step.values.tolist()):
            words = f"({letter}) {loop.way.words}" if k == 0 else ""
            kind, links = str(loop.unit.kind[k].item()), str(loop.unit.links[k].item())
            body.append([words, str(step), links, kind, "–" if np.isnan(reach[k]) else fixed(float(reach[k]), 3)])
    return table(["figure 1", "step", "adds", "kind", "D is off by at most [mm]"], body)


def freely(study: Study) -> str:
    """The determinate structure, step by step: its vertices by the formulas and by the engine."""
    found, body = study.freely.unit, []
    for step, names in CENTRES_OF_STEPS.items():
        here = found.sel(step=step, component=["x", "y"])
        for name in names:
            by_formulas, at = study.freely.formulas[name], here.sel(joint=name)
            first = name == names[0]
            body.append(
                [
                    f"{step}: {here.links.item()}" if first else "",
                    str(here.kind.item()) if first else "",
                    VERTICES.get(name, name),
                    pair(by_formulas.error),
                    pair(at.error_shaft.values),
                    pair(by_formulas.open, 2),
                    pair(at.undetermined_shaft.values, 2),
                ]
            )
    header = [
        "step",
        "kind",
        "centre",
        "(7) [mm]",
        "jointplay [mm]",
        "play by (6), (7), (16) ± [mm]",
        "jointplay ± [mm]",
    ]
    return table(header, body)


def cabin(study: Study) -> str:
    """The finished structure in the cabin's axes."""
    body = [[name, *map(pair, errors)] for name, errors in study.freely.cabin.items()]
    return table(["centre", "by A₁D₂ as one link, (7) [mm]", "jointplay [mm]"], body)


def values(study: Study) -> dict[str, str]:
    """Single numbers of the text."""
    b, c, alpha = published.angles()
    slip, printed = published.angle_used(), published.errors()
    bars = published.lengths()
    flipped = published.jacobians()[1] + published.jacobians()[2]
    f = printed["F"] * [1.0, -1.0]
    between = printed["F1"] - f
    lean = float(np.degrees(np.arccos((bars["AF"][0] + printed["F"][0]) / (bars["AF"][0] + bars["AF"][1]))))
    low, high = published.locked_length(np.array([[bars["BD"][0] / 2, 0.0]] * 2), CLEARANCE)
    both = published.contact_forces(2)
    free = study.freely
    plus = fixed_link.THETAS[0]
    return {
        "fixed_length": fixed(fixed_link.LENGTH, 0),
        "fixed_phi": fixed(fixed_link.PHI, 0),
        "gamma": pair(fixed_link.GAMMA, 1),
        "longer": fixed(study.fixed.longer(study.fixed.printed, plus), 2),
        "five_play": fixed(fivebar.PLAY, 1),
        "five_longer": fixed(fivebar.LONGER, 1),
        "five_factor": fixed(float(study.loops["d"].unit.clearance_factor[-1]), 2),
        "chain": fixed(free.link[0], 3),
        "chain_off": fixed(free.link[1], 3),
        "chain_play": fixed(free.link[2], 3),
        "chain_off_exact": fixed(free.link_exact[0], 3),
        "chain_least": fixed(free.link_exact[1] - free.link_exact[0], 3),
        "chain_most": fixed(free.link_exact[2] - free.link_exact[0], 3),
        "clearance": fixed(CLEARANCE, 1),
        "ed_drawn": fixed(float(np.linalg.norm(PLACES["D"] - PLACES["E"])), 2),
        "b": fixed(b, 2),
        "c": fixed(c, 2),
        "alpha": fixed(alpha, 2),
        "slip": fixed(slip, 2),
        "slipped_by": fixed(slip - b, 2),
        "sum_right": fixed(b + c + alpha, 0),
        "sum_slipped": fixed(slip + c + alpha, 1),
        "flipped": matrix(flipped),
        "along_b": fixed(study.along[0], 3),
        "along_diagonal": fixed(study.along[1], 3),
        "sum_2": pair(both["B"] + both["E"], 2),
        "sum_2_d": pair(both["D"], 2),
        "f_distance": fixed(float(np.linalg.norm(between)), 3),
        "f_angle": fixed(float(np.degrees(np.arctan2(between[1], between[0]))), 1),
        "lean": fixed(lean, 1),
        "lean_y": fixed(bars["AF"][0] * float(np.sin(np.radians(lean))), 0),
        "ab": fixed(bars["AB"][1], 2),
        "af": fixed(bars["AF"][1], 2),
        "low": fixed(low, 3),
        "high": fixed(high, 3),
        "link_low": fixed(study.links[0], 3),
        "link_high": fixed(study.links[1], 3),
        "locked": fixed(LOCKED, 0),
        "link_bent": fixed(study.links[2], 3),
        "samples": f"{SAMPLES:,}".replace(",", " "),
        "needed_3": fixed(float(study.needed[2]), 3),
        "needed_5": fixed(float(study.needed[4]), 3),
        "worst_3": fixed(float(study.worst.worst_clearance_factor[2]), 2),
        "worst_5": fixed(float(study.worst.worst_clearance_factor[4]), 2),
        "fit_5": fixed(100.0 * float(study.scatter.probability_of_fit[4]), 1),
    }


def render(study: Study) -> str:
    """The whole page. A placeholder without a value is an error, so that no sentence stands without its number."""
    blocks = {
        "geometry": geometry(),
        "jacobians": jacobians(study),
        "contact": contact(study),
        "endpoints": endpoints(study),
        "leads": leads(),
        "plays": plays(),
        "steps": steps(study),
        "single": single(study),
        "halves": halves(study),
        "ways": ways(study),
        "freely": freely(study),
        "cabin": cabin(study),
    }
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(blocks | values(study))
