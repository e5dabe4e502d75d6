use serde_json::json;

use super::{Begun, Budget, NEWTON_STEPS, State};
use crate::closure::equations::Inputs;
use crate::mechanism::Mechanism;
use crate::mechanism::testing::{pin, point};

/// A four-bar linkage whose crank gets as far as a right angle, where coupler and rocker are stretched.
fn four_bar() -> Mechanism {
    let spec = json!({
        "space": "planar", "n_bodies": 3, "length": 0.08, "singular_value": 1e-6,
        "guess": [[0.0, 0.0, 0.9], [0.037, 0.047, 0.3], [0.08, 0.0, 1.7]],
        "points": [point(-1, 0.0, 0.0), point(0, 0.0, 0.0), point(0, 0.06, 0.0), point(1, 0.0, 0.0),
            point(1, 0.05, 0.0), point(2, 0.05, 0.0), point(2, 0.0, 0.0), point(-1, 0.08, 0.0)],
        "joints": [pin(0, 1), pin(2, 3), pin(4, 5), pin(7, 6)],
        "drives": [{"joint": 0}], "output": {"point": 4}, "sources": [],
    });
    Mechanism::new(&serde_json::from_value(spec).expect("a specification")).expect("a mechanism")
}

/// A search with a limit takes every step, even those that are in vain.
fn enough() -> Budget {
    Budget::of(1_000_000)
}

fn numbers(state: &State) -> (&[f64], bool) {
    (&state.coordinates, state.negative)
}

#[test]
fn no_part_of_a_way_is_given_up_that_would_be_accepted() {
    let m = four_bar();
    let (solver, start) = m.first_state(&[0.9]).expect("assembled");
    let (mut accepted, mut just_accepted, mut spared) = (0, 0, 0);
    // Ever nearer to the dead centre, and ways that end before and beyond it.
    for near in 1..40_i32 {
        let at = Inputs::nominal(&m, &[std::f64::consts::FRAC_PI_2 - 0.8_f64.powi(near)]);
        let from = solver.follow(&start, &at).expect("before the dead centre");
        for k in -300..300_i32 {
            let part = f64::from(k) / 100.0 * 0.8_f64.powi(near);
            let to = Inputs::nominal(&m, &[at.drives[0] + part]);
            let (given_up, whole) = (solver.close(&from, &to), solver.close_within(&from, &to, Some(&mut enough())));
            assert_eq!(given_up.as_ref().map(numbers), whole.as_ref().map(numbers), "{near} {k}");
            let took = |in_vain: fn(f64, f64) -> bool| {
                let mut budget = Budget::of(NEWTON_STEPS);
                let begun = Begun::at(&m, from.coordinates.clone(), &to);
                let found = solver.newton(begun, &to, Some(&mut budget), in_vain);
                (found, NEWTON_STEPS - budget.left())
            };
            let (converged, steps) = took(|_, _| false);
            if whole.is_some() {
                let (_, converged) = converged.expect("it was accepted");
                accepted += 1;
                just_accepted += i32::from(converged.later_moves > 0.4 * converged.first_move);
            } else {
                spared += steps - took(|first, later| later > 0.5 * first + super::LAST_STEP).1;
            }
        }
    }
    assert!(accepted > 5_000 && just_accepted > 100 && spared > 5_000, "{accepted} {just_accepted} {spared}");
}

#[test]
fn a_way_ends_where_it_did_without_giving_parts_up() {
    let m = four_bar();
    let (solver, start) = m.first_state(&[0.9]).expect("assembled");
    for k in 1..200_i32 {
        let to = Inputs::nominal(&m, &[0.9 + 0.01 * f64::from(k)]);
        let ends = [solver.follow_part(&start, &to), solver.follow_within(&start, &to, &mut enough())];
        let [given_up, whole] = ends.map(|end| match end {
            Ok(state) => (state, None),
            Err((state, status)) => (state, Some(status)),
        });
        assert_eq!((numbers(&given_up.0), given_up.1), (numbers(&whole.0), whole.1), "{k}");
        assert_eq!(given_up.1.is_none(), to.drives[0] < std::f64::consts::FRAC_PI_2);
    }
}
