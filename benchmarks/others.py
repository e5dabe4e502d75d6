"""Programs that solve mechanisms: CasADi's generated C, pinocchio, pylinkage."""

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from closed_form import BUILD, compiled, linkage, pointer
from harness import Contender
from revolute import Revolute
from scatter import Problem, problem, sigma_words

Array = NDArray[np.float64]

#: calls CasADi's function sample by sample: Newton from the nominal pose
LOOP = """
#include "%(name)s.c"
void solve(long n, long n_u, const double *nominal, const double *u, double *out) {
    double x[%(size)d], next[%(size)d], w[%(work)d];
    long long iw[%(integers)d];
    for (long i = 0; i < n; i++) {
        for (int k = 0; k < %(size)d; k++) x[k] = nominal[k];
        for (int it = 0; it < 8; it++) {
            double largest = 0;
            const double *in[2] = {x, u + i * n_u};
            double *to[1] = {next};
            newton_step(in, to, iw, w, 0);
            for (int k = 0; k < %(size)d; k++) {
                double d = next[k] > x[k] ? next[k] - x[k] : x[k] - next[k];
                if (d > largest) largest = d;
                x[k] = next[k];
            }
            if (largest < 1e-9) break;
        }
        const double *in[2] = {x, u + i * n_u};
        double *to[1] = {out + 3 * i};
        output_error(in, to, iw, w, 0);
    }
}
"""


def in_casadi(model: Revolute, name: str) -> Callable[[Array], Array]:
    """One Newton step, its linear solve expanded by CasADi, as C; compiled with the same flags as the limit."""
    import casadi as ca

    x, u = ca.SX.sym("x", model.size), ca.SX.sym("u", 2 * model.joints + len(model.moved))
    at = [ca.SX(ca.DM(row)) for row in model.at]
    for k, point in enumerate(model.moved):
        at[point] += u[2 * model.joints + k] * ca.DM(model.direction[k])

    def place(point: int) -> Any:
        body = int(model.body[point])
        if body < 0:
            return at[point]
        c, s = ca.cos(x[3 * body + 2]), ca.sin(x[3 * body + 2])
        return x[3 * body : 3 * body + 2] + ca.vertcat(
            c * at[point][0] - s * at[point][1], s * at[point][0] + c * at[point][1]
        )

    def angle(point: int) -> Any:
        body = int(model.body[point])
        return x[3 * body + 2] if body >= 0 else 0

    pairs = list(zip(model.first, model.second, strict=True))
    rows = [place(b) - place(a) - u[2 * k : 2 * k + 2] for k, (a, b) in enumerate(pairs)]
    rows += [angle(pairs[k][1]) - angle(pairs[k][0]) - q for k, q in zip(model.driven, model.drives, strict=True)]
    residual = ca.vertcat(*rows)
    step = ca.Function("newton_step", [x, u], [x - ca.solve(ca.jacobian(residual, x), residual)])
    error = ca.vertcat(place(model.output), angle(model.output)) - ca.DM(model.nominal_output)
    generator = ca.CodeGenerator(f"{name}.c")
    generator.add(step)
    generator.add(ca.Function("output_error", [x, u], [error]))
    BUILD.mkdir(parents=True, exist_ok=True)
    generator.generate(f"{BUILD}/")
    loop = BUILD / f"{name}_loop.c"
    loop.write_text(LOOP % {"name": name, "size": model.size, "work": step.sz_w() + 64, "integers": step.sz_iw() + 64})
    library = compiled(loop, f"{name}_loop")
    nominal = np.ascontiguousarray(model.nominal.ravel())

    def solve(offsets: Array) -> Array:
        offsets = np.ascontiguousarray(offsets)
        out = np.empty((len(offsets), 3))
        n, width = (ctypes.c_long(k) for k in offsets.shape)
        library.solve(n, width, pointer(nominal), pointer(offsets), pointer(out))
        return out

    return solve


def in_pinocchio(p: Problem) -> Callable[[Array], Array]:
    """The four-bar as two chains closed by a point constraint; the play enters as placements."""
    import pinocchio as pin

    n = linkage(p)
    model = pin.Model()
    crank = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "crank")
    coupler = model.addJoint(crank, pin.JointModelRZ(), pin.SE3.Identity(), "coupler")
    rocker = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "rocker")
    angles = p.poses[0, :, 2]
    start = np.array([angles[0], angles[1] - angles[0], angles[2]])
    to_crank = np.array([[n["cosine"], n["sine"]], [-n["sine"], n["cosine"]]])
    frames = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    ends = [
        model.addFrame(pin.Frame(name, joint, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
        for name, joint in (("coupler end", coupler), ("rocker end", rocker))
    ]
    data = model.createData()

    def solve(offsets: Array) -> Array:
        out = np.empty((len(offsets), 3))
        for i, u in enumerate(offsets):
            model.jointPlacements[crank].translation = np.array([u[0], u[1], 0.0])
            x, y = to_crank @ u[2:4]
            model.jointPlacements[coupler].translation = np.array([n["crank"] + u[8] + x, y, 0.0])
            model.jointPlacements[rocker].translation = np.array([n["pivot_x"] + u[6], n["pivot_y"] + u[7], 0.0])
            model.frames[ends[0]].placement.translation = np.array([n["coupler"] + u[9], 0.0, 0.0])
            model.frames[ends[1]].placement.translation = np.array([n["rocker"] + u[10], 0.0, 0.0])
            q = start.copy()
            for _ in range(8):
                pin.computeJointJacobians(model, data, q)
                pin.updateFramePlacements(model, data)
                left, right = (data.oMf[e].translation for e in ends)
                j = pin.getFrameJacobian(model, data, ends[0], frames) - pin.getFrameJacobian(
                    model, data, ends[1], frames
                )
                step = np.linalg.solve(j[:2, 1:], (left - right)[:2] + u[4:6])
                q[1:] -= step
                if np.abs(step).max() < 1e-9:
                    break
            pin.framesForwardKinematics(model, data, q)
            out[i, :2] = data.oMf[ends[1]].translation[:2] - (n["x"], n["y"])
            out[i, 2] = q[2] - start[2]
        return out

    return solve


def in_pylinkage(p: Problem, name: str, samples: int) -> Contender:
    """pylinkage's own tolerance analysis of the same four-bar. It knows lengths only, no play; uniform laws."""
    from pylinkage.actuators import Crank
    from pylinkage.components import Ground
    from pylinkage.dyads import RRRDyad
    from pylinkage.simulation import Linkage

    n, t = linkage(p), p.sets[-1][1]
    pivot, base = Ground(n["pivot_x"], n["pivot_y"], name="J4"), Ground(0.0, 0.0, name="J1")
    turn = 0.1
    crank = Crank(
        anchor=base, radius=n["crank"], angular_velocity=turn, initial_angle=float(p.drives[0, 0]) - turn, name="crank"
    )
    dyad = RRRDyad(crank.output, pivot, distance1=n["coupler"], distance2=n["rocker"], name="pin")
    machine = Linkage([base, pivot, crank, dyad])
    dyad.x, dyad.y = n["x"], n["y"]
    lengths = ("crank_radius", "pin_dist1", "pin_dist2")

    def run(count: int = samples) -> Any:
        tolerances = dict.fromkeys(lengths, t)
        return machine.analyze_tolerance(tolerances, output_joint=dyad, iterations=1, n_samples=count, seed=1)

    cloud = run(8 * samples)
    uniform = {f"dimensions.{k}.law": "uniform" for k in p.mechanism.raw["dimensions"]}
    perfect = p.mechanism.with_({"joints.*.clearance.radial": 0.0, **uniform})
    sigma = cloud.output_cloud[:, 0].std(axis=0)
    words = "lengths only: " + sigma_words(sigma, problem(perfect, 64), 8 * samples)
    return Contender(name, run, samples, words)
