//! Every row of a follower against finite differences, with bodies of its two joints in common and without.

use serde_json::{Value, json};

use crate::closure::equations::Inputs;
use crate::mechanism::{Mechanism, Spec};

/// A chain of four bodies whose last joint, or the one before, follows the first one; both ends of every joint are off
/// their places. The kinds are those of the leading and of the following joint.
fn chain(space: &str, kinds: [&str; 2], of: usize, curve: &Value) -> Mechanism {
    let planar = space == "planar";
    let pose = |k: usize| {
        let x = 0.1 * k as f64;
        if planar { vec![x, 0.02, 0.1] } else { vec![x, 0.02, -0.01, 0.99, 0.05, 0.1, 0.08] }
    };
    let kind = |j: usize| [kinds[0], "revolute", "revolute", "revolute"][j];
    let kind = |j: usize| if j == of { kinds[1] } else { kind(j) };
    let (axis, side) = if planar { ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]) } else { ([0.3, 0.2, 0.9], [1.0, 0.0, 0.0]) };
    let (mut points, mut joints, mut displacements, mut sources) = (vec![], vec![], vec![], vec![]);
    for j in 0..4_i64 {
        for (end, body) in [j - 1, j].into_iter().enumerate() {
            let at = [0.05 - 0.1 * end as f64, 0.01, if planar { 0.0 } else { 0.02 }];
            displacements.push(json!({"points": [points.len()], "about": at}));
            let (ways, components): (Vec<_>, &[&str]) = if planar {
                (vec![[[1.0, 0.0, 0.0], [0.0; 3]], [[0.0, 1.0, 0.0], [0.0; 3]]], &["x", "y"])
            } else {
                (vec![[[0.3, 1.0, 0.2], [0.0; 3]], [[0.0; 3], [0.4, -1.0, 0.6]]], &["side", "tilt_side"])
            };
            for (way, component) in ways.iter().zip(components) {
                sources.push(json!({"kind": "place", "displacement": points.len(), "components": [component],
                    "ways": [way], "set": {"interval": {"low": -1e-3, "high": 1e-3}}, "centre": [0.0], "law": "uniform"}));
            }
            points.push(json!({"body": body, "at": at}));
        }
        let j = usize::try_from(j).unwrap();
        joints.push(json!({"kind": kind(j), "first": 2 * j, "second": 2 * j + 1, "axis_first": axis,
            "axis_second": axis, "side_first": side, "side_second": side}));
    }
    joints.push(json!({"kind": "follower", "first": 2 * of, "second": 2 * of + 1, "axis_first": axis,
        "axis_second": axis, "side_first": side, "side_second": side,
        "follows": {"of": of, "leader": 0, "curve": curve, "middle": 0.3}}));
    for kind in ["clearance", "ratio"] {
        sources.push(json!({"kind": kind, "joint": 4, "set": {"interval": {"low": -1e-3, "high": 1e-3}},
            "centre": [0.0], "law": "uniform"}));
    }
    let spec = json!({"space": space, "n_bodies": 4, "guess": [pose(0), pose(1), pose(2), pose(3)], "length": 0.1,
        "singular_value": 1e-9, "points": points, "joints": joints, "drives": [], "displacements": displacements,
        "output": {"point": 7}, "sources": sources});
    let spec: Spec = serde_json::from_value(spec).expect("a specification");
    Mechanism::new(&spec).expect("a mechanism")
}

fn cases() -> Vec<Mechanism> {
    let polynomial = json!({"knots": [0.0, 1.0], "pieces": [[0.1, -0.9, 0.3, 0.2]]});
    // Quadratic and cubic pieces with one slope and curvature where they meet.
    let table = json!({"knots": [-1.0, 0.05, 2.0], "pieces": [[0.2, 0.4, 0.3], [0.95075, 1.03, 0.3, -0.2]]});
    let mut cases = Vec::new();
    for space in ["planar", "spatial"] {
        for kinds in [["revolute", "revolute"], ["prismatic", "revolute"], ["revolute", "prismatic"]] {
            for of in [1, 3] {
                cases.extend([&polynomial, &table].map(|curve| chain(space, kinds, of, curve)));
            }
        }
    }
    cases
}

fn evaluated(m: &Mechanism, coordinates: &[f64], parameters: &[f64]) -> (f64, Vec<f64>) {
    let inputs = Inputs { drives: vec![], parameters: parameters.to_vec() };
    let (residual, derivatives) = m.evaluated(&m.poses(coordinates), &inputs.commands(m));
    let row = m.n_rows() - 1;
    let mut along = vec![0.0; m.n_unknowns()];
    for (side, body) in m.row_bodies(row).into_iter().enumerate() {
        let Some(body) = body else { continue };
        for c in 0..m.size() {
            along[body * m.size() + c] += derivatives[m.side(row, side) * m.size() + c];
        }
    }
    (residual[row], along)
}

#[test]
fn derivatives_are_differences() {
    for (number, m) in cases().iter().enumerate() {
        for seed in 0..4_u32 {
            let noise = |k: usize| 2.0 * ((k + 1) as f64 * 0.618_034 + f64::from(seed) * 0.324_717).fract() - 1.0;
            let mut coordinates = m.guess();
            m.retract(&mut coordinates, &(0..m.n_unknowns()).map(|k| 0.1 * noise(k)).collect::<Vec<_>>());
            let parameters: Vec<f64> = (0..m.n_parameters()).map(|k| 1e-3 * noise(k + 50)).collect();
            let (_, along) = evaluated(m, &coordinates, &parameters);
            let step = 1e-6;
            for j in 0..m.n_unknowns() {
                let ends = [step, -step].map(|h| {
                    let mut twist = vec![0.0; m.n_unknowns()];
                    twist[j] = h;
                    let mut moved = coordinates.clone();
                    m.retract(&mut moved, &twist);
                    evaluated(m, &moved, &parameters).0
                });
                let difference = (ends[0] - ends[1]) / (2.0 * step);
                assert!((along[j] - difference).abs() < 1e-8, "{number} {seed} {j}: {} {difference}", along[j]);
            }
            let mut unit = vec![0.0; m.n_rows()];
            unit[m.n_rows() - 1] = 1.0;
            let mut gradient = Inputs { drives: vec![], parameters: vec![0.0; m.n_parameters()] };
            m.pull_back(&m.poses(&coordinates), &parameters, &unit, &mut gradient);
            for p in 0..m.n_parameters() {
                let ends = [step, -step].map(|h| {
                    let mut moved = parameters.clone();
                    moved[p] += h;
                    evaluated(m, &coordinates, &moved).0
                });
                let difference = -(ends[0] - ends[1]) / (2.0 * step);
                let told = gradient.parameters[p];
                assert!((told - difference).abs() < 1e-8, "{number} {seed} {p}: {told} {difference}");
            }
        }
    }
}

/// The leading joint may stand at half a turn from the curve's middle, but not be taken beyond.
#[test]
fn an_angle_is_taken_within_half_a_turn_of_the_middle() {
    let curve = json!({"knots": [0.0, 1.0], "pieces": [[0.0, 0.5]]});
    let m = chain("planar", ["revolute", "revolute"], 3, &curve);
    for turn in [0.0, 2.5, 3.3, -2.7] {
        let mut coordinates = m.guess();
        coordinates[2] = turn;
        let parameters = vec![0.0; m.n_parameters()];
        let residual = evaluated(&m, &coordinates, &parameters).0;
        // The last joint turns by the difference of two bodies that stand alike.
        assert!((residual + 0.5 * turn).abs() < 1e-12, "{turn}: {residual}");
    }
}
