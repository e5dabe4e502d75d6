"""Macros of robots, `.xacro`: the program xacro writes the URDF of them, where it is installed."""

import shutil
import subprocess
from pathlib import Path

from jointplay.errors import InputError, one_line

from .options import Options
from .skeleton import Skeleton
from .urdf import described
from .xml import Reading, parsed

#: seconds that it may take, and characters of what it writes
LONGEST, LARGEST = 60.0, 50_000_000


def read(path: Path, options: Options) -> Skeleton:  # noqa: ARG001 - all formats are called alike
    """A robot whose URDF the program xacro writes.

    Raises
    ------
    InputError
        When the program is missing or refuses the file, or when what it writes is no robot.
    """
    file = one_line(str(path))
    # robot.urdf.xacro is robot.
    stem = path.stem.removesuffix(".urdf")
    if not path.is_file():
        raise InputError("there is no such file", file=file)
    program = shutil.which("xacro")
    hint = f"`xacro {path.name} > {stem}.urdf` makes a robot file of it"
    if program is None:
        raise InputError(f"is a macro of a robot; xacro expands it: pip install xacro, or {hint}", file=file)
    try:
        done = subprocess.run(
            [program, str(path.absolute())], stdin=subprocess.DEVNULL, capture_output=True, timeout=LONGEST, check=False
        )
    except subprocess.TimeoutExpired:
        raise InputError(f"xacro takes longer than {LONGEST:g} s to expand it", file=file) from None
    except OSError as error:
        raise InputError(f"xacro cannot be started: {error.strerror or error}", file=file) from None
    said = done.stderr.decode("utf-8", "replace").strip().splitlines()
    if done.returncode:
        why = one_line(said[0]) if said else "it gives no reason"
        raise InputError(f"xacro cannot expand it: {why}; with the arguments that it needs, {hint}", file=file)
    if len(done.stdout) > LARGEST:
        raise InputError(f"xacro writes more than {LARGEST / 1e6:g} MB", file=file)
    robot = parsed(done.stdout.decode("utf-8", "replace"), file)
    if robot.tag != "robot":
        raise InputError(f"expands to the root element <{robot.tag}>; a robot has <robot>", file=file)
    return described(Reading(file), robot, stem)
