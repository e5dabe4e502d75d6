"""MJCF, as MuJoCo compiles it: with includes, defaults and units of angles; the drawing is the reference pose `qpos0`.

MuJoCo works in a process of its own (`mujoco_child`), within bounds of time and memory, on files of the folder only.

Several joints on one body are joints in series, outermost first, with massless bodies between them. Loops are closed by
equality constraints: `connect` is a ball, `weld` fixes, `joint` couples coordinates or holds one.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from jointplay.basics import poses
from jointplay.errors import InputError, listed, one_line, require

from . import confined, mujoco_child
from .options import Options
from .skeleton import Attachment, Body, Frame, Joint, Skeleton, fixed, floating, free
from .xml import parse

#: the fixed body
WORLD = "world"
#: seconds that MuJoCo may take
LONGEST = 60.0
#: how far a weld may be off the reference pose
OFF = 1e-6


def read(path: Path, options: Options) -> Skeleton:  # noqa: ARG001 - all formats are called alike
    """A model in MJCF.

    Raises
    ------
    InputError
        When MuJoCo is not installed or refuses the file, or when it names files outside of its folder.
    """
    # What is no XML is said as of any other file.
    parse(path, "mujoco", "MJCF")
    name = one_line(str(path))
    require("mujoco", "robots", "MJCF")
    confined.check(path, "MJCF file")
    return _Reading(name, path.stem, _compiled(path, name)).skeleton()


def _compiled(path: Path, name: str) -> dict[str, Any]:
    """What MuJoCo makes of a file."""
    bounds = f"{LONGEST:g} s and {mujoco_child.MEMORY / 1e9:g} GB are there for it"
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        output = Path(folder, "found.json")
        command = [sys.executable, "-P", mujoco_child.__file__, str(Path.cwd() / path), str(output)]
        try:
            subprocess.run(
                command,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=LONGEST,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise InputError(f"MuJoCo takes too long to compile it: {bounds}", file=name) from None
        except OSError as error:
            raise InputError(f"MuJoCo cannot be started: {error.strerror or error}", file=name) from None
        found: dict[str, Any] = json.loads(output.read_text(encoding="utf-8")) if output.is_file() else {}
    if "problem" in found:
        raise InputError(one_line(found["problem"]), file=name)
    if "bodies" not in found:
        # It ended without a word, or for want of memory.
        raise InputError(f"MuJoCo gives up on it: {bounds}", file=name)
    return found


def _all_named(names: list[str], word: str) -> list[str]:
    """The names, and for things without one the word with their number, which no other thing is called."""
    found = list(names)
    for k, name in enumerate(names):
        if not name:
            found[k] = free(f"{word}{k}", names)
    return found


class _Reading:
    """One model on its way to a skeleton."""

    def __init__(self, file: str, stem: str, found: dict[str, Any]) -> None:
        self.file, self.stem, self.found = file, stem, found
        self.bodies, self.joints, self.sites = found["bodies"], found["joints"], found["sites"]
        self.notes = [
            *(["Files of meshes are missing: masses that follow from them are missing as well."] * found["meshless"])
        ]
        self.notes += [f"MuJoCo: {one_line(line)}" for line in found["said"]]
        self.names = _all_named([WORLD, *(body["name"] for body in self.bodies[1:])], "body")
        self.joint_names = _all_named([joint["name"] for joint in self.joints], "joint")

    def skeleton(self) -> Skeleton:
        """All of it."""
        bodies: dict[str, Body] = {WORLD: Body()}
        joints: list[Joint] = []
        own: dict[int, list[int]] = {}
        for j, joint in enumerate(self.joints):
            own.setdefault(joint["body"], []).append(j)
        for k, body in enumerate(self.bodies[1:], 1):
            frame = _frame(body)
            moving = [j for j in own.get(k, []) if self.joints[j]["kind"] != "FREE"]
            chain = [self.names[body["parent"]]]
            for j in moving[:-1]:
                chain.append(free(f"{self.names[k]}-{self.joint_names[j]}", {*self.names, *bodies, *chain}))
            chain.append(self.names[k])
            bodies |= {between: Body(frame) for between in chain[1:-1]}
            turn = frame.axes @ poses.matrix(np.array([0.0, 0.0, 0.0, *body["moments_turned"]]))
            about = turn @ np.diag(body["moments"]) @ turn.T
            bodies[self.names[k]] = Body(frame, body["mass"], frame.point(np.array(body["centre"])), about)
            for j, one, other in zip(moving, chain, chain[1:], strict=False):
                joints.append(self._joint(j, one, other))
            if k not in own:
                joints.append(fixed(chain[0], self.names[k]))
        joints = list(self._constrained(joints))
        held = [group[0] for group in floating(bodies, joints, WORLD)]
        joints += [fixed(WORLD, name) for name in held]
        if held:
            self.notes.append(f"Free joints are left out, so that these bodies are held: {listed(held)}.")
        if self.found["left_out"]:
            self.notes.insert(0, f"Left out: {', '.join(self.found['left_out'])}.")
        moved = [name for name, body in zip(self.names, self.bodies, strict=True) if body["moved"]]
        if moved:
            self.notes.append(f"Bodies that a program moves (mocap) are held: {listed(moved)}.")
        gx, gy, gz = self.found["gravity"]
        return Skeleton(
            title=str(self.found["title"] or self.stem),
            bodies=bodies,
            joints=tuple(joints),
            ground=WORLD,
            frames={
                site["name"]: (self.names[site["body"]], _frame(site))
                for site in self.sites
                if site["name"] and site["name"] not in bodies
            },
            gravity=(gx, gy, gz),
            notes=tuple(self.notes),
        )

    def _joint(self, j: int, one: str, other: str) -> Joint:
        joint, name = self.joints[j], self.joint_names[j]
        at = np.array(joint["at"])
        if joint["kind"] == "BALL":
            return Joint(name, "spherical", (one, other), Attachment(at))
        if joint["held"] is not None:
            return Joint(name, "fixed", (one, other), Attachment(at))
        low, high = joint["range"]
        return Joint(
            name=name,
            kind="revolute" if joint["kind"] == "HINGE" else "prismatic",
            bodies=(one, other),
            place=Attachment(at, np.array(joint["axis"])),
            coordinate=joint["zero"],
            limits=(low, high) if joint["limited"] and self.found["limits"] else None,
            is_driven=j in self.found["driven"],
            spring=(joint["stiffness"], joint["rest"]) if joint["stiffness"] > 0 else None,
        )

    # --- equality constraints ---------------------------------------------------------------------------------------

    def _constrained(self, joints: list[Joint]) -> Iterator[Joint]:
        """The joints with what equality constraints add: laws, and joints that close loops."""
        laws: dict[str, tuple[str, float, float]] = {}
        curves: dict[str, tuple[str, tuple[float, ...]]] = {}
        closing: list[Joint] = []
        ignored = []
        for k, equality in enumerate(self.found["equalities"]):
            # A joint may have the same name.
            taken = {*self.joint_names, *(one.name for one in closing)}
            name, kind, ends = free(equality["name"] or f"equality{k}", taken), equality["kind"], equality["ends"]
            if not equality["active"]:
                ignored.append(f"{name} (not active)")
            elif kind == "CONNECT":
                closing.append(self._connect(equality, name))
            elif kind == "WELD":
                closing.append(self._weld(equality, name))
            elif kind == "JOINT" and all(self.joints[j]["held"] is not None for j in ends if j >= 0):
                continue
            elif kind == "JOINT" and ends[1] >= 0 and _is_ratio(equality):
                zero, ahead = (self.joints[j]["zero"] for j in ends)
                offset, factor = equality["data"][:2]
                follower, leader = (self.joint_names[j] for j in ends)
                laws[follower] = leader, factor, zero + offset - factor * ahead
            elif kind == "JOINT" and ends[1] >= 0 and any(equality["data"][1:5]):
                zero, ahead = (self.joints[j]["zero"] for j in ends)
                curve = zero + Polynomial(equality["data"][:5])(Polynomial([-ahead, 1.0]))
                follower, leader = (self.joint_names[j] for j in ends)
                curves[follower] = leader, tuple(curve.coef.tolist())
            else:
                ignored.append(name)
        if ignored:
            self.notes.append(f"Equality constraints that are left out: {listed(ignored)}.")
        held = [name for name, joint in zip(self.joint_names, self.joints, strict=True) if joint["held"] is not None]
        if held:
            self.notes.append(f"Equality constraints hold these joints, which are fixed: {listed(held)}.")
        for joint in joints:
            yield replace(joint, follows=laws.get(joint.name), curve=curves.get(joint.name))
        yield from closing

    def _ends(self, equality: dict[str, Any]) -> tuple[tuple[int, Frame], tuple[int, Frame]]:
        """The two bodies, or the sites that are named instead, with their frames."""
        found = []
        for number in equality["ends"]:
            if equality["on_sites"]:
                found.append((self.sites[number]["body"], _frame(self.sites[number])))
            else:
                found.append((number, _frame(self.bodies[number])))
        return found[0], found[1]

    def _connect(self, equality: dict[str, Any], name: str) -> Joint:
        (one, first), (other, second) = self._ends(equality)
        places = [Attachment(first.at), Attachment(second.at)]
        if not equality["on_sites"]:
            anchors = np.array(equality["data"])
            places = [Attachment(first.point(anchors[:3])), Attachment(second.point(anchors[3:6]))]
        is_closed = np.abs(places[0].at - places[1].at).max() < OFF
        bodies = (self.names[one], self.names[other])
        return Joint(name, "spherical", bodies, places[0], None if is_closed else places[1])

    def _weld(self, equality: dict[str, Any], name: str) -> Joint:
        (one, first), (other, second) = self._ends(equality)
        wanted = first
        if not equality["on_sites"]:
            # The anchor is in axes of the second body; where it is on the first one follows from the relative pose.
            anchor, at, turn = np.split(np.array(equality["data"][:10]), (3, 6))
            axes = poses.matrix(np.concatenate([np.zeros(3), turn / np.linalg.norm(turn)]))
            wanted = first @ Frame(at - axes @ anchor, axes)
        if np.abs(wanted.at - second.at).max() > OFF or np.abs(wanted.axes - second.axes).max() > OFF:
            problem = "holds its bodies in another pose than the reference pose; make the two agree"
            raise InputError(problem, file=self.file, key=f"weld '{name}'")
        return Joint(name, "fixed", (self.names[one], self.names[other]), Attachment(first.at))


def _frame(placed: dict[str, Any]) -> Frame:
    return Frame(np.array(placed["at"]), np.array(placed["axes"]))


def _is_ratio(equality: dict[str, Any]) -> bool:
    """Whether a polynomial of one joint in another one has no powers, and a factor."""
    factor, *powers = equality["data"][1:5]
    return bool(factor) and not any(powers)
