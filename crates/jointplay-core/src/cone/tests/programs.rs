//! The support functions of the sets of admissible offsets against cone programs that know only the
//! definitions of the sets, solved by Clarabel (Goulart and Chen, arXiv 2405.12762), against closed
//! forms written with vectors, and against each other.

use crate::clearance::Set;
use crate::math::vector::{Vec3, add, cross, dot, norm, scale, sub};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SupportedConeT};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A linear form of the offset.
type Form = Vec<f64>;

/// One condition of a set's definition.
enum Condition {
    /// The forms' values, as a vector, are no longer than the bound.
    Length(Vec<Form>, f64),
    /// The absolute values of the forms add up to no more than the bound.
    Sum(Vec<Form>, f64),
}

/// `sum factor * component` as a form of `n` components.
fn form(n: usize, terms: &[(usize, f64)]) -> Form {
    let mut form = vec![0.0; n];
    for (k, factor) in terms {
        form[*k] += factor;
    }
    form
}

/// Ends of a pin at `+-l` along the axis, whose first component across it is `at`: `d + arm tilt x axis`
/// with `side x axis = -normal` and `normal x axis = side`.
fn ends(n: usize, at: usize, radius: f64, l: f64) -> impl Iterator<Item = Condition> {
    [l, -l].into_iter().map(move |arm| {
        let side = form(n, &[(at, 1.0), (at + 3, arm)]);
        let normal = form(n, &[(at + 1, 1.0), (at + 2, -arm)]);
        Condition::Length(vec![side, normal], radius)
    })
}

/// The set's definition.
fn conditions(set: &Set) -> Vec<Condition> {
    let n = set.size();
    let sum = |terms: &[(usize, f64)], bound| Condition::Sum(terms.iter().map(|t| form(n, &[*t])).collect(), bound);
    match *set {
        Set::Disc { radius } | Set::Ball { radius } => {
            vec![Condition::Length((0..n).map(|k| form(n, &[(k, 1.0)])).collect(), radius)]
        }
        Set::Diamond { gap, half_length } => vec![sum(&[(0, 1.0), (1, half_length)], gap)],
        Set::Interval { low, high } => {
            assert!((low + high).abs() < 1e-15, "centred intervals only");
            vec![sum(&[(0, 1.0)], high)]
        }
        Set::Journal { radius, half_length, axial } => {
            ends(n, 1, radius, half_length).chain([sum(&[(0, 1.0)], axial)]).collect()
        }
        Set::Sleeve { radius, half_length } => ends(n, 0, radius, half_length).collect(),
        Set::Guide { gap, half_length, half_width, half_height } => {
            let [side, normal, roll, tilt_side, tilt_normal] = [0, 1, 2, 3, 4];
            vec![
                sum(&[(side, 1.0), (tilt_normal, half_length), (roll, half_height)], gap),
                sum(&[(normal, 1.0), (tilt_side, half_length), (roll, half_width)], gap),
            ]
        }
        Set::Plate { gap, half_normal, half_side } => vec![sum(&[(0, 1.0), (1, half_normal), (2, half_side)], gap)],
    }
}

/// The largest `w . u` over the product of sets.
fn largest(sets: &[Set], w: &[f64]) -> f64 {
    let n: usize = sets.iter().map(Set::size).sum();
    // Rows `bound - row . u`, cone after cone.
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut bounds: Vec<f64> = Vec::new();
    let mut cones: Vec<SupportedConeT<f64>> = Vec::new();
    let mut at = 0;
    for set in sets {
        let row = |form: &Form, sign: f64| {
            let mut row = vec![0.0; n];
            row[at..at + set.size()].iter_mut().zip(form).for_each(|(r, f)| *r = sign * f);
            row
        };
        for condition in conditions(set) {
            match condition {
                Condition::Length(forms, bound) => {
                    rows.push(vec![0.0; n]);
                    rows.extend(forms.iter().map(|f| row(f, -1.0)));
                    bounds.push(bound);
                    bounds.extend(vec![0.0; forms.len()]);
                    cones.push(SecondOrderConeT(forms.len() + 1));
                }
                Condition::Sum(forms, bound) => {
                    // Every choice of signs.
                    for code in 0..1 << forms.len() {
                        let signed = |(k, f)| row(f, if code >> k & 1 == 0 { 1.0 } else { -1.0 });
                        let add = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(b).map(|(a, b)| a + b).collect();
                        rows.push(forms.iter().enumerate().map(signed).fold(vec![0.0; n], add));
                        bounds.push(bound);
                    }
                    cones.push(NonnegativeConeT(1 << forms.len()));
                }
            }
        }
        at += set.size();
    }
    let cost: Vec<f64> = w.iter().map(|w| -w).collect();
    let tolerance = 1e-12;
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: tolerance,
        tol_gap_rel: tolerance,
        tol_feas: tolerance,
        ..DefaultSettings::default()
    };
    let none = CscMatrix::zeros((n, n));
    let mut solver = DefaultSolver::new(&none, &cost, &CscMatrix::from(&rows), &bounds, &cones, settings).unwrap();
    solver.solve();
    // Whether a solver that cannot reach its last digits is near enough is left to the comparison.
    -solver.solution.obj_val
}

fn rng() -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(11)
}

/// Sets of every kind with sizes between a fifth and two; sometimes parts of them are points.
fn random_sets(rng: &mut impl Rng) -> Vec<Set> {
    let mut size = || rng.random_range(0.2..2.0);
    let (radius, gap, half_length) = (size(), size(), size());
    let (half_width, half_height) = (size(), size());
    vec![
        Set::Disc { radius },
        Set::Diamond { gap, half_length },
        Set::Interval { low: -gap, high: gap },
        Set::Ball { radius },
        Set::Journal { radius, half_length, axial: size() },
        Set::Journal { radius, half_length, axial: 0.0 },
        Set::Journal { radius: 0.0, half_length, axial: size() },
        Set::Sleeve { radius, half_length },
        Set::Guide { gap, half_length, half_width, half_height },
        Set::Guide { gap, half_length, half_width, half_height: half_width },
        Set::Guide { gap, half_length, half_width: 0.0, half_height },
        Set::Guide { gap, half_length, half_width, half_height: 0.0 },
        Set::Plate { gap, half_normal: half_width, half_side: half_height },
    ]
}

fn wrench(rng: &mut impl Rng, n: usize) -> Vec<f64> {
    (0..n).map(|_| rng.random_range(-1.0..1.0)).collect()
}

fn vector(rng: &mut impl Rng) -> Vec3<f64> {
    std::array::from_fn(|_| rng.random_range(-1.0..1.0))
}

/// A random direction and two more that complete it to right-handed axes.
fn axes(rng: &mut impl Rng) -> [Vec3<f64>; 3] {
    let unit = |v: Vec3<f64>| scale(v, 1.0 / norm(&v));
    let along = unit(vector(rng));
    let side = unit(cross(along, vector(rng)));
    [along, side, cross(along, side)]
}

/// The part of a wrench that a journal with these axes bears.
fn on_journal([along, side, normal]: [Vec3<f64>; 3], force: Vec3<f64>, moment: Vec3<f64>) -> [f64; 5] {
    [dot(force, along), dot(force, side), dot(force, normal), dot(moment, side), dot(moment, normal)]
}

#[test]
fn support_functions_are_the_values_of_cone_programs() {
    let mut rng = rng();
    for _ in 0..25 {
        for set in random_sets(&mut rng) {
            let w = wrench(&mut rng, set.size());
            let (exact, numeric) = (set.support(&w), largest(&[set], &w));
            assert!((exact - numeric).abs() < 1e-9, "{set:?} {w:?}: {exact} {numeric}");
        }
    }
}

#[test]
fn the_support_point_of_a_pin_follows_the_reactions_of_its_ends() {
    let mut rng = rng();
    for _ in 0..200 {
        let (radius, l, axial) = (rng.random_range(0.1..1.0), rng.random_range(0.1..3.0), rng.random_range(0.0..1.0));
        let frame = axes(&mut rng);
        let [q, side, normal] = frame;
        let (force, moment) = (vector(&mut rng), vector(&mut rng));
        // R+- = (F_perp +- M x q / l) / 2
        let across = sub(force, scale(q, dot(force, q)));
        let lever = scale(cross(moment, q), 1.0 / l);
        let reactions = [scale(add(across, lever), 0.5), scale(sub(across, lever), 0.5)];
        let expected = radius * (norm(&reactions[0]) + norm(&reactions[1])) + axial * dot(force, q).abs();
        let set = Set::Journal { radius, half_length: l, axial };
        let w = on_journal(frame, force, moment);
        assert!((set.support(&w) - expected).abs() < 1e-14);

        let u = set.face(&w, 1e-12).centre;
        let shift = add(add(scale(q, u[0]), scale(side, u[1])), scale(normal, u[2]));
        let turn = add(scale(side, u[3]), scale(normal, u[4]));
        for (reaction, arm) in reactions.into_iter().zip([l, -l]) {
            let end = add(shift, cross(turn, scale(q, arm)));
            let across = sub(end, scale(q, dot(end, q)));
            let pushed = scale(reaction, radius / norm(&reaction));
            assert!(norm(&sub(across, pushed)) < 1e-13 * (1.0 + radius));
        }
        assert!((dot(shift, q) - axial.copysign(dot(force, q))).abs() < 1e-14);
    }
}

#[test]
fn a_square_guide_rolls_or_shifts() {
    let mut rng = rng();
    let (c, length, a) = (0.01, 0.8, 0.3);
    let set = Set::Guide { gap: c, half_length: 0.5 * length, half_width: 0.5 * a, half_height: 0.5 * a };
    let mut rolled = 0;
    for _ in 0..400 {
        // x is the direction of sliding, y side, z normal.
        let ([fy, fz, mx], [my, mz, _]) = (vector(&mut rng), vector(&mut rng));
        let (roll, shift) =
            (2.0 * mx.abs() / a, fy.abs().max(2.0 * mz.abs() / length) + fz.abs().max(2.0 * my.abs() / length));
        let w = [fy, fz, mx, my, mz];
        assert!((set.support(&w) - c * roll.max(shift)).abs() < 1e-16);
        let face = set.face(&w, 1e-12);
        assert!(face.is_point());
        assert_eq!(face.centre[2] != 0.0, roll > shift);
        rolled += usize::from(roll > shift);
    }
    assert!((50..350).contains(&rolled), "both cases are met");
}

#[test]
fn a_universal_joint_plays_as_its_two_journals_together() {
    let mut rng = rng();
    for _ in 0..50 {
        // The first axis q1, the direction s of a force along a leg at an angle psi from it, the second
        // axis q2 across both, and a couple about n, normal to both axes.
        let [q1, e, q2] = axes(&mut rng);
        let psi: f64 = rng.random_range(0.2..2.9);
        let s = add(scale(q1, psi.cos()), scale(e, psi.sin()));
        let (force, couple) = (rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
        let (radius, axial, l) = (rng.random_range(0.1..1.0), rng.random_range(0.1..1.0), rng.random_range(0.5..2.0));
        let set = Set::Journal { radius, half_length: l, axial };
        let w1 = on_journal([q1, e, q2], scale(s, force), scale(e, couple));
        let w2 = on_journal([q2, q1, e], scale(s, force), scale(e, couple));
        let m = couple / l;
        let (both, mixed) = (force * force + m * m, 2.0 * force * m * psi.cos());
        let expected = radius * (force * force * psi.sin().powi(2) + m * m).sqrt()
            + axial * (force * psi.cos()).abs()
            + 0.5 * radius * ((both - mixed).sqrt() + (both + mixed).sqrt());
        let sum = set.support(&w1) + set.support(&w2);
        assert!((sum - expected).abs() < 1e-14);
        // Over all sums of an offset of one and an offset of the other.
        assert!((largest(&[set, set], &[w1, w2].concat()) - sum).abs() < 1e-9);
    }
}

#[test]
fn sets_go_over_into_each_other() {
    let mut rng = rng();
    for _ in 0..100 {
        let (radius, l) = (rng.random_range(0.1..1.0), rng.random_range(0.1..3.0));
        let w = wrench(&mut rng, 5);
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-15 * (1.0 + b.abs()), "{a} {b}");

        // Without axial play a journal is a sleeve that does not slide.
        let sleeve = Set::Sleeve { radius, half_length: l };
        let journal = Set::Journal { radius, half_length: l, axial: 0.0 };
        near(journal.support(&w), sleeve.support(&w[1..]));
        let (a, b) = (journal.face(&w, 1e-12), sleeve.face(&w[1..], 1e-12));
        assert!(a.is_point() && b.is_point());
        (0..4).for_each(|k| assert!((a.centre[1 + k] - b.centre[k]).abs() < 1e-15));
        assert!(a.centre[0].abs() < 1e-15);

        // A force through the middle of a pin moves it as in the plane, and does not tilt it.
        let disc = Set::Disc { radius };
        let middle = [w[1], w[2], 0.0, 0.0];
        near(sleeve.support(&middle), disc.support(&w[1..3]));
        let (a, b) = (sleeve.face(&middle, 1e-12).centre, disc.face(&w[1..3], 1e-12).centre);
        (0..4).for_each(|k| assert!((a[k] - b[k]).abs() < 1e-15));

        // Of a ball, a force in a plane sees the disc.
        let ball = Set::Ball { radius };
        near(ball.support(&[w[0], w[1], 0.0]), disc.support(&w[..2]));
        let (a, b) = (ball.face(&[w[0], w[1], 0.0], 1e-12).centre, disc.face(&w[..2], 1e-12).centre);
        (0..3).for_each(|k| assert!((a[k] - b[k]).abs() < 1e-15));

        // A very long and broad guide only shifts, the same on both sides.
        let guide = Set::Guide { gap: radius, half_length: 1e9, half_width: 1e9, half_height: 1e9 };
        near(guide.support(&w), radius * (w[0].abs() + w[1].abs()));
        let centre = guide.face(&w, 1e-12).centre;
        let shifted = [radius.copysign(w[0]), radius.copysign(w[1]), 0.0, 0.0, 0.0];
        (0..5).for_each(|k| assert!((centre[k] - shifted[k]).abs() < 1e-15));

        // Pushed to one side, it is the planar slider.
        let guide = Set::Guide { gap: radius, half_length: l, half_width: 0.5, half_height: 0.3 };
        let diamond = Set::Diamond { gap: radius, half_length: l };
        near(guide.support(&[w[0], 0.0, 0.0, 0.0, w[4]]), diamond.support(&[w[0], w[4]]));
        let plate = Set::Plate { gap: radius, half_normal: 0.4, half_side: l };
        near(plate.support(&[w[0], 0.0, w[4]]), diamond.support(&[w[0], w[4]]));
    }
}
