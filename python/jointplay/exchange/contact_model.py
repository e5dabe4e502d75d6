"""What models of MuJoCo have in common in the plane and in space: settings, masses, forces and the output.

Contact in MuJoCo is soft. With the stiffest one it has, the penetration at rest under a force F on a mass m is of the
order 4e-4 (F / m) dt^2; the time step dt is a small part of the period in which a pin swings in its hole under the
load, 2 pi / w with w^2 = F / (m c), so that the penetration is some 1e-7 of c whatever the units. Drag proportional to
mass with the rate 2 w lets the model come to rest; a study of dynamics takes it away (the attributes `damping`).
"""

import math
from collections.abc import Iterator, Sequence
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.compile import inertia_matrix
from jointplay.core.sets import BOUNDS
from jointplay.core.spec import ENDS, LoadSpec
from jointplay.errors import InputError, listed, one_line
from jointplay.model.mechanism import Mechanism

#: boxes of a ring: the corner that a load finds is at most a degree beside it
PIECES = 180
#: radius of a pin and thickness of a ring as parts of the size of the mechanism; neither has an influence
PIN, WALL = 0.03, 0.02
#: mass of a body without one: that of a steel bar of this section, m^2
BAR = 1e-4 * 7850.0
#: least moment of inertia of a body as a part of its largest one
SLIM = 1e-3
#: the same as a part of the largest mass: the solver loses digits with their ratio
LEAST = 0.01
#: time step as a part of 1 / w
STEP = 0.02
#: the stiffest contact
HARDEST = "0.9999 0.9999 0.001 0.5 2"
GRAVITY = 9.81
#: name of the ground in MuJoCo
WORLD = "world"


def text_of(values: object) -> str:
    """Numbers with blanks between them."""
    return " ".join(f"{float(x):.12g}" for x in np.atleast_1d(np.asarray(values, dtype=np.float64)))


def in_space(values: Sequence[float]) -> Floats:
    """A vector in space of one in the plane or in space."""
    return np.array([*values, 0.0])[:3]


class Model:
    """One mechanism on its way to a model; the plane or space says what is solid in it."""

    #: classes of solids: what they touch by themselves, and their colours
    SOLIDS: tuple[tuple[str, str, str, str], ...]

    def __init__(self, m: Mechanism, drives: Floats, poses: Floats, pieces: int) -> None:
        self.m, self.drives, self.poses, self.pieces = m, drives, poses, pieces
        self.spec = m.core_spec
        self.size = m.length
        self.radius, self.wall = PIN * self.size, WALL * self.size
        self.plays = {
            s["joint"]: next(iter(s["set"].values()))
            for s in self.spec["sources"]
            if s["kind"] == "clearance" and "joint" in s
        }
        self.given = [m.data.bodies[name].mass if name in m.data.bodies else 0.0 for name in m.bodies]
        least = LEAST * max(self.given, default=0.0)
        self.masses = [mass or max(least, BAR * self.length(k)) for k, mass in enumerate(self.given)]
        self.moments = [self._moments(k) for k in range(len(m.bodies))]
        #: the largest of them, about any axis
        self.spins = [float(np.linalg.eigvalsh(moments)[-1]) for moments in self.moments]
        self.rate = self._rate()
        self.root = ET.Element("mujoco", model=one_line(m.title) or "mechanism")
        self.world = self.equality = self.tendon = self.contact = self.root
        self.bodies: dict[int, Element] = {}

    # --- what the plane and space do by themselves ------------------------------------------------------------------

    def add_bodies(self) -> None:
        """The bodies with their freedoms."""
        raise NotImplementedError

    def add_joint(self, number: int) -> None:
        """What holds the bodies of a joint together."""
        raise NotImplementedError

    # --- sizes ------------------------------------------------------------------------------------------------------

    def length(self, body: int) -> float:
        """Extent of the joints of a body."""
        points = np.array([point["at"] for point in self.spec["points"] if point["body"] == body])
        return max(float(np.ptp(points, axis=0).max()), 0.1 * self.size)

    def centre(self, body: int) -> Floats:
        """Its centre of mass: without a mass the middle of its joints."""
        name = self.m.bodies[body]
        if name in self.m.data.bodies and self.given[body]:
            return in_space(self.m.data.bodies[name].centre) * self.m.units.length
        points = [point["at"] for point in self.spec["points"] if point["body"] == body]
        return np.mean(points, axis=0) if points else np.zeros(3)

    def _moments(self, body: int) -> Floats:
        """Its moments of inertia about the centre of mass: without any those of a bar that is as thick as high."""
        bar = self.masses[body] * self.length(body) ** 2 / 12
        name = self.m.bodies[body]
        table = self.m.data.bodies.get(name)
        if table is None or table.rotational_inertia is None:
            return bar * np.eye(3)
        given = inertia_matrix(table) * self.m.units.length**2
        if not isinstance(table.rotational_inertia, tuple):
            # That about the normal of the plane counts.
            return max(float(given[2, 2]), SLIM * bar) * np.eye(3)
        # MuJoCo has no body without a moment about an axis, such as a slim rod.
        sizes, ways = np.linalg.eigh(given)
        return np.asarray(ways * np.maximum(sizes, SLIM * max(float(sizes[-1]), bar)) @ ways.T)

    def _rate(self) -> float:
        """w of a pin in the smallest hole that all forces press with all masses."""
        gravity = float(np.linalg.norm(self.m.data.gravity or (0.0, 0.0)))
        force = sum(float(np.linalg.norm(load["force"])) for load in self._loads()) + gravity * sum(self.given)
        sizes = [play.get(key, 0.0) for play in self.plays.values() for key in BOUNDS]
        plays = [size for size in sizes if size > 0]
        mass = sum(self.masses)
        return math.sqrt((force or GRAVITY * mass) / mass / min(plays, default=1e-3 * self.size))

    def _loads(self) -> list[LoadSpec]:
        """Loads without weights, which follow from masses here."""
        return self.spec["loads"][: len(self.m.data.loads)]

    # --- the model --------------------------------------------------------------------------------------------------

    def text(self) -> str:
        """The whole of it."""
        root = self.root
        for sentence in self._remarks():
            # Two hyphens would end it.
            root.append(ET.Comment(f" {one_line(sentence).replace('--', '- -')} "))
        SubElement(root, "compiler", angle="radian", autolimits="true")
        self._settings()
        self.world = SubElement(root, "worldbody")
        SubElement(self.world, "light", pos=text_of([0, 0, 10 * self.size]))
        SubElement(self.world, "site", name="ground")
        self.contact, self.equality, self.tendon = (SubElement(root, x) for x in ("contact", "equality", "tendon"))
        self.add_bodies()
        for number in range(len(self.spec["joints"])):
            self.add_joint(number)
        self._springs()
        self._loads_on_sites()
        self._output()
        for element in [e for e in root if e.tag in ("contact", "equality", "tendon", "actuator") and not len(e)]:
            root.remove(element)
        ET.indent(root)
        return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"

    def _output(self) -> None:
        point = self.spec["points"][self.spec["output"]["point"]]
        self.add_site(point["body"], "output", point["at"])
        onlooker = self.spec["output"].get("relative_to", -1)
        more = {"reftype": "xbody", "refname": self.m.bodies[onlooker]} if onlooker >= 0 else {}
        sensor = SubElement(self.root, "sensor")
        SubElement(sensor, "framepos", {"name": "output", "objtype": "site", "objname": "output", **more})

    def _settings(self) -> None:
        step = STEP / self.rate
        gravity = text_of(in_space(self.m.data.gravity or (0.0, 0.0)))
        options = {"integrator": "implicitfast", "tolerance": "1e-14"}
        SubElement(self.root, "option", {"timestep": text_of(step), "gravity": gravity, **options})
        default = SubElement(self.root, "default")
        hard = {"solref": text_of([2 * step, 1.0]), "solimp": HARDEST}
        SubElement(default, "geom", {"condim": "1", "contype": "0", "conaffinity": "0", "mass": "0", **hard})
        SubElement(default, "pair", {"condim": "1", **hard})
        SubElement(default, "equality", hard)
        SubElement(default, "tendon", {f"{key}limit": value for key, value in hard.items()})
        for name, kind, mask, colour in self.SOLIDS:
            inner = SubElement(default, "default", {"class": name})
            SubElement(inner, "geom", contype=kind, conaffinity=mask, rgba=colour)

    def _remarks(self) -> Iterator[str]:
        held = zip(self.m.drives, self.drives / self.m.drive_factors, strict=True)
        drives = ", ".join(f"{name} = {value:.10g}" for name, value in held)
        yield f"Exported from {self.m.file}: lengths in m, masses in kg, times in s."
        if drives:
            yield f"Drives are held at {drives}."
        yield "The damping lets it come to rest; take it away to study dynamics."
        light = [name for name, mass in zip(self.m.bodies, self.given, strict=True) if not mass]
        if light:
            yield f"No mass is given for {listed(light)}: that of a steel bar of 10 mm x 10 mm or more, without weight."
        if any(any(source["centre"]) for source in self.spec["sources"]):
            yield "Known deviations are left out."

    def add_body(self, on: Element, k: int, **place: str) -> Element:
        """A body with its mass, in another element."""
        body = self.bodies[k] = SubElement(on, "body", {"name": self.m.bodies[k], **place})
        if not self.given[k]:
            body.set("gravcomp", "1")
        mass, moments = text_of(self.masses[k]), self.moments[k]
        across = moments[[0, 0, 1], [1, 2, 2]]
        written = {"diaginertia": text_of(np.diag(moments))}
        if across.any():
            written = {"fullinertia": text_of([*np.diag(moments), *across])}
        SubElement(body, "inertial", {"pos": text_of(self.centre(k)), "mass": mass, **written})
        return body

    def on(self, body: int) -> Element:
        """The element of a body, of the ground for -1."""
        return self.world if body < 0 else self.bodies[body]

    def add_site(self, body: int, name: str, at: list[float]) -> None:
        SubElement(self.on(body), "site", name=name, pos=text_of(at))

    def add_geom(self, body: int, kind: str, **attributes: str) -> None:
        SubElement(self.on(body), "geom", {"class": kind, **attributes})

    # --- forces -----------------------------------------------------------------------------------------------------

    def _springs(self) -> None:
        for k, spring in enumerate(self.spec["springs"]):
            length = spring["free_length"] - spring["preload"] / spring["stiffness"]
            if length < 0:
                raise InputError(f"spring {k + 1} has more preload than its free length gives", file=self.m.file)
            tendon = SubElement(
                self.tendon,
                "spatial",
                name=f"spring{k}",
                stiffness=text_of(spring["stiffness"]),
                springlength=text_of(length),
            )
            for end in ENDS:
                point = self.spec["points"][spring[end]]
                self.add_site(point["body"], f"spring{k}-{end}", point["at"])
                SubElement(tendon, "site", site=f"spring{k}-{end}")

    def _loads_on_sites(self) -> None:
        """Loads as actuators that always act: a constant bias, in axes of the ground or of a body."""
        actuators = SubElement(self.root, "actuator")
        for k, load in enumerate(self._loads()):
            point = self.spec["points"][load["point"]]
            self.add_site(point["body"], f"load{k}", point["at"])
            axes = load.get("axes", -1)
            more = {} if axes == point["body"] else {"refsite": "ground"}
            if axes not in (-1, point["body"]):
                raise InputError(f"load {k} is in the axes of a third body", file=self.m.file, key=f"loads.{k}.axes")
            SubElement(
                actuators,
                "general",
                {"name": f"load{k}", "site": f"load{k}", "gear": text_of([*load["force"], *load["moment"]]), **more},
                gaintype="fixed",
                gainprm="0",
                biastype="affine",
                biasprm="1 0 0",
            )
