"""Random command lines."""

from random import Random

from .files import NAMES, SCALARS, TEXTS

VALUES = [
    "0", "1", "-1", "0.1", "1e-300", "1e300", "inf", "nan", "1e9", "9" * 30, "9" * 5000, "true", "''", "'a'", "[",
    "[]", "{}",
    "[1, 2]", "[1, 2, 3]", "{ radial = 0.1 }", "[" * 2000, "x", "é", "a\nb", "\x1b[0m", "\udcff", "0:1:3", "1,2",
    "0:1:0", ",", ":", "::",
    "0:1:99999999999", "0:2 * 3:3", "1,atan2(1, 2)", "(,", "0:(:3",
    "=", "", " ", "*", "1_000", "0x10", "1979-05-27", '"' * 3, "$x$",
]  # fmt: skip
KEYS = [
    "title", "joints.*.clearance.radial", "joints.J1.clearance.radial", "joints.J1.clearance", "drives.theta1.values",
    "joints.J1.clearance.fit", "limits.position", "limits.x", "limits.probability",
    "drives.theta1.error", "loads", "loads.0.force", "gravity", "limits.singular_value", "output.at", "output.body",
    "units.length", "space", "format", "*", "*.*", "joints.*", "a", "a.b.c", "", ".", "..", "joints", "joints..x",
    "start",
    ".".join("a" * 50), "a." * 3000 + "a", "drives.*.values", "dimensions.l2.deviation", "J1", "J1.x", "l2", "theta1",
    "costs", "costs.J1", "costs.*.choices", "limits.position",
    "patterns.leg.count", "patterns.*.joints.*.clearance.radial", "patterns",
    "x", "y", "angle", "left", "right", "é", "\udcff", "path", "path.x", "grid.x", "\x1b",
]  # fmt: skip
TARGETS = [
    "r.csv", "r.nc", "r.json", "r.zarr", "R.CSV", "r.txt", "r", "", ".", "..", ".csv", "folder.csv", "folder.zarr",
    "none/r.csv",
    "r" * 300 + ".csv", "é漢.csv", "a b.json", "link.csv", "lost.nc", "round.json", "full.csv", "full.nc", "m.toml",
    "m.toml/r.csv",
    "\udcff.nc", "-", "--", "r.csv\n", "\x1b[31m.csv",
]  # fmt: skip
PLOTS = ["d.svg", "d.png", "d.pdf", "d.html", "d.bmp", "d", "folder.svg", "none/d.svg", "full.svg", "d" * 300 + ".png"]
#: questions that are quick
OPTIONS = {
    "new": ["-s", "-o", "--force"],
    "check": ["-s", "-o"],
    "solve": ["-s", "-o", "--plot"],
    "singularities": ["-s", "-o", "--length", "--components", "--path", "--no-path"],
    "error": ["-s", "-o", "--plot", "-q", "--offset", "--seed", "--law", "--contact", "--indices"],
    "compensate": ["-s", "-o", "--plot", "-q", "--offset", "--weights", "--target"],
    "sweep": ["-s", "-s", "-o", "--plot", "-q", "--offset", "--seed", "--law", "--contact"],
    "map": [
        "-g",
        "-g",
        "-q",
        "--offset",
        "-s",
        "-o",
        "--overwrite",
        "--chunk",
        "--plot",
        "--variable",
        "--first-order",
    ],
    "compare": ["-q", "--components", "-s", "-o", "--plot", "--law"],
    "assemble": ["-q", "-c", "-s", "-o", "--plot", "--law"],
    "forces": ["-s", "-o", "-q", "--of", "--offset", "--probability", "--samples", "--seed", "--load-case"],
    "allow": ["-s", "-o", "--plot", "-q", "--probability", "--tolerance", "--seed", "--law", "--contact", "--sizes"],
    "life": ["-s", "-o", "--plot", "-q", "--cycles", "--cycle", "--probability", "--tolerance", "--seed", "--contact"],
    "workspace": ["-s", "-o", "--plot", "-q", "-g", "--centre", "--count", "--tolerance", "--samples"],
    "allocate": ["-s", "-o", "--plot", "-q", "--probability", "--curve", "--changes", "--samples", "--seed"],
    "design": ["-s", "-o", "--plot", "-q", "--vary", "--aim", "--evaluations", "--points", "--seed", "--changes"],
    "schema": ["-o"],
}
FLAGS = {"--force", "--changes", "--path", "--no-path", "--overwrite", "--first-order", "--indices"}
WORDS = {
    "-q": ["loaded", "worst", "random", "given", "solve", "all", "unit", "wrost"],
    "--law": ["uniform", "normal", "boundary", "none"],
    "--contact": ["scattered", "loaded", "none"],
    "--sizes": ["middle", "largest", "smallest", "none"],
    "--cycle": ["closed", "back-and-forth", "one-way", "there"],
    "--cycles": ["0:1e6:3", "1000", "-1", "1e400", "1,2", ""],
    "--vary": ["output.at.0=1:2", "joints.J1.on.ground.0=0:1", "output.at.0=2:1", "x=1", "a=1,2", "drives=0:1:3", ""],
    "--aim": ["size", "worst_position,size", "size=1,structural=2", "loaded_position", "outside", "siz", ""],
    "--evaluations": ["1", "5", "0", "-1", "many"],
    "--points": ["2", "1", "0"],
    "--of": ["drives.theta1", "joints.J1", "J1", ""],
    "--components": ["x", "x,y", "x,y,angle", "z", "x,x", "", ","],
    "--variable": ["position", "rotation", "error.x", "error", "status", "undetermined.angle", "nothing", "x", ""],
}
SAMPLED = ("error", "sweep", "map", "compare", "assemble", "forces", "allow", "life", "workspace")


def line(random: Random) -> list[str]:
    """A command with options, most of which it has; files are `m.toml` and those of the examples."""
    command = random.choice(sorted(OPTIONS))
    words = [command]
    if command == "new":
        words += [random.choice([*TEXTS, *NAMES[:3]])] * random.choice([0, 1, 1, 1])
    elif command == "compare":
        words += [random.choice(["m.toml", "four-bar.toml", "p3r.toml"]) for _ in range(2)]
    elif command != "schema":
        words += [random.choice(["m.toml"] * 8 + ["none.toml", ".", "", "pipe.toml", "full.csv", "\udcff"])]
    for _ in range(random.choice([0, 1, 1, 2, 2, 3, 4])):
        words += _option(random, random.choice(OPTIONS[command]))
    if command == "map" and random.random() < 0.7:
        words += ["-g", random.choice(["x=-60:60:3", "theta1=30:60:3", "left=120:150:3"]), "-g", "y=150,180"]
    if command in SAMPLED:
        words += ["--samples", random.choice(["20", "20", "20", "20", "1", "0", "-1", "x"])]
    if random.random() < 0.03:
        words[random.randrange(len(words))] = random.choice([*VALUES[:20], *TARGETS])
    return words


def _option(random: Random, option: str) -> list[str]:
    if option in FLAGS:
        return [option]
    if option in WORDS:
        return [option, random.choice(WORDS[option])]
    if option == "-o":
        return [option, random.choice([*TARGETS[:4] * 4, *TARGETS])]
    if option == "--plot":
        return [option, random.choice([*PLOTS[:1] * 8, *PLOTS])]
    if option in ("-s", "-g", "--offset"):
        value = random.choice([random.choice(VALUES), str(random.choice(SCALARS)), "0.1,0.2", "0.1:0.3:3", "0.1"])
        return [option, f"{random.choice(KEYS)}={value}"]
    return [option, random.choice([*VALUES[:12], "3", "1,2", "1,2,3", "100"])]
