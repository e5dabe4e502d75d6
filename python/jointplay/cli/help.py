"""Examples for the help of every command: what to type, and what comes of it. Tests run them."""

#: what each line does, by command; the files are bundled examples of that name
LINES: dict[str, dict[str, str]] = {
    "new": {
        "jointplay new": "list the examples",
        "jointplay new four-bar": "write four-bar.toml",
    },
    "check": {
        "jointplay check four-bar.toml": "",
        "jointplay check four-bar.toml -o parts.csv": "as a table",
    },
    "solve": {
        "jointplay solve five-bar.toml": "",
        "jointplay solve five-bar.toml --all": "every row and column",
    },
    "singularities": {"jointplay singularities five-bar.toml": ""},
    "error": {
        "jointplay error four-bar.toml": "under the load, worst, and random",
        "jointplay error four-bar.toml -q worst --plot worst.png": "",
        "jointplay error four-bar.toml -s joints.J2.clearance.radial=0.2": "",
        "jointplay error four-bar.toml -q given --offset J1=0.5,0": "a known offset",
    },
    "compensate": {
        "jointplay compensate four-bar.toml": "under the load",
        "jointplay compensate four-bar.toml --offset l2=0.2": "for a known deviation",
    },
    "forces": {
        "jointplay forces slider-crank.toml": "",
        "jointplay forces slider-crank.toml -q loaded --of drives.theta": "",
    },
    "sweep": {"jointplay sweep four-bar.toml -s 'joints.*.clearance.radial=0.2:1:5'": ""},
    "allow": {"jointplay allow six-bar.toml": ""},
    "life": {
        "jointplay life press-running.toml": "",
        "jointplay life press-running.toml --cycles 0:1e6:5": "at these ages",
    },
    "workspace": {
        "jointplay workspace five-bar.toml": "",
        "jointplay workspace five-bar.toml --centre 0,150 -o boundary.dxf": "",
    },
    "calibrate": {
        "jointplay calibrate five-bar.toml --measured readings.csv": "",
        "jointplay calibrate five-bar.toml --measured readings.csv -o built.toml": "",
    },
    "plan": {
        "jointplay plan five-bar.toml -n 8 --columns x,y --sigma length=0.002": "",
        "jointplay plan five-bar.toml --columns x,y --sigma length=0.002 -o todo.csv": "",
    },
    "diagnose": {"jointplay diagnose pushed.toml --reversal pushed.csv --sigma length=0.001": ""},
    "verify": {"jointplay verify five-bar.toml --measured readings.csv --sigma length=0.002": ""},
    "allocate": {"jointplay allocate press.toml --changes": "and what sets the sizes"},
    "design": {
        "jointplay design straight-line.toml --evaluations 20 -o new.toml": "",
    },
    "map": {
        "jointplay map five-bar.toml -g x=-60:60:7 -g y=120:200:5": "",
        "jointplay map five-bar.toml -g left=120:150:4 -g right=40 -q worst": "",
    },
    "compare": {"jointplay compare four-bar.toml p3r.toml": ""},
    "assemble": {"jointplay assemble antenna-support.toml": ""},
    "animate": {"jointplay animate four-bar.toml -o four-bar.html --frames 12": ""},
    "report": {"jointplay report four-bar.toml --samples 1024 -o four-bar.html": ""},
    "studio": {
        "jointplay studio four-bar.toml": "",
        "jointplay studio --port 8080 --no-browser": "a choice of examples",
    },
    "import": {
        "jointplay import arm.urdf": "write arm.toml",
        "jointplay import arm.urdf -o tool.toml --output-point tool0": "",
        "jointplay import coupler.dxf --drives A=0:90:7": "a drawing",
        "jointplay import pump.FCStd --planar --fit H7/g6": "FreeCAD",
    },
    "export": {
        "jointplay export four-bar.toml -o four-bar.xml": "a model for MuJoCo",
        "jointplay export four-bar.toml -o four-bar.dxf": "a drawing",
        "jointplay export four-bar.toml -o places.csv -q worst": "places for CAD",
    },
    "schema": {"jointplay schema -o jointplay.schema.json": ""},
}


def examples(command: str) -> str:
    """The end of the help of a command."""
    lines = [f"  {line}  # {what}" if what else f"  {line}" for line, what in LINES[command].items()]
    # \b keeps the lines as they are.
    return "\n".join(["\b", "Examples:", *lines])
