//! Over-constrained and elastic mechanisms against what is known of them without a program: determinate
//! ones by the engine for those, a cantilever, links that stay parallel.

use jointplay_core::questions::loaded::Columns;
use jointplay_core::{Case, Mechanism, Spec, Status};
use serde_json::{Value, json};

fn build(spec: &Value) -> Mechanism {
    let spec: Spec = serde_json::from_value(spec.clone()).expect("a specification");
    Mechanism::new(&spec).expect("a mechanism")
}

/// A pin between two points, as the specification has it.
fn pin(first: usize, second: usize) -> Value {
    json!({"kind": "revolute", "first": first, "second": second, "axis_first": [1, 0, 0], "axis_second": [1, 0, 0]})
}

fn point(body: i64, x: f64, y: f64) -> Value {
    json!({"body": body, "at": [x, y, 0.0]})
}

fn disc(joint: usize, radius: f64) -> Value {
    json!({"kind": "clearance", "joint": joint, "set": {"disc": {"radius": radius}}, "centre": [0, 0], "law": "uniform"})
}

/// Crank and rocker with a coupler, play in every joint, a coupler made too long, two loads.
fn four_bar() -> Value {
    let points = [
        point(-1, 0.0, 0.0),
        point(0, 0.0, 0.0),
        point(0, 0.05, 0.0),
        point(1, 0.0, 0.0),
        point(1, 0.1, 0.0),
        point(2, 0.08, 0.0),
        point(-1, 0.1, 0.0),
        point(2, 0.0, 0.0),
        point(1, 0.05, 0.04),
    ];
    let sources: Vec<Value> = (0..4_u8)
        .map(|j| disc(usize::from(j), 1e-4 * f64::from(j + 1)))
        .chain([json!({"kind": "dimension", "from": 3, "to": 4, "centre": [2e-4], "law": "uniform",
                       "set": {"interval": {"low": 0, "high": 0}}})])
        .collect();
    json!({
        "space": "planar", "n_bodies": 3, "length": 0.1, "singular_value": 1e-4, "points": points,
        "guess": [[0, 0, 1.0], [0.03, 0.04, 0.3], [0.1, 0, 1.2]],
        "joints": [pin(0, 1), pin(2, 3), pin(4, 5), pin(6, 7)],
        "drives": [{"joint": 0}], "output": {"point": 8},
        "loads": [{"point": 8, "force": [3.0, -20.0, 0], "moment": [0, 0, 0.2]},
                  {"point": 5, "force": [1.0, 4.0, 0], "moment": [0, 0, 0]}],
        "sources": sources,
    })
}

fn assert_near(found: &[f64], wanted: &[f64], tolerance: f64) {
    assert_eq!(found.len(), wanted.len());
    let size = wanted.iter().fold(0.0_f64, |size, w| size.max(w.abs()));
    for (f, w) in found.iter().zip(wanted) {
        assert!((f - w).abs() <= tolerance * size, "{found:?} {wanted:?}");
    }
}

#[test]
fn a_determinate_mechanism_is_none_the_wiser() {
    let m = build(&four_bar());
    let drives: Vec<f64> = (0..8).map(|k| 0.8 + 0.1 * f64::from(k)).collect();
    let trace = m.trace(8, &drives);
    let cases: Vec<Case<'_>> = drives
        .chunks(1)
        .zip(trace.coordinates.chunks(m.n_coordinates()))
        .map(|(drives, coordinates)| Case { drives, coordinates })
        .collect();
    for exact in [false, true] {
        let (plain, strained) = (m.loaded(&cases, exact, Columns::ALL), m.strained(&cases, exact, true));
        assert_eq!(plain.status, strained.loaded.status);
        assert_near(&strained.loaded.error, &plain.error, 1e-9);
        assert_near(&strained.loaded.error_first_order, &plain.error_first_order, 1e-9);
        assert_near(&strained.loaded.reaction, &plain.reaction, 1e-9);
        assert_near(&strained.loaded.offset, &plain.offset, 1e-9);
        assert_near(&strained.loaded.contribution, &plain.contribution, 1e-9);
        assert!(strained.clearance_factor.iter().chain(&strained.prestress).all(|f| *f == 0.0));
    }
    for (plain, together) in m.worst(&cases, 24).iter().zip(m.worst_together(&cases, 24)) {
        assert_near(&together.component.concat(), &plain.component.concat(), 1e-9);
        assert_near(&together.component_first_order.concat(), &plain.component_first_order.concat(), 1e-12);
        let sizes = |w: &jointplay_core::questions::worst::Worst| [w.position, w.rotation];
        assert_near(&sizes(&together), &sizes(plain), 1e-9);
        // The direction of the largest displacement is known to the root of what its size is known to.
        assert_near(&together.contribution[0], &plain.contribution[0], 3e-5);
        assert_near(&together.contribution[1..].concat(), &plain.contribution[1..].concat(), 1e-9);
        let linear = |w: &jointplay_core::questions::worst::Worst| [w.position_first_order, w.rotation_first_order];
        assert_near(&linear(&together), &linear(plain), 1e-9);
        assert!(together.position_bound >= plain.position_first_order * (1.0 - 1e-12));
    }
    let u = plain_offsets(&m);
    let parameters = vec![u; cases.len()];
    for (plain, forced) in m.given(&cases, &parameters).iter().zip(m.forced(&cases, &parameters)) {
        assert_near(&forced.given.error, &plain.error, 1e-9);
        assert_near(&forced.given.error_first_order, &plain.error_first_order, 1e-9);
    }
}

fn plain_offsets(m: &Mechanism) -> Vec<f64> {
    (0..m.n_parameters()).map(|p| 1e-4 * ((p as f64 * 0.618).fract() - 0.5)).collect()
}

#[test]
fn a_beam_bends_as_in_the_textbook() {
    // An arm on the ground, as two rigid pieces joined by the compliance of a cantilever at its end.
    let (length, rigidity, stretch) = (0.5_f64, 40.0, 1e-6);
    let bend = [length.powi(3) / 3.0 / rigidity, length * length / 2.0 / rigidity, length / rigidity];
    let compliance = [stretch, 0.0, 0.0, 0.0, bend[0], bend[1], 0.0, bend[1], bend[2]];
    let spec = |force: f64| {
        json!({
            "space": "planar", "n_bodies": 1, "length": 0.5, "singular_value": 1e-4, "guess": [[length, 0, 0]],
            "points": [point(-1, length, 0.0), point(0, 0.0, 0.0)],
            "joints": [{"kind": "fixed", "first": 0, "second": 1, "axis_first": [1, 0, 0], "axis_second": [1, 0, 0],
                        "compliance": compliance}],
            "drives": [], "output": {"point": 1},
            "loads": [{"point": 1, "force": [2.0, force, 0], "moment": [0, 0, 0.1]}],
        })
    };
    for (force, exact) in [(-3.0, false), (-3e-4, true)] {
        let m = build(&spec(force));
        let coordinates = [length, 0.0, 0.0];
        let found = m.strained(&[Case { drives: &[], coordinates: &coordinates }], exact, true);
        assert_eq!(found.loaded.status, [Status::Ok]);
        let wanted = [2.0 * stretch, bend[0] * force + bend[1] * 0.1, bend[1] * force + bend[2] * 0.1];
        assert_near(&found.loaded.error, &wanted, 1e-9);
        assert_near(&found.deformation, &wanted, 1e-9);
        assert_near(&found.force, &[2.0, force, 0.1], 1e-12);
        assert_near(&found.loaded.reaction, &[-2.0, -force, -0.1], 1e-12);
    }
}

#[test]
fn a_compliance_must_be_one() {
    let with = |compliance: Value| {
        let mut spec = four_bar();
        spec["joints"][1]["compliance"] = compliance;
        let spec: Spec = serde_json::from_value(spec).expect("a specification");
        Mechanism::new(&spec).map(|m| m.deformations().count()).map_err(|e| e.to_string())
    };
    assert_eq!(with(json!([1e-6, 0, 0, 0])), Ok(1));
    assert_eq!(with(json!([0, 0, 0, 0])), Ok(0));
    assert!(with(json!([1e-6])).is_err_and(|e| e.contains("joint 1: its compliance needs 2 x 2 numbers")));
    for wrong in [json!([1e-6, 0, 0, -1e-6]), json!([1e-6, 1e-7, 0, 1e-6]), json!([1e-6, 2e-6, 2e-6, 1e-6])] {
        assert!(with(wrong).is_err_and(|e| e.contains("not symmetric and positive semidefinite")));
    }
}

/// Three parallel cranks on one coupler; the third off the line of the two others.
fn three_cranks() -> Value {
    let (r, feet) = (0.05, [[0.0, 0.0], [0.1, 0.0], [0.04, 0.03]]);
    let mut points = Vec::new();
    let mut joints = Vec::new();
    for (k, [x, y]) in feet.into_iter().enumerate() {
        let (crank, first) = (i64::try_from(k).expect("small"), points.len());
        points.extend([point(-1, x, y), point(crank, 0.0, 0.0), point(crank, r, 0.0), point(3, x, y)]);
        joints.extend([pin(first, first + 1), pin(first + 2, first + 3)]);
    }
    points.push(point(3, 0.05, 0.05));
    let start = 1.0_f64;
    let guess: Vec<Value> = feet
        .iter()
        .map(|[x, y]| json!([x, y, start]))
        .chain([json!([r * start.cos(), r * start.sin(), 0.0])])
        .collect();
    json!({
        "space": "planar", "n_bodies": 4, "length": 0.1, "singular_value": 1e-3, "guess": guess, "points": points,
        "joints": joints, "drives": [{"joint": 0}], "output": {"point": 12}, "loads": [], "sources": [],
    })
}

#[test]
fn parallel_cranks_go_all_the_way_round() {
    // Where the first two cranks and the coupler lie on one line, only the third keeps them from folding: the rows
    // that were independent at the start are not any more.
    let m = build(&three_cranks());
    let count = 145;
    let drives: Vec<f64> = (0..count).map(|k| 1.0 + (f64::from(k) * 2.5).to_radians()).chain([0.0]).collect();
    for values in [&drives[..], &drives[count as usize..], &[0.0], &[std::f64::consts::PI]] {
        let trace = m.trace(values.len(), values);
        assert!(trace.status.iter().all(|status| *status == Status::Ok), "{:?}", trace.status);
        for (drive, coordinates) in values.iter().zip(trace.coordinates.chunks(m.n_coordinates())) {
            for crank in coordinates[..9].chunks(3) {
                assert!((crank[2] - drive).sin().abs() < 1e-9 && (crank[2] - drive).cos() > 0.0);
            }
            assert!(coordinates[11].abs() < 1e-9);
        }
        // No play and no misfit.
        let cases: Vec<Case<'_>> = values
            .chunks(1)
            .zip(trace.coordinates.chunks(m.n_coordinates()))
            .map(|(drives, coordinates)| Case { drives, coordinates })
            .collect();
        let found = m.strained(&cases, true, true);
        assert!(found.loaded.status.iter().all(|status| *status == Status::Ok));
        assert!(found.lack_of_fit.iter().all(|gap| *gap < 1e-12));
    }
}

#[test]
fn what_is_free_to_move_is_told() {
    let mut spec = three_cranks();
    // Not a matter of counting: the last pin holds twice what the first two cranks leave free.
    spec["drives"] = json!([]);
    let again = spec["joints"][5].clone();
    spec["joints"].as_array_mut().expect("joints").push(again);
    let m = build(&spec);
    assert_eq!(m.trace(1, &[]).status, [Status::Underconstrained]);
}
