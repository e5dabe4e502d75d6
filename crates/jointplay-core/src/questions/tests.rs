//! Determinate mechanisms by the forms for over-constrained ones, against the forms for themselves.

mod over_constrained;

use serde_json::{Value, json};

use crate::mechanism::dim::Keep;
use crate::mechanism::testing::{disc, pin, point};
use crate::mechanism::{Case, Mechanism, Spec};
use crate::questions::columns::Worst;

pub(super) fn build(spec: &Value) -> Mechanism {
    let spec: Spec = serde_json::from_value(spec.clone()).expect("a specification");
    Mechanism::new(&spec).expect("a mechanism")
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
        let plain = m.loaded_determinate(&cases, exact, Keep::ALL);
        let strained = m.loaded_over_constrained(&cases, exact, Keep::ALL);
        assert_eq!(plain.status(), strained.status());
        for name in ["error", "error_first_order", "reaction", "offset", "contribution"] {
            assert_near(strained.numbers(name), plain.numbers(name), 1e-9);
        }
        assert!(["clearance_factor", "prestress"].iter().flat_map(|name| strained.numbers(name)).all(|f| *f == 0.0));
    }
    let n = m.sources().len();
    let determinate = m.summits_determinate(&cases, &m.measures(), 24, true);
    let over_constrained = m.summits_over_constrained(&cases, &m.measures(), 24);
    for (plain, together) in determinate.into_iter().zip(over_constrained) {
        let (plain, together) = (m.in_order(plain), m.in_order(together));
        assert_near(&together.component, &plain.component, 1e-9);
        assert_near(&together.component_first_order, &plain.component_first_order, 1e-12);
        let sizes = |w: &Worst| [w.position, w.rotation];
        assert_near(&sizes(&together), &sizes(&plain), 1e-9);
        // The direction of the largest displacement is known to the root of what its size is known to.
        assert_near(&together.contribution[..n], &plain.contribution[..n], 3e-5);
        assert_near(&together.contribution[n..], &plain.contribution[n..], 1e-9);
        let linear = |w: &Worst| [w.position_first_order, w.rotation_first_order];
        assert_near(&linear(&together), &linear(&plain), 1e-9);
        assert!(together.position_bound >= plain.position_first_order * (1.0 - 1e-12));
    }
    let u = plain_offsets(&m);
    let parameters = vec![u; cases.len()];
    let forced = m.given_over_constrained(&cases, &parameters);
    for (plain, (given, _)) in m.given_determinate(&cases, &parameters).iter().zip(forced) {
        assert_near(&given.error, &plain.error, 1e-9);
        assert_near(&given.error_first_order, &plain.error_first_order, 1e-9);
    }
}

fn plain_offsets(m: &Mechanism) -> Vec<f64> {
    (0..m.n_parameters()).map(|p| 1e-4 * ((p as f64 * 0.618).fract() - 0.5)).collect()
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
