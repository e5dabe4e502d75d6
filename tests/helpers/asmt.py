"""Assemblies as OndselSolver writes them, from what is needed of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from helpers.freecad import Pose

#: what a line holds: lines, or a text of its own
Lines = Sequence[tuple[str, "str | Lines"]]


def indented(lines: Lines, depth: int = 0) -> str:
    found = ""
    for word, inner in lines:
        inside = [(inner, ())] if isinstance(inner, str) else inner
        found += "\t" * depth + word + "\n" + indented(inside, depth + 1)
    return found


def placed(pose: Pose) -> list[tuple[str, Lines]]:
    rows = ["\t".join(f"{x:.17g}" for x in row) for row in pose.turn.as_matrix()]
    at = "\t".join(f"{x:.17g}" for x in pose.at)
    return [("Position3D", [(at, ())]), ("RotationMatrix", [(row, ()) for row in rows])]


@dataclass
class Assembly:
    """An assembly called `A`; a part called `A` is the assembly itself, which is fixed."""

    parts: dict[str, Pose] = field(default_factory=dict)
    markers: dict[str, list[tuple[str, Lines]]] = field(default_factory=lambda: {"A": []})
    joints: list[tuple[str, Lines]] = field(default_factory=list)
    motions: list[tuple[str, Lines]] = field(default_factory=list)
    limits: list[tuple[str, Lines]] = field(default_factory=list)
    masses: dict[str, Lines] = field(default_factory=dict)
    gravity: str = "0\t0\t0"
    times: tuple[float, float, float] = (0.0, 1.0, 0.25)

    def part(self, name: str, pose: Pose, mass: Lines = ()) -> None:
        self.parts[name] = pose
        self.markers[name] = []
        self.masses[name] = mass

    def marker(self, part: str, pose: Pose) -> str:
        name = f"M{sum(map(len, self.markers.values()))}"
        point = [*placed(Pose()), ("Markers", [("Marker", [("Name", name), *placed(pose)])])]
        self.markers[part].append(("RefPoint", point))
        return f"/A/{name}" if part == "A" else f"/A/{part}/{name}"

    def joint(self, name: str, kind: str, one: tuple[str, Pose], other: tuple[str, Pose], **values: float) -> None:
        ends = [("MarkerI", self.marker(*one)), ("MarkerJ", self.marker(*other))]
        self.joints.append((kind, [("Name", name), *ends, *((word, f"{x:.17g}") for word, x in values.items())]))

    def motion(self, joint: str, formula: str, kind: str = "Rotation") -> None:
        inside = [("Name", f"motion-{joint}"), ("MotionJoint", f"/A/{joint}"), (f"{kind}Z", formula)]
        self.motions.append((f"{kind}alMotion", inside))

    def limit(self, joint: str, formula: str, kind: str, sign: str) -> None:
        named = [("Name", f"limit-{joint}"), ("MotionJoint", f"/A/{joint}")]
        self.limits.append((f"{kind}Limit", [*named, ("Limit", formula), ("Type", sign), ("Tol", "1e-9")]))

    def text(self) -> str:
        parts = [
            (
                "Part",
                [
                    ("Name", name),
                    *placed(pose),
                    ("FeatureOrder", ()),
                    ("PrincipalMassMarker", self.masses[name]),
                    ("RefPoints", self.markers[name]),
                ],
            )
            for name, pose in self.parts.items()
        ]
        sets = [("Joints", self.joints), ("Motions", self.motions), ("Limits", self.limits)]
        times: Mapping[str, float] = dict(zip(("tstart", "tend", "hout"), self.times, strict=True))
        inside = [
            ("Notes", "''"),
            ("Name", "A"),
            *placed(Pose()),
            ("RefPoints", self.markers["A"]),
            ("Parts", parts),
            ("KinematicIJs", ()),
            ("ConstraintSets", [*sets, ("GeneralConstraintSets", ())]),
            ("ForceTorques", ()),
            ("ConstantGravity", self.gravity),
            ("SimulationParameters", [(word, f"{x:.17g}") for word, x in times.items()]),
        ]
        return indented([("OndselSolver", ()), ("Assembly", inside)]) + "TimeSeries\nNumber\tInput\t1\n"
