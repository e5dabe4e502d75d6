"""Random planar linkages with gears, rings, belts, racks and motors of two joints, drawn for the tests of couplings."""

import numpy as np

from helpers.couplings import GROUND, Machine

TURN = 2 * np.pi
#: half of the module: pitch radius of one tooth
TOOTH = 0.0005


class _Drawer:
    def __init__(self, seed, play, flanks):
        self.chance = np.random.default_rng(seed)
        self.play, self.flanks = play, flanks
        self.m = Machine(length=0.05)
        self.poses = []
        #: revolute joints that can carry wheels: (body, other body, place)
        self.pivots = []

    def uniform(self, low, high):
        return float(self.chance.uniform(low, high))

    def size(self, low, high):
        return float(np.exp(self.uniform(np.log(low), np.log(high))))

    def maybe(self, probability):
        return bool(self.chance.random() < probability)

    def body(self, near):
        pose = (*(np.asarray(near) + self.chance.uniform(-0.01, 0.01, 2)), self.uniform(-3, 3))
        self.poses.append(pose)
        return self.m.body(*pose)

    def local(self, body, place):
        """A place of the drawing in the axes of a body."""
        if body == GROUND:
            return tuple(place)
        x, y, angle = self.poses[body]
        turned = (complex(*place) - complex(x, y)) * np.exp(-1j * angle)
        return turned.real, turned.imag

    def direction(self, body, angle):
        angle -= 0.0 if body == GROUND else self.poses[body][2]
        return (float(np.cos(angle)), float(np.sin(angle)), 0.0)

    def joint(self, kind, first, second, place, other=None, along=None, **more):
        """A joint at a place of the drawing (a coupling at two), along a direction of it."""
        other = place if other is None else other
        number = self.m.joint(kind, (first, self.local(first, place)), (second, self.local(second, other)), **more)
        if along is not None:
            self.m.joints[number]["axis_first"] = self.direction(first, along)
            if kind == "prismatic":
                self.m.joints[number]["axis_second"] = self.direction(second, along)
        return number

    def pin(self, first, second, place):
        number = self.joint("revolute", first, second, place)
        if self.maybe(0.7):
            self.m.source("clearance", {"disc": {"radius": self.play * self.size(1e-5, 3e-4)}}, joint=number)
        self.pivots += [(second, first, tuple(place)), (first, second, tuple(place))]
        return number

    def guide(self, first, second, place, angle):
        number = self.joint("prismatic", first, second, place, along=angle)
        if self.maybe(0.7):
            gap = self.play * self.size(1e-5, 1e-4)
            self.m.source("clearance", {"diamond": {"gap": gap, "half_length": 0.02}}, joint=number)
        return number

    def mesh(self, kind, first, second, place, other, radii, teeth=(0, 0), **told):
        number = self.joint(kind, first, second, place, other, radii=list(radii), teeth=list(teeth), **told)
        if kind == "rack":
            del self.m.joints[number]["coupling"]["teeth"]
        smallest = min(r for r in radii if r)
        if self.flanks and self.maybe(0.8):
            low, high = (self.flanks * self.play * self.uniform(0.005, 0.025) * smallest for _ in range(2))
            high = low if kind != "belt" else high
            self.m.source("clearance", (-low, high), joint=number)
        if self.maybe(0.4):
            deviation = self.play * self.uniform(-2e-5, 2e-5)
            self.m.source("ratio", self.play * self.uniform(1e-6, 2e-5), joint=number, centre=[deviation])
        for second_wheel in (False, True):
            if self.maybe(0.3) and (second_wheel or kind != "rack"):
                size = {"disc": {"radius": self.play * self.uniform(1e-6, 2e-5)}}
                centre = list(map(float, self.play * self.chance.uniform(-1e-5, 1e-5, 2)))
                wheel = self.m.joints[number]["second" if second_wheel else "first"]
                self.m.displacements.append({"points": [wheel], "about": self.m.points[wheel]["at"]})
                ways = [[[1.0, 0.0, 0.0], [0.0] * 3], [[0.0, 1.0, 0.0], [0.0] * 3]]
                told = {"displacement": len(self.m.displacements) - 1, "components": ["x", "y"], "ways": ways}
                self.m.source("place", size, centre=centre, **told)
        return number

    def any_pivot(self):
        return self.pivots[self.chance.integers(len(self.pivots))]

    # what is added: bodies that have no freedom of their own

    def wheel(self):
        """A wheel on the body that carries another one, or on one that turns in a fixed wheel."""
        wheel, carrier, place = self.any_pivot()
        kind = str(self.chance.choice(["gear", "ring", "inside", "belt", "crossed"]))
        z1, z2 = (int(z) for z in self.chance.integers(14, 40, 2))
        if kind == "ring":
            z2 += z1
        if kind == "inside":
            z1 += z2
        r1, r2 = TOOTH * z1, TOOTH * z2
        apart = {"gear": r1 + r2, "ring": r2 - r1, "inside": r1 - r2}.get(kind, self.uniform(1.2, 2.5) * (r1 + r2))
        angle = self.uniform(0, TURN)
        other = np.array(place) + apart * np.array([np.cos(angle), np.sin(angle)])
        new = self.body(other)
        self.pin(carrier, new, other)
        if kind in ("belt", "crossed"):
            self.mesh("belt", wheel, new, place, other, (r1, r2), (z1, z2), crossed=kind == "crossed")
            return
        told = {"pressure_angle": self.uniform(np.radians(14.5), np.radians(25.0)), "internal": kind != "gear"}
        if kind == "inside":
            self.mesh("gear", new, wheel, other, place, (r2, r1), (z2, z1), **told)
        else:
            self.mesh("gear", wheel, new, place, other, (r1, r2), (z1, z2), **told)

    def _crank(self):
        """A body with a place on it, away from the pivot that it turns about."""
        body, _, place = next(p for p in (self.any_pivot() for _ in range(99)) if p[0] != GROUND)
        return body, np.array(place) + self._away(0.01, 0.03)

    def _away(self, low, high):
        angle = self.uniform(0, TURN)
        return self.uniform(low, high) * np.array([np.cos(angle), np.sin(angle)])

    def dyad(self):
        """Two links between two bodies, which makes a four-bar or five-bar."""
        (first, a), (second, b) = self._crank(), self._crank()
        if first == second or self.maybe(0.5):
            second, b = GROUND, a + self._away(0.03, 0.05)
        chord = b - a
        half = np.linalg.norm(chord) / 2
        tip = a + chord / 2 + self.uniform(0.8, 1.5) * (half + 0.01) * np.array([-chord[1], chord[0]]) / (2 * half)
        links = self.body(tip), self.body(tip)
        self.pin(first, links[0], a)
        self.pin(second, links[1], b)
        self.pin(*links, tip)

    def slider(self):
        """A link to a slider."""
        first, a = self._crank()
        tip = a + self._away(0.03, 0.05)
        link, slider = self.body(tip), self.body(tip)
        self.pin(first, link, a)
        self.pin(link, slider, tip)
        angle = np.arctan2(*(tip - a)[::-1]) + self.uniform(-0.7, 0.7)
        self.guide(GROUND, slider, tip + 0.01 * np.array([np.cos(angle), np.sin(angle)]), angle)

    def rack(self):
        """A rack under a wheel."""
        wheel, carrier, place = self.any_pivot()
        radius, angle = TOOTH * int(self.chance.integers(14, 40)), self.uniform(0, TURN)
        side = 1 if self.maybe(0.5) else -1
        below = np.array(place) - side * radius * np.array([-np.sin(angle), np.cos(angle)])
        bar = self.body(below)
        self.guide(carrier, bar, below, angle)
        told = {"pressure_angle": self.uniform(np.radians(14.5), np.radians(25.0)), "along": angle}
        self.mesh("rack", bar, wheel, below, place, (radius, 0.0), **told)

    def slot(self):
        """A rocker with a slot in which a pin of another body slides."""
        first, a = self._crank()
        pivot = a + self._away(0.02, 0.04)
        rocker = self.body(pivot)
        self.pin(GROUND, rocker, pivot)
        number = self.joint("pin_in_slot", rocker, first, a, along=float(np.arctan2(*(pivot - a)[::-1])))
        if self.maybe(0.7):
            self.m.source("clearance", self.play * self.uniform(1e-5, 1e-4), joint=number)

    def draw(self, parts):
        crank = self.body((0.0, 0.0))
        first = self.pin(GROUND, crank, (0.0, 0.0))
        also = []
        if self.maybe(0.25):
            place = np.array([0.0, 0.0]) + self._away(0.02, 0.04)
            arm = self.body(place)
            also = [(self.pin(crank, arm, place), self.uniform(-1, 1))]
        for part in self.chance.choice(["wheel", "wheel", "wheel", "dyad", "slider", "rack", "slot"], parts):
            getattr(self, part)()
        coefficient = self.uniform(0.5, 1.5)
        # The start is where the teeth mesh; its drive values follow from the poses.
        value = self._relative(first) / coefficient
        if also:
            also = [(also[0][0], self._relative(also[0][0]) / value)]
        drive = self.m.drive(first, coefficient=coefficient, also=also)
        if self.maybe(0.4):
            self.m.source("drive", self.play * 1e-4, drive=drive)
        moving = len(self.poses)
        for body in range(moving):
            force = tuple(self.chance.normal(0, 10, 2))
            self.m.load(body, self.chance.uniform(-0.02, 0.02, 2), force, self.uniform(-0.3, 0.3))
        self.m.output(moving - 1, self.chance.uniform(-0.02, 0.02, 2))
        return value

    def _relative(self, joint):
        ends = (self.m.points[self.m.joints[joint][end]]["body"] for end in ("first", "second"))
        first, second = (0.0 if body == GROUND else self.poses[body][2] for body in ends)
        return second - first


def drawn(seed, parts=None, play=1.0, flanks=1.0):
    """A machine and the drive value of its start; `play` scales all deviations, `flanks` the backlash besides."""
    drawer = _Drawer(seed, play, flanks)
    parts = int(drawer.chance.integers(1, 5)) if parts is None else parts
    start = drawer.draw(parts)
    return drawer.m, start
