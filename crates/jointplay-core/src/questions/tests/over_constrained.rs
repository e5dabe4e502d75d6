//! Over-constrained and elastic mechanisms against what is known of them without a program: a cantilever, links that stay
//! parallel.

use crate::mechanism::Case;
use crate::mechanism::dim::Keep;
use crate::mechanism::status::Status;
use crate::questions::tests::build;
use serde_json::{Value, json};

use crate::mechanism::testing::{pin, point};

fn assert_near(found: &[f64], wanted: &[f64], tolerance: f64) {
    assert_eq!(found.len(), wanted.len());
    let size = wanted.iter().fold(0.0_f64, |size, w| size.max(w.abs()));
    for (f, w) in found.iter().zip(wanted) {
        assert!((f - w).abs() <= tolerance * size, "{found:?} {wanted:?}");
    }
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
        let found = m.loaded(&[Case { drives: &[], coordinates: &coordinates }], exact, Keep::ALL);
        assert_eq!(found.status(), [Status::Ok]);
        let wanted = [2.0 * stretch, bend[0] * force + bend[1] * 0.1, bend[1] * force + bend[2] * 0.1];
        assert_near(found.numbers("error"), &wanted, 1e-9);
        assert_near(found.numbers("deformation"), &wanted, 1e-9);
        assert_near(found.numbers("force"), &[2.0, force, 0.1], 1e-12);
        assert_near(found.numbers("reaction"), &[-2.0, -force, -0.1], 1e-12);
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
        let found = m.loaded(&cases, true, Keep::ALL);
        assert!(found.status().iter().all(|status| *status == Status::Ok));
        assert!(found.numbers("lack_of_fit").iter().all(|gap| *gap < 1e-12));
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
