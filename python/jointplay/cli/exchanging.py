"""The subcommands that bring mechanisms in from foreign formats, and out to them."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from jointplay.errors import InputError, shown
from jointplay.file.schema.values import is_finite

from . import DONE, answer, completing
from .arguments import assignments, several, value
from .options import File, LoadCase, Offset, PointName, Settings, writes
from .streams import hold

#: options of the export that messages name
KEYS_OF_EXPORT = ("configuration", "offsets", "question", "magnify")
#: options by the words that messages of the import begin with
OPTIONS = {
    "output": "--output-point",
    "drives": "--drives",
    "clearance": "--clearance",
    "planar": "--planar",
    "loops": "--loop",
    "ground": "--ground",
    "backlash": "--backlash",
    "fit": "--fit",
    "density": "--density",
    "within": "--within",
}


def import_(
    file: Annotated[
        str,
        typer.Argument(
            metavar="FOREIGN",
            help="URDF (.urdf, .xacro), SDF (.sdf), MJCF (.mjcf), or as .xml; FreeCAD (.FCStd, .asmt); DXF (.dxf);"
            " pylinkage (.json), Pyslvs (.pyslvs), Linkage (.linkage2), PMKS+ (.pmks, or its link).",
            show_default=False,
            autocompletion=completing.foreign,
        ),
    ],
    output: Annotated[Path | None, writes("Where to write it; NAME.toml if left out.")] = None,
    output_point: Annotated[
        str | None,
        typer.Option("--output-point", metavar="NAME", help="Link, site, point or joint that is the output."),
    ] = None,
    drives: Annotated[
        list[str] | None,
        typer.Option("--drives", metavar="JOINTS", help="Driven joints: A,B, or with values A=10, A=0:90:7."),
    ] = None,
    clearance: Annotated[
        list[str] | None,
        typer.Option(
            "--clearance", metavar="KIND|JOINT={...}", help="Clearance: revolute={radial=0.02,axial=0.02,length=30}"
        ),
    ] = None,
    planar: Annotated[
        bool, typer.Option("--planar", help="See it along its pins, as a mechanism in the plane.")
    ] = False,
    loop: Annotated[
        list[str] | None,
        typer.Option(
            "--loop", metavar="NAME={...}", help='A joint that closes a loop: J4={type="spherical",on={A=[..],B=[..]}}'
        ),
    ] = None,
    ground: Annotated[
        str | None, typer.Option("--ground", metavar="LINK", help="The link that is fixed. [default: the root]")
    ] = None,
    backlash: Annotated[
        list[str] | None,
        typer.Option(
            "--backlash", metavar="KIND|JOINT={...}", help="Lost motion of drives: revolute={angle=0.1}, elbow=0.2"
        ),
    ] = None,
    keep_joints: Annotated[
        bool, typer.Option("--keep-joints", help="Joints that are lost motion of the joint beside them stay joints.")
    ] = False,
    fit: Annotated[
        str | None,
        typer.Option("--fit", metavar="FIT", help="Fit of pins that are drawn with the diameter of their holes: H7/g6"),
    ] = None,
    density: Annotated[
        list[str] | None,
        typer.Option("--density", metavar="[PART=]NUMBER", help="kg/m^3 of the parts of an assembly: 7850, Rod=2700"),
    ] = None,
    within: Annotated[
        float, typer.Option("--within", metavar="MM", help="DXF: points that are no farther apart are one.")
    ] = 0.0,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
) -> int:
    """Make a mechanism file of a robot, assembly or drawing.

    Comments of the file name what is left out, and show where clearances are written.
    """
    from jointplay.basics.files import require_writable
    from jointplay.basics.foreign import is_link
    from jointplay.exchange.options import Options
    from jointplay.exchange.reading import imported
    from jointplay.result.write import create

    path = output or Path(("pmks" if is_link(file) else Path(file).stem) + ".toml")
    if require_writable(path).is_file():
        if not is_link(file) and Path(file).exists() and path.samefile(file):
            raise InputError("is the file that is read; name another one", file=os.fspath(path), key="--output")
        if not force:
            raise InputError("exists already; --force replaces it", file=os.fspath(path))
    options = Options(
        output=output_point,
        drives=_drives(drives),
        clearance=_tables(clearance, "--clearance"),
        planar=planar,
        loops=_tables(loop, "--loop"),
        ground=ground,
        backlash=_values(backlash, "--backlash"),
        keep_joints=keep_joints,
        fit=fit,
        density=_densities(density),
        within=within,
    )
    try:
        found = imported(file, options)
    except InputError as problem:
        word, _, rest = problem.key.partition(" ")
        key = " ".join([OPTIONS.get(word, word), rest]).strip()
        raise InputError(problem.problem, file=problem.file, key=key) from None
    create(found.text, path, replace=force)
    hold(found.notes)
    m = found.mechanism
    assert m.data.output is not None
    parts = [_counted(m.bodies, "body", "bodies"), _counted(m.joints, "joint"), _counted(m.drives, "drive")]
    typer.echo(f"wrote {path}: {', '.join(parts)}, the output on {m.data.output.body}")
    if len(m.sources) < len(m.joints):
        typer.echo(f"Clearances: write them in {path} where it says so, or use --clearance.")
    return DONE


def _counted(names: Sequence[str], one: str, several: str = "") -> str:
    return f"{len(names)} {one if len(names) == 1 else several or one + 's'}"


def _drives(given: list[str] | None) -> dict[str, object] | None:
    """`A,B` and `A=0:90:7`."""
    if not given:
        return None
    found: dict[str, object] = {}
    for text in given:
        if "=" in text:
            for name, values in assignments([text], "--drives").items():
                found[name] = several(values, f"--drives {name}")
        else:
            found |= {name.strip(): None for name in text.split(",")}
    return found


def _densities(given: list[str] | None) -> dict[str, float]:
    """`7850` for all parts, and `Crank=2700`."""
    pairs = [text if "=" in text else f"={text}" for text in given or ()]
    found = {}
    for pair in pairs:
        name, _, text = pair.partition("=")
        number = value(text, f"--density {name}".strip())
        if not is_finite(number):
            problem = f"a number of kg/m^3 is needed, such as 7850 or Crank=2700, not {shown(number)}"
            raise InputError(problem, key=f"--density {name}".strip())
        found[name.strip()] = float(number)
    return found


def _tables(given: list[str] | None, option: str) -> dict[str, Any]:
    found = _values(given, option)
    for name, table in found.items():
        if not isinstance(table, dict):
            problem = f"a table is needed, such as {{ radial = 0.02 }}, not {shown(table)}"
            raise InputError(problem, key=f"{option} {name}")
    return found


def _values(given: list[str] | None, option: str) -> dict[str, Any]:
    return {name: value(text, f"{option} {name}") for name, text in assignments(given or (), option).items()}


def export(
    file: File,
    output: Annotated[Path | None, writes("Where to write it: .xml (MJCF), .dxf or .csv.")] = None,
    configuration: Annotated[
        int | None,
        typer.Option(
            "--configuration",
            "-c",
            metavar="N",
            help="The configuration in which drives are held, or that is drawn; 0 if left out.",
            show_default=False,
        ),
    ] = None,
    offset: Offset = None,
    question: Annotated[
        str | None, typer.Option("--question", "-q", metavar="NAME", help="Places of a .csv: worst or loaded.")
    ] = None,
    magnify: Annotated[
        float, typer.Option("--magnify", metavar="TIMES", help="Factor on the displacements of a .csv.")
    ] = 1.0,
    output_point: PointName = None,
    load_case: LoadCase = None,
    settings: Settings = None,
) -> int:
    """Write a model of MuJoCo, a drawing, or places for CAD.

    Clearances of the model are gaps between solids in contact, for a study of dynamics.
    """
    from jointplay.exchange.exporting import export as write

    if output is None:
        raise InputError("say where it goes: -o NAME.xml (MJCF), -o NAME.dxf or -o NAME.csv", key="--output")
    m = answer.mechanism(file, settings, output_point, load_case)
    try:
        offsets = answer.offsets(m, offset) if offset else None
        write(m, output, configuration=configuration, offsets=offsets, question=question, magnify=magnify)
    except InputError as problem:
        key = f"--{problem.key.rstrip('s')}" if problem.key in KEYS_OF_EXPORT else problem.key
        raise InputError(problem.problem, file=problem.file, key=key) from None
    typer.echo(f"wrote {output}")
    return DONE
