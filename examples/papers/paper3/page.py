"""The documentation page: a template with every number filled in from the study and the maps."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from string import Template

import numpy as np

from .closed_form import Floats, Upu
from .maps import REACH, Maps
from .study import (
    ASIDE,
    CLEARANCES,
    FACTORS,
    HEIGHTS,
    HOME,
    LENGTHS,
    RANDOM_POSES,
    RANDOM_ROBOTS,
    RATIOS,
    SAMPLES,
    SHRUNK,
    Pose,
    Study,
)

TEMPLATE = Path(__file__).parent / "page.md"
COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
#: rounding noise has no digits worth printing
NOTHING = 5e-7


def fixed(value: float, digits: int) -> str:
    """A number for reading: fixed digits, a true minus sign, no negative zero."""
    text = f"{value:.{digits}f}"
    return text.replace("-", "−") if float(text) else text.lstrip("-")


def vector(values: Iterable[float], digits: int) -> str:
    """Several numbers."""
    return ", ".join(fixed(value, digits) for value in values)


def whole(value: int) -> str:
    """A large whole number."""
    return f"{value:,}".replace(",", " ")


def table(header: Sequence[str], body: Iterable[Sequence[str]]) -> str:
    """A Markdown table: first column left, all others right aligned."""
    lines = [header, [":--", *["--:"] * (len(header) - 1)], *body]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def poses(study: Study) -> str:
    """Both poses: what the legs carry, and the error three times over."""

    def rows(show: str, digits: int, of: str, part: slice = slice(None), scale: float = 1.0) -> list[str]:
        return [show, *(vector(scale * getattr(pose, of)[part], digits) for pose in study.poses)]

    place, turn = slice(0, 3), slice(3, 6)
    return table(
        ["", *(f"p = ({vector(pose.position, 0)}) mm" for pose in study.poses)],
        [
            rows("force f [N]", 0, "force"),
            rows("couple m [N m]", 1, "moment", scale=1e-3),
            rows("l [mm]", 4, "lengths"),
            rows("F, closed form [N]", 4, "along_closed"),
            rows("F, exact closure [N]", 4, "along"),
            rows("M, closed form [N m]", 4, "couple_closed", scale=1e-3),
            rows("M, exact closure [N m]", 4, "couple", scale=1e-3),
            rows("displacement, closed form [mm]", 5, "closed_form", place),
            rows("displacement, engine, first order [mm]", 5, "first_order", place),
            rows("displacement, engine, exact [mm]", 5, "exact", place),
            rows("rotation, closed form [°]", 5, "closed_form", turn),
            rows("rotation, engine, first order [°]", 5, "first_order", turn),
            rows("rotation, engine, exact [°]", 5, "exact", turn),
            ["undetermined, displacement [mm]", *("± " + vector(p.undetermined[place], 4) for p in study.poses)],
            ["undetermined, rotation [°]", *("± " + vector(p.undetermined[turn], 4) for p in study.poses)],
            ["status", *(f"`{pose.status}`" for pose in study.poses)],
        ],
    )


def shrinking(study: Study) -> str:
    """First order against exact closure."""
    return table(
        [
            "clearances ×",
            "rotation, exact [°]",
            "displacement, first order from exact",
            "rotation, first order from exact",
        ],
        [
            [f"{part:g}", fixed(turn, 4), f"{100 * a:.2f} %", f"{100 * b:.2f} %"]
            for part, (turn, a, b) in zip(SHRUNK, study.shrinking, strict=True)
        ],
    )


def worst(study: Study) -> str:
    """The largest errors at both poses."""
    body = []
    for pose, found in zip((HOME, ASIDE), study.worst, strict=True):
        for k, (word, unit) in enumerate((("displacement", "mm"), ("rotation", "°"))):
            values = found.closed_form[k], found.first_order[k], found.bound[k], found.exact[k]
            body.append([f"largest {word} at ({vector(pose, 0)}) [{unit}]", *(fixed(v, 5) for v in values)])
    return table(["", "closed form", "engine, first order", "bound of it", "engine, exact"], body)


def blame(study: Study) -> str:
    """Parts of the joints, the two pins of a kind together."""
    body = []
    rows = [(f"base{k}", f"leg{k}", f"top{k}") for k in (1, 2, 3)]
    for leg, (base, guide, top) in enumerate(rows, start=1):
        for word, names in (
            (f"leg {leg}: pins on base and platform", (f"{base}.first", f"{top}.second")),
            (f"leg {leg}: pins on the leg", (f"{base}.second", f"{top}.first")),
            (f"leg {leg}: guide", (guide,)),
        ):
            loaded = np.sum([study.parts[name] for name in names], axis=0)
            largest = [sum(part[name] for name in names) for part in study.worst[1].parts]
            body.append([word, *(fixed(float(v), 4) for v in (loaded[0], largest[0], loaded[1], largest[1]))])
    sums = [*(sum(part[k] for part in study.parts.values()) for k in (0, 1)), *study.worst[1].first_order]
    order = [sums[0], sums[2], sums[1], sums[3]]
    body.append(["together", *(f"**{fixed(float(v), 4)}**" for v in order)])
    header = ["", "displacement, load [mm]", "largest displacement [mm]", "rotation, load [°]", "largest rotation [°]"]
    return table(header, body)


def compensation(study: Study) -> str:
    """Legs before and after, and the error before and after."""
    fix = study.compensation
    return table(
        ["", "nominal, before", "corrected, after"],
        [
            ["l [mm]", vector(fix.nominal, 4), vector(fix.nominal + fix.correction, 4)],
            ["change of l [mm]", "", vector(fix.correction, 4)],
            ["displacement [mm]", vector(fix.before[:3], 4), vector(_clean(fix.residual[:3]), 4)],
            ["rotation [°]", vector(fix.before[3:], 4), vector(fix.residual[3:], 4)],
        ],
    )


def levels(maps: Maps) -> str:
    """The maps in a few numbers."""
    body = []
    for level in maps.levels:
        sound = level.status != "singular"
        for word, values, first in (
            ("displacement [mm]", level.position[sound], level.position_first_order[sound]),
            ("rotation [°]", level.rotation[sound], level.rotation_first_order[sound]),
        ):
            quantiles = (values.min(), np.median(values), np.quantile(values, 0.9), values.max(), first.max())
            body.append([f"z = {level.z:g} mm: {word}", *(fixed(float(v), 3) for v in quantiles)])
    return table(["", "smallest", "median", "90 % below", "largest", "largest, first order"], body)


def sweeps(study: Study) -> str:
    """Displacement at half, the usual and twice the value of every size."""
    units = {"radial": "ε_d", "axial": "ε_a", "gap": "c", "pin_length": "2 λ", "guide_length": "L", "guide_width": "a"}
    body = []
    for group, names in (("clearances", CLEARANCES), ("lengths", LENGTHS)):
        ends = {"lowest": 0, "usual": int(np.argmin(np.abs(FACTORS[group] - 1))), "highest": -1}
        for name in names:
            usual = getattr(Upu(), name)
            span = f"{FACTORS[group][0] * usual:g} to {FACTORS[group][-1] * usual:g}"
            sizes = [fixed(study.swept[name][k][i], 3) for k in (0, 1) for i in ends.values()]
            body.append([f"{units[name]} from {span} mm (`{name}`)", *sizes])
    header = [
        "",
        "displacement at the lowest [mm]",
        "usual",
        "highest",
        "rotation at the lowest [°]",
        "usual",
        "highest",
    ]
    return table(header, body)


def scatter(study: Study) -> str:
    """Standard deviations, and quantiles beside the worst case."""
    found = study.scatter
    place, turn = slice(0, 3), slice(3, 6)
    return table(
        ["", "displacement [mm]", "rotation [°]"],
        [
            ["standard deviations, exact", vector(found.std[place], 4), vector(found.std[turn], 4)],
            ["first order", vector(found.std_first_order[place], 4), vector(found.std_first_order[turn], 4)],
            *(
                [f"{100 * p:g} % of the specimens stay below", *(fixed(value, 3) for value in found.quantiles[p])]
                for p in sorted(found.quantiles)
            ),
            ["largest of them", *(fixed(value, 3) for value in found.largest)],
            ["under the load", *(fixed(float(np.linalg.norm(study.poses[1].exact[p])), 3) for p in (place, turn))],
            ["worst case", *(fixed(value, 3) for value in study.worst[1].exact)],
        ],
    )


def _clean(values: Floats) -> Floats:
    return np.where(np.abs(values) < NOTHING, 0.0, values)


def _shares(study: Study) -> dict[str, str]:
    """Shares of the kinds of play in the displacement under the load: what goes when the play goes, to first order."""
    whole_error = study.swept["radial"][2][int(np.argmin(np.abs(FACTORS["clearances"] - 1)))]
    # Parts along the error, from the joints' contributions; those of pins hold radial and axial play together.
    guides = sum(part[0] for name, part in study.parts.items() if name.startswith("leg"))
    axial = whole_error - study.swept["axial"][2][0]
    radial = whole_error - guides - axial
    return {
        f"share_{name}": fixed(100 * float(value / whole_error), digits)
        for name, value, digits in (("radial", radial, 0), ("gap", guides, 0), ("axial", axial, 1))
    }


def values(study: Study, maps: Maps) -> dict[str, str]:
    """Every number of the running text."""
    aside: Pose = study.poses[1]
    loaded = [float(np.linalg.norm(aside.exact[p])) for p in (slice(0, 3), slice(3, 6))]
    count = {
        status: sum(int((level.status == status).sum()) for level in maps.levels)
        for status in ("undetermined", "singular")
    }
    apart = np.concatenate(
        [np.abs(v.position / v.position_first_order - 1)[v.status != "singular"] for v in maps.levels]
    )
    floating = np.concatenate([level.undetermined[level.status == "undetermined"] for level in maps.levels])
    if len(floating):
        undetermined = (
            f"{len(floating)} nodes have the status `undetermined`: within the clearances a leg carries no couple, its "
            f"guide is free, and the indeterminacy is up to {fixed(float(floating.max()), 2)} mm."
        )
    else:
        undetermined = "There are none: where a leg carries no couple, the small forces of the displaced robot decide."
    length, z = study.poses[0].lengths[0], study.poses[0].position[2]
    small = int(np.argmin(np.abs(RATIOS - 0.25)))
    low = int(np.argmin(np.abs(HEIGHTS - 200)))
    lever = np.abs(aside.couple_closed) / (Upu().pin_length / 2)
    singular = "At no node does the play bring the robot to a singular pose."
    if count["singular"]:
        singular = (
            f"At {count['singular']} corners of the highest level the play itself brings the robot to a singular pose, "
            "and the status is `singular`: they are not in the table above, and crossed out below."
        )
    return {
        "robots": str(RANDOM_ROBOTS),
        "poses": str(RANDOM_ROBOTS * RANDOM_POSES),
        "gap": "1e−10" if study.gap_of_closed_form < 1e-10 else f"{study.gap_of_closed_form:.1e}",
        "radial": f"{Upu().radial:g}",
        "aside": vector(ASIDE, 0),
        "loaded_position": fixed(loaded[0], 2),
        "loaded_rotation": fixed(loaded[1], 2),
        "q99_position": fixed(study.scatter.quantiles[0.99][0], 2),
        "worst_position": fixed(study.worst[1].exact[0], 2),
        "load_share": fixed(100 * loaded[0] / study.worst[1].exact[0], 0),
        "silent": fixed(1e6 * study.silent[0], 1),
        "tilts": f"{Upu().guide_width / Upu().guide_length:g}",
        "drop": fixed(4 * Upu().radial * length / z, 5),
        "ratio": fixed(float(np.max(lever / np.abs(aside.along_closed))), 0),
        "iterations": str(study.compensation.iterations),
        "edge": f"{2 * REACH:g}",
        "corner": fixed(REACH * np.sqrt(2) / (2 * Upu().difference), 2),
        "nodes": whole(sum(level.position.size for level in maps.levels)),
        "apart_half": fixed(100 * float(np.median(apart)), 1),
        "apart_90": fixed(100 * float(np.quantile(apart, 0.9)), 0),
        "apart_most": fixed(100 * float(apart.max()), 0),
        "undetermined": f"**Undetermined nodes.** {undetermined}",
        "singular_sentence": singular,
        "worst_nodes": str(maps.largest.position.size),
        "worst_low": fixed(float(maps.largest.position.min()), 2),
        "worst_high": fixed(float(maps.largest.position.max()), 2),
        "ratio_small": f"{RATIOS[small]:.2g}",
        "ratio_small_position": fixed(study.by_ratio[0][small], 2),
        "height_low": f"{HEIGHTS[low]:g}",
        "height_low_position": fixed(study.by_height[0][low], 2),
        "samples": whole(SAMPLES),
        "corr_y": fixed(study.scatter.correlation[1, 3], 3),
        "corr_x": fixed(study.scatter.correlation[0, 4], 3),
        "largest_share": fixed(100 * study.scatter.largest[0] / study.worst[1].exact[0], 0),
    }


def render(study: Study, maps: Maps) -> str:
    """The whole page. A placeholder without a value is an error, so that no sentence stands without its number."""
    blocks = {
        "pose_table": poses(study),
        "shrinking_table": shrinking(study),
        "worst_table": worst(study),
        "blame_table": blame(study),
        "compensation_table": compensation(study),
        "map_table": levels(maps),
        "sweep_table": sweeps(study),
        "scatter_table": scatter(study),
    }
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(blocks | _shares(study) | values(study, maps))
