//! Every coupled row against finite differences, at poses and plays without a pattern.

use serde_json::{Value, json};

use crate::closure::equations::Inputs;
use crate::math::space::Space;
use crate::math::vector::{cross, dot, norm, scale, sub};
use crate::mechanism::{Mechanism, Spec};

/// Two bodies about 0.1 m apart that a coupling ties, with play, a ratio error and run-out of both centres.
fn coupled(space: &str, kind: &str, coupling: &Value) -> Mechanism {
    let (pose, axis) = match space {
        "planar" => (vec![0.0; 3], [1.0, 0.0, 0.0]),
        _ => (vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
    };
    let mut other = pose.clone();
    (other[0], other[1]) = (0.04, 0.0917);
    let side = [1.0, 0.0, 0.0];
    let second = coupling.get("contact").map_or(json!(axis), |contact| contact["axes"][1].clone());
    let set = match kind {
        "screw" => json!({"journal": {"radius": 2e-4, "half_length": 0.01, "axial": 3e-4}}),
        _ => json!({"interval": {"low": -2e-4, "high": 5e-4}}),
    };
    let centre = vec![0.0; if kind == "screw" { 5 } else { 1 }];
    let points = [[0.003, -0.002, 0.001], [-0.002, 0.001, 0.004]];
    let runout = |end: usize| {
        let set = json!({"disc": {"radius": 1e-4}});
        let ways = [[[1.0, 0.0, 0.0], [0.0; 3]], [[0.0, 1.0, 0.0], [0.0; 3]]];
        json!({"kind": "place", "displacement": end, "components": ["x", "y"], "ways": ways, "set": set,
            "centre": [0.0, 0.0], "law": "uniform"})
    };
    let spec = json!({
        "space": space,
        "n_bodies": 2,
        "guess": [pose, other],
        "length": 0.1,
        "singular_value": 1e-9,
        "points": [{"body": 0, "at": points[0]}, {"body": 1, "at": points[1]}],
        "displacements": [{"points": [0], "about": points[0]}, {"points": [1], "about": points[1]}],
        "joints": [{"kind": kind, "first": 0, "second": 1, "axis_first": axis, "axis_second": second,
            "side_first": side, "side_second": side, "coupling": coupling}],
        "drives": [],
        "output": {"point": 1},
        "sources": [
            {"kind": "clearance", "joint": 0, "set": set, "centre": centre, "law": "uniform"},
            {"kind": "ratio", "joint": 0, "set": {"interval": {"low": -1e-4, "high": 1e-4}}, "centre": [0.0],
                "law": "uniform"},
            runout(0),
            runout(1),
        ],
    });
    let spec: Spec = serde_json::from_value(spec).expect("a specification");
    Mechanism::new(&spec).expect("a mechanism")
}

/// A worm of the axis z on a wheel whose axis is 70 degrees off, with centres that are not on the common normal.
fn worm() -> Value {
    let (sine, cosine) = 70.0_f64.to_radians().sin_cos();
    let apart = [0.04, 0.0917, 0.005];
    let at = [0.012, 0.0275, -0.003];
    let axes = [[0.0, 0.0, 1.0], [sine * 0.6, sine * 0.8, cosine]];
    // Flanks along which both wheels move in the ratio 3 to 40 at the pitch point, and a direction that meets both axes.
    let lever = sub(at, apart);
    let speed = |k: usize, arm| cross(axes[k], arm);
    let (v1, v2) = (scale(speed(0, at), 40.0), scale(speed(1, lever), 3.0));
    let out = cross(speed(0, at), speed(1, lever));
    let normal = cross(out, sub(v1, v2));
    let radius = 0.08;
    let normal = scale(normal, radius / dot(speed(1, lever), normal));
    let opening = scale(out, 0.5 / norm(&out));
    json!({"radii": [0.0, radius], "teeth": [3, 40],
        "contact": {"axes": axes, "apart": apart, "at": at, "normal": normal, "opening": opening}})
}

fn cases() -> Vec<(&'static str, &'static str, Value)> {
    let mut cases = Vec::new();
    for space in ["planar", "spatial"] {
        let angle = 0.349;
        let gear = |internal| {
            let radii = if internal { [0.05, 0.15] } else { [0.06, 0.04] };
            let teeth = if internal { [20, 60] } else { [57, 38] };
            json!({"radii": radii, "teeth": teeth, "internal": internal, "pressure_angle": angle})
        };
        cases.push((space, "gear", gear(false)));
        cases.push((space, "gear", gear(true)));
        cases.push((space, "rack", json!({"radii": [0.09, 0.0], "pressure_angle": angle})));
        cases.push((space, "belt", json!({"radii": [0.02, 0.03], "teeth": [20, 30]})));
        cases.push((space, "belt", json!({"radii": [0.02, 0.02], "teeth": [1, 1]})));
        cases.push((space, "belt", json!({"radii": [0.02, 0.03], "teeth": [20, 30], "crossed": true})));
    }
    cases.push(("spatial", "crossed_gear", worm()));
    cases.push(("spatial", "screw", json!({"lead": 0.005})));
    cases.push(("spatial", "screw", json!({"lead": -0.02})));
    cases
}

/// Numbers between -1 and 1 without a pattern.
fn noise(seed: usize) -> impl FnMut() -> f64 {
    let mut k = seed as f64;
    move || {
        k += 1.0;
        2.0 * (k * 0.618_034 + (k * k) * 0.324_717).fract() - 1.0
    }
}

fn residual(m: &Mechanism, coordinates: &[f64], parameters: &[f64]) -> Vec<f64> {
    let mut residual = vec![0.0; m.n_rows()];
    let mut derivatives = vec![0.0; 2 * m.size() * m.n_rows()];
    let inputs = Inputs { drives: vec![], parameters: parameters.to_vec() };
    m.evaluate(&m.poses(coordinates), &inputs.commands(m), &mut residual, &mut derivatives);
    residual
}

/// Some bodies near the guess, tilted a little in space, with parameters of the order of the play.
fn somewhere(m: &Mechanism, seed: usize) -> (Vec<f64>, Vec<f64>) {
    let mut next = noise(seed);
    let mut coordinates = m.guess();
    let tilts = |k: usize| m.space == Space::Spatial && k % m.size() > 2 && k % m.size() < 5;
    let twist: Vec<f64> = (0..m.n_unknowns())
        .map(|k| {
            next()
                * if k % m.size() < m.n_translations() {
                    0.004
                } else if tilts(k) {
                    0.02
                } else {
                    0.3
                }
        })
        .collect();
    m.retract(&mut coordinates, &twist);
    let parameters = (0..m.n_parameters()).map(|_| 3e-4 * next()).collect();
    (coordinates, parameters)
}

#[test]
fn derivatives_along_the_bodies_are_differences() {
    for (space, kind, coupling) in cases() {
        let m = coupled(space, kind, &coupling);
        for seed in 0..10 {
            let (coordinates, parameters) = somewhere(&m, seed);
            let mut derivatives = vec![0.0; 2 * m.size() * m.n_rows()];
            let inputs = Inputs { drives: vec![], parameters: parameters.clone() };
            let mut at = vec![0.0; m.n_rows()];
            m.evaluate(&m.poses(&coordinates), &inputs.commands(&m), &mut at, &mut derivatives);
            for j in 0..m.n_unknowns() {
                let step = 1e-6;
                let ends = [step, -step].map(|h| {
                    let mut twist = vec![0.0; m.n_unknowns()];
                    twist[j] = h;
                    let mut moved = coordinates.clone();
                    m.retract(&mut moved, &twist);
                    residual(&m, &moved, &parameters)
                });
                for row in 0..m.n_rows() {
                    let difference = (ends[0][row] - ends[1][row]) / (2.0 * step);
                    let told = derivatives[2 * m.size() * row + j];
                    assert!(
                        (told - difference).abs() < 2e-7,
                        "{space} {kind} {coupling} {row} {j}: {told} {difference}"
                    );
                }
            }
        }
    }
}

/// With `J^T l` a cost the gradient along the parameters is `-(d residual / d parameter)^T l`.
#[test]
fn derivatives_along_the_parameters_are_differences() {
    for (space, kind, coupling) in cases() {
        let m = coupled(space, kind, &coupling);
        for seed in 0..10 {
            let (coordinates, parameters) = somewhere(&m, seed);
            let poses = m.poses(&coordinates);
            for row in 0..m.n_rows() {
                let mut unit = vec![0.0; m.n_rows()];
                unit[row] = 1.0;
                let mut gradient = Inputs { drives: vec![], parameters: vec![0.0; m.n_parameters()] };
                m.pull_back(&poses, &parameters, &unit, &mut gradient);
                for p in 0..m.n_parameters() {
                    let step = 1e-6;
                    let ends = [step, -step].map(|h| {
                        let mut moved = parameters.clone();
                        moved[p] += h;
                        residual(&m, &coordinates, &moved)[row]
                    });
                    let difference = -(ends[0] - ends[1]) / (2.0 * step);
                    let told = gradient.parameters[p];
                    assert!((told - difference).abs() < 2e-7, "{space} {kind} {row} {p}: {told} {difference}");
                }
            }
        }
    }
}

/// The force of a coupled row and its reaction are in balance: seen from both bodies it is one line of action.
#[test]
fn a_force_along_the_line_of_action_is_in_balance() {
    for (space, kind, coupling) in cases().into_iter().filter(|case| case.1 != "screw") {
        let m = coupled(space, kind, &coupling);
        let (coordinates, parameters) = somewhere(&m, 7);
        let n = m.size();
        let mut derivatives = vec![0.0; 2 * n];
        let inputs = Inputs { drives: vec![], parameters };
        m.evaluate(&m.poses(&coordinates), &inputs.commands(&m), &mut [0.0], &mut derivatives);
        let width = m.n_body_coordinates();
        let wrench = |b: usize| {
            let d = &derivatives[b * n..(b + 1) * n];
            let at = &coordinates[b * width..];
            let force = [d[0], d[1]];
            // About the origin of ground axes.
            (force, d[n - 1] + at[0] * force[1] - at[1] * force[0])
        };
        let ((f1, m1), (f2, m2)) = (wrench(0), wrench(1));
        assert!((f1[0] + f2[0]).abs() + (f1[1] + f2[1]).abs() < 1e-12);
        assert!((m1 + m2).abs() < 1e-3 * f1[0].hypot(f1[1]), "{space} {kind}: {m1} {m2}");
        if space == "planar" {
            assert!((m1 + m2).abs() < 1e-12, "{space} {kind}: {m1} {m2}");
        }
    }
}
