"""Public robots with loops, couplings and tendons beside MuJoCo and Pinocchio: `docs/robots.json`, for a table.

python tests/verify_robots.py [FOLDER] [NAME ...]      repositories are kept in FOLDER, `build/robots` if left out

A repository is cloned without its large files where it is not in the folder yet, as OWNER+NAME, and read at a commit.
"""

import json
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import jointplay as jp
from helpers.oracles.robots import MuJoCo, Pinocchio, coordinates
from jointplay.basics import poses
from jointplay.exchange.options import Options
from jointplay.exchange.reading import imported

NUMBERS = Path(__file__).resolve().parents[1] / "docs" / "robots.json"
#: where repositories are cloned from
HOST = "https://github.com"
#: random poses of every robot; how far drives are from their values (rad, m), where there are loops and where not
POSES, NEAR, FAR = 5, 0.05, 0.5
#: ways in which loops of the other program are closed until one is that of jointplay
STARTS = 100
#: differences that count beyond what stays open: m and parts of a unit vector
SAME = 1e-9
MENAGERIE = ("steadymingha/mujoco_menagerie", "7dfd49b01edf18f3e6eaac6c9d74ab63dc4e0949")
DUCK = ("apirrone/Open_Duck_Playground", "f82b5e7d1d010fa5e518215019034a3346e7b9fc")
PLACO = ("Rhoban/placo-examples", "3edf600f080a70fff03ac6d4b18bf9f9be5a48ab")
HANDS = ("dexsuite/dex-urdf", "93505db3c0b29b4a80bd359048de7d39c9ea3218")
SUITE = ("google-deepmind/dm_control", "985d09401ea8824cec489e56cd631b24d9e32891")
UNILAB = ("yummypenguin/Unilab0731_ver-mujoco_menagerie", "9fa1cca140ebe958f77d28cbf28e708abf317a82")
ASSETS = "src/unilab/assets/robots"
PARALLEL = ("Gepetto/example-parallel-robots", "52e64b31c2ef122feffa571b78134d4529f9050a")


@dataclass(frozen=True)
class Robot:
    """A robot of a repository."""

    #: `name`, `has`: what it is called, and what of it is read
    name: str
    has: str
    #: repository and commit
    source: tuple[str, str]
    #: its file
    path: str


def _parallel(name: str, path: str) -> Robot:
    return Robot(name, "loops, by `--loop`", PARALLEL, f"robots/{path}/robot.urdf")


def _open(name: str, path: str) -> Robot:
    """One whose frames of loops are far apart as drawn, up to 0.6 m, or whose loops are singular there."""
    return Robot(name, "tree, without its loops", PARALLEL, f"robots/{path}/robot.urdf")


ROBOTS = (
    Robot("Cassie", "loops, springs", MENAGERIE, "agility_cassie/cassie.xml"),
    Robot("Robotiq 2F-85", "loops, coupling, springs", MENAGERIE, "robotiq_2f85/2f85.xml"),
    Robot("Panda", "coupling, tendon", MENAGERIE, "franka_emika_panda/panda.xml"),
    Robot("Shadow Hand", "tendons", MENAGERIE, "shadow_hand/right_hand.xml"),
    Robot("ROBOTIS OP3", "tree", MENAGERIE, "robotis_op3/op3.xml"),
    Robot("Open Duck Mini", "lost motion", DUCK, "playground/open_duck_mini_v2/xmls/open_duck_mini_v2_backlash.xml"),
    Robot("spherical manipulator, MJCF", "loops", PLACO, "models/spm/robot.xml"),
    Robot("manipulator of dm_control", "coupled tendons, springs", SUITE, "dm_control/suite/manipulator.xml"),
    Robot("fish of dm_control", "tendons, springs", SUITE, "dm_control/suite/fish.xml"),
    Robot("humanoid of dm_control", "tendons, springs", SUITE, "dm_control/suite/humanoid.xml"),
    Robot("dog of dm_control", "tendons, springs", SUITE, "dm_control/suite/dog.xml"),
    Robot("Allegro Hand", "tree, of which meshes are missing", UNILAB, f"{ASSETS}/allegro_hand/allegro_right.xml"),
    Robot("Sharpa Wave", "tree, of which meshes are missing", UNILAB, f"{ASSETS}/sharpa_wave/right_sharpa_wave.xml"),
    Robot("planar 2-dof arm", "loop of coinciding links", PLACO, "models/planar-2dof/robot.urdf"),
    Robot("Orbita", "loops of coinciding links", PLACO, "models/orbita/robot.urdf"),
    Robot("spherical manipulator", "loops of coinciding links", PLACO, "models/spm/robot.urdf"),
    Robot("Inspire hand", "mimic joints", HANDS, "robots/hands/inspire_hand/inspire_hand_right.urdf"),
    Robot("Ability Hand", "mimic joints", HANDS, "robots/hands/ability_hand/ability_hand_right.urdf"),
    Robot("Schunk SVH", "mimic joints", HANDS, "robots/hands/schunk_hand/schunk_svh_hand_right.urdf"),
    Robot("Barrett hand", "tree", HANDS, "robots/hands/barrett_hand/bhand_model.urdf"),
    Robot("Panda gripper", "mimic joint", HANDS, "robots/hands/panda_gripper/panda_gripper_glb.urdf"),
    Robot("RM75 with Inspire hand", "mimic joints", HANDS, "robots/assembly/rm75_inspire/rm75_inspire_right_hand.urdf"),
    Robot(
        "xArm7 with Ability Hand", "mimic joints", HANDS, "robots/assembly/xarm7_ability/xarm7_ability_right_hand.urdf"
    ),
    _parallel("5-bar linkage", "5bar_linkage"),
    _open("leg like Cassie", "cassie_like"),
    _open("leg like Digit", "digit_like"),
    _open("leg like TALOS", "talos_like"),
    _open("leg like Kangaroo", "kangaroo_like"),
    _open("WL-16", "wl16_like"),
    _parallel("Delta", "robot_delta"),
    _open("Disney robot", "disney_robot"),
    _open("Battobot", "battobot_6d"),
)


def _git(folder: Path, *arguments: str) -> bytes:
    return subprocess.run(["git", "-C", str(folder), *arguments], check=True, capture_output=True).stdout


def _fetched(robot: Robot, folder: Path, into: Path) -> Path:
    """The file of a robot, with the texts beside it."""
    owner, commit = robot.source
    place = folder / owner.replace("/", "+")
    if not place.exists():
        folder.mkdir(parents=True, exist_ok=True)
        # One that was broken off is not taken for whole.
        with tempfile.TemporaryDirectory(dir=folder) as made:
            whole = Path(made) / place.name
            clone = ["git", "clone", "-q", "--bare", "--filter=blob:limit=1m", f"{HOST}/{owner}", str(whole)]
            subprocess.run(clone, check=True)
            whole.rename(place)
    base = str(Path(robot.path).parent)
    listed = _git(place, "ls-tree", "-r", "-z", "--name-only", commit, f"{base}/").decode().split("\0")
    # Of models in parts.
    shared = _git(place, "ls-tree", "-z", "--name-only", commit, f"{base}/common/").decode().split("\0")
    for name in {*listed, *shared}:
        if name.endswith((".xml", ".urdf")):
            (into / name).parent.mkdir(parents=True, exist_ok=True)
            (into / name).write_bytes(_git(place, "show", f"{commit}:{name}"))
    return into / robot.path


def _balls(path: Path) -> list[tuple[str, str]]:
    """Pairs of links that coincide: by the names of onshape-to-robot, or those that joints of a loop carry.

    Joints ...A_frame and ...B_frame are those of robots that are not drawn closed.
    """
    text = path.read_text(encoding="utf-8")
    links = re.findall(r'<link\s+name="([^"]+)"', text)
    found = [(link, f"{link[:-1]}2") for link in links if re.fullmatch(r"closing_.*_1", link)]
    carried = dict(re.findall(r'<joint\s+name="([^"]*closedloop[^"]*)".*?<child\s+link="([^"]+)"', text, re.DOTALL))
    return found + [(link, carried[f"{name[:-1]}B"]) for name, link in carried.items() if name.endswith("A")]


def _rods(m: jp.Mechanism) -> list[str]:
    """Rods between two balls, whose spin jointplay neither counts nor decides."""
    kinds: dict[str, list[str]] = {}
    for joint in m.data.joints.values():
        for body in joint.on or joint.bodies or ():
            kinds.setdefault(body, []).append(joint.type)
    return [name for name in m.bodies if kinds[name] == ["spherical"] * 2]


def _difference(m: jp.Mechanism, got: Any, want: dict[str, Any]) -> float:
    """Largest difference of a pose, m and parts of a unit vector."""
    worst, spinning = 0.0, _rods(m)
    for name, pose in zip(m.bodies, got, strict=True):
        if name in want:
            at, axes = want[name]
            turned = 0.0 if name in spinning else np.abs(poses.matrix(pose) - axes).max()
            worst = max(worst, np.abs(pose[:3] - at).max(), turned)
    return worst


def is_right(row: dict[str, Any]) -> bool:
    """Whether all poses were found and agree, as far as loops of the drawing fit one another, and so do the counts."""
    close = row["difference"] <= SAME + 100 * row["open"]
    return bool(close and row["poses"] == POSES and row["by the other"] == [row["degrees of freedom"]])


def compared(robot: Robot, path: Path) -> dict[str, Any]:
    """A row of the numbers."""
    oracle: Any
    if path.suffix == ".urdf":
        balls = _balls(path)
        loops = {
            f"ball{k}": {"type": "spherical", "on": {one: [0, 0, 0], other: [0, 0, 0]}}
            for k, (one, other) in enumerate(balls)
            if not one.startswith("closing_")
        }
        m = imported(path, Options(loops=loops)).mechanism
        oracle = Pinocchio(path, balls)
    else:
        found = imported(path, Options())
        m = found.mechanism
        # Lost motion of the Open Duck Mini is drawn in its middle.
        lost = re.findall(r'<joint name="(\w+_backlash)"', path.read_text(encoding="utf-8"))
        oracle = MuJoCo(path, dict.fromkeys(lost, 0.0))
    assert m.drive_values is not None
    checked = jp.check(m).attrs
    random = np.random.default_rng(1)
    has_loops = len(m.joints) > len(m.bodies)
    first = m.drive_values[0]
    start = m.core.trace(np.ascontiguousarray(first[None]))["poses"][0]
    for _ in range(STARTS):
        drawn = oracle.poses(dict(coordinates(m, first)))
        if drawn is not None and _difference(m, start, drawn) < SAME + 100 * oracle.open:
            break
        oracle.scatter(random)
    worst, open_, solved, freedoms = 0.0, 0.0, 0, set()
    for _ in range(POSES):
        values = first + random.uniform(-1, 1, len(first)) * (NEAR if has_loops else FAR)
        want = oracle.poses(dict(coordinates(m, values)))
        way = first + np.linspace(0, 1, 9)[:, None] * (values - first)
        got = m.core.trace(np.ascontiguousarray(way))["poses"][-1]
        if want is None or not np.isfinite(got).all():
            print(f"   {robot.name}: no pose by", "the other" if want is None else "jointplay")
            continue
        solved += 1
        freedoms.add(oracle.freedoms() - len(_rods(m)))
        open_ = max(open_, oracle.open)
        worst = max(worst, _difference(m, got, want))
    return {
        "robot": robot.name,
        "has": robot.has,
        "source": f"{HOST}/{robot.source[0]}/blob/{robot.source[1]}/{robot.path}",
        "engine": type(oracle).__name__,
        "bodies": len(m.bodies),
        "degrees of freedom": int(checked["degrees_of_freedom"]),
        "by the other": sorted(freedoms),
        "poses": solved,
        "difference": float(f"{worst:.1e}"),
        "open": float(f"{open_:.1e}"),
    }


def main(folder: Path, names: list[str]) -> int:
    """Print the rows, and write them; return how many are wrong."""
    rows = []
    for robot in ROBOTS:
        if names and robot.name not in names:
            continue
        with tempfile.TemporaryDirectory() as into:
            row = compared(robot, _fetched(robot, folder, Path(into)))
        rows.append(row)
        print(*row.values(), "" if is_right(row) else "WRONG", sep="  ", flush=True)
    if not names:
        made = [f"{name} {version(name)}" for name in ("mujoco-core", "pin")]
        NUMBERS.write_text(json.dumps({"made": made, "robots": rows}, indent=1) + "\n", encoding="utf-8")
    return sum(not is_right(row) for row in rows)


if __name__ == "__main__":
    sys.exit(int(bool(main(Path(sys.argv[1] if len(sys.argv) > 1 else "build/robots"), sys.argv[2:]))))
