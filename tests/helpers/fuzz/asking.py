"""Every command and every question, small enough that a case takes a second or two, and the pages of the studio."""

import json
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

import jointplay as jp
from jointplay.analyses.nominal import nominal
from jointplay.analyses.readings.channels import names_of
from jointplay.errors import JointplayError
from jointplay.show.serving.answers import now, opened, settled
from jointplay.show.serving.session import PageQuestion, Session

FEW = ["--samples", "20"]
#: commands of a mechanism `m.toml`, by how often they are asked: those that are slow less often
COMMANDS: list[tuple[int, list[str]]] = [
    (3, ["check"]),
    (1, ["check", "-o", "r.json"]),
    (2, ["solve", "--all"]),
    (1, ["solve", "-o", "r.zarr"]),
    (1, ["solve", "--plot", "d.svg"]),
    (3, ["error", *FEW]),
    (2, ["error", *FEW, "--plot", "d.svg"]),
    (1, ["error", "-q", "worst", "--certify", "-o", "r.csv"]),
    (2, ["error", "-q", "loaded", "--sizes", "largest", "-o", "r.nc"]),
    (2, ["error", "-q", "random", *FEW, "--indices"]),
    (1, ["error", "-q", "random", *FEW, "--rare"]),
    (2, ["error", "-q", "random", *FEW, "--contact", "loaded"]),
    (2, ["error", "-q", "given"]),
    (2, ["compensate"]),
    (1, ["compensate", "-q", "loaded", "--plot", "d.svg"]),
    (2, ["singularities"]),
    (1, ["singularities", "--no-path", "-o", "r.csv", "--plot", "d.svg"]),
    (2, ["assemble"]),
    (1, ["assemble", "-q", "worst"]),
    (1, ["assemble", "-q", "random", *FEW, "--plot", "d.svg"]),
    (1, ["assemble", "--best", "error"]),
    (2, ["forces"]),
    (1, ["forces", "-q", "loaded"]),
    (1, ["forces", "-q", "random", "--samples", "100"]),
    (2, ["allow"]),
    (1, ["allow", "-q", "loaded", "--plot", "d.svg"]),
    (1, ["allow", "-q", "random", "--samples", "400"]),
    (2, ["life"]),
    (1, ["life", "-q", "loaded", "--cycles", "0:1e6:3", "--plot", "d.svg"]),
    (1, ["workspace", "--count", "4"]),
    (2, ["allocate"]),
    (1, ["allocate", "-q", "random", "--samples", "400", "--plot", "d.svg"]),
    (1, ["report", "--samples", "64", "-o", "page.html"]),
    (1, ["animate", "-o", "a.html", "--frames", "2", "--size", "40mm"]),
    (1, ["export", "-o", "model.xml"]),
    (1, ["export", "-o", "drawing.dxf"]),
]
MAPPED = ("loaded", "worst", "random", "given", "solve")


def line(random: Random, raw: dict[str, Any], file: str = "m.toml") -> list[str]:
    """A command for a mechanism whose tables are these."""
    draw = random.random()
    if draw < 0.08:
        return _map(random, raw, file)
    if draw < 0.14:
        return _sweep(random, raw, file)
    if draw < 0.18:
        second = random.choice((file, "four-bar.toml", "p3r.toml"))
        return ["compare", file, second, "-q", random.choice(("worst", "loaded", "random")), *FEW]
    (command,) = random.choices([words for _, words in COMMANDS], [weight for weight, _ in COMMANDS])
    return [command[0], file, *command[1:]]


def _map(random: Random, raw: dict[str, Any], file: str) -> list[str]:
    """Over a drive, or over positions of the output."""
    values = {name: (drive.get("values") or [drive.get("from", 0)])[0] for name, drive in raw.get("drives", {}).items()}
    axes = [f"{name}={_number(value)}:{_number(value) + 20}:3" for name, value in values.items()]
    if random.random() < 0.4:
        axes = ["x=-60:60:3", "y=100:180:3", *(["z=300:400:2"] if raw.get("space") == "spatial" else [])]
    held = [word for axis in axes[:3] for word in ("-g", axis)]
    question = random.choice(MAPPED)
    kept = random.choice(([], [], ["-o", "map.zarr"], ["--plot", "d.svg"]))
    return ["map", file, *held, "-q", question, *(FEW if question == "random" else []), *kept]


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) else 0.0


def _sweep(random: Random, raw: dict[str, Any], file: str) -> list[str]:
    """Over the size of something."""
    keys = [f"dimensions.{name}.tolerance" for name in raw.get("dimensions", {})]
    for name, joint in raw.get("joints", {}).items():
        clearance = joint.get("clearance") if isinstance(joint, dict) else None
        keys += [f"joints.{name}.clearance.{key}" for key in (clearance if isinstance(clearance, dict) else ())]
    keys += [f"drives.{name}.error" for name in raw.get("drives", {})]
    if not keys:
        return ["check", file]
    by = ["--by", f"{random.choice(keys)}=0.1,0.2"] if random.random() < 0.2 else []
    question = random.choice(("worst", "loaded", "random", "given", "solve"))
    values = f"{random.choice(keys)}=0,0.1,5"
    return ["sweep", file, "-s", values, *by, "-q", question, *(FEW if question == "random" else [])]


def studio(random: Random, folder: Path) -> str:
    """A page of the studio: it opens, its sliders move, and it rests. Nothing, or what is wrong."""
    try:
        session = Session(jp.load(folder / "m.toml"))
        told = opened(session)
        asked = PageQuestion.of(_moved(random, told))
        for answer in (now(session, asked, session.begin(asked)), settled(session, asked, 0, session.begin(asked))):
            json.dumps(answer, allow_nan=False)
        json.dumps(told, allow_nan=False)
    except JointplayError as problem:
        return "" if "\n" not in str(problem) else f"not one line: {problem}"
    return ""


def _moved(random: Random, told: dict[str, Any]) -> dict[str, Any]:
    """What a page asks when some of its sliders have moved."""
    knobs = random.sample(told["knobs"], min(len(told["knobs"]), random.choice((0, 1, 2))))
    return {
        "serial": 1,
        "drives": [value * random.choice((1.0, 1.0, 1.01, 0.5)) for value in told["begin"]],
        "values": {knob["key"]: (knob["value"] or 0.1) * random.choice((0.0, 0.5, 1.0, 2.0)) for knob in knobs},
        "question": random.choice(("worst", "random", "loaded", "given")),
        "output": random.choice([None, *told["outputs"]]),
        "load_case": random.choice([None, *told["cases"]]),
    }


#: what may go wrong with a table of readings
SLIPS = ("nan", "", "-", "1e999", "0,5", "1e300", "text", "\N{MINUS SIGN}3")


def readings(random: Random, folder: Path) -> list[str]:
    """Calibrate the mechanism by a table of its own nominal readings, with slips here and there."""
    m = jp.load("m.toml")
    columns = [*m.drives, *(names_of(m) or ["x"])]
    random.shuffle(columns)
    columns = columns[: random.randint(1, len(columns))] if random.random() < 0.2 else columns
    special = ("load_case", "approach", "configuration", f"dial:{m.joints[0]}:x")
    columns += [word for word in special if random.random() < 0.1]
    try:
        found = nominal(m.first)
        at = np.column_stack([found.drives / m.drive_factors, found.output / m.component_factors])
    except JointplayError:
        at = np.ones((3, len(m.drives) + len(m.components)))
    known = dict(zip([*m.drives, *m.components], at.T.tolist(), strict=True))
    lines = [",".join(columns)]
    for k in range(min(len(at), random.choice([1, 3, 8]))):
        of = (known.get(word, known.get(word.rpartition(".")[2], [k] * len(at))) for word in columns)
        cells = [repr(values[k]) for values in of]
        lines.append(",".join(random.choice(SLIPS) if random.random() < 0.02 else cell for cell in cells))
    (folder / "readings.csv").write_text("\n".join(lines), encoding="utf-8")
    sigma = random.choice(["length=0.1,angle=0.1"] * 5 + ["auto", "x"])
    words = ["calibrate", "m.toml", "--measured", "readings.csv", "--sigma", sigma]
    for option in (
        *(["-o", "built.toml", "--posterior"], ["-o", "built.toml"], ["-o", "r.csv"], ["--plot", "d.svg"]),
        *(["--frame", "unknown"], ["--sizes"], ["--hold-out", "0.3"], ["--free", "*"], ["--contact", "scattered"]),
    ):
        if random.random() < 0.2 and option[0] not in words:
            words += option
    return words
