use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;

fn forms() -> Forms {
    let groups = [Group { range: 0..1, radius: f64::INFINITY }, Group { range: 1..3, radius: 0.1 }];
    Forms::new(Unknowns::new(vec![0.2, 0.1, 0.1], groups.into_iter()), &Rooms::default())
}

fn function<S: Real>(x: &[S]) -> Vec<S> {
    let (sine, cosine) = (x[0] + x[1]).sin_cos();
    let long = x[0] * x[0] + x[2] * x[2] + S::from_f64(1.0);
    let quotient = (x[1] - x[2]) / (long + x[0]);
    vec![
        sine * x[2] - cosine,
        S::small_angle(x[1], x[0] + S::from_f64(2.0)) * quotient,
        S::double_arc(x[0] * x[0]) + Real::root(long, 1.0),
        -quotient.wide_sin_cos().0 * long.reciprocal_root(1.0),
    ]
}

#[test]
fn values_lie_within_the_linear_part_and_the_rest() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    for _ in 0..500 {
        let forms = forms();
        let x: Vec<f64> = (0..3).map(|_| rng.random_range(-1.0..1.0)).collect();
        let unknown = |k: usize| forms.linear(x[k], [(k, 1.0)].into_iter(), 0.0);
        let found = function(&[unknown(0), unknown(1), unknown(2)]);
        for _ in 0..20 {
            let angle = rng.random_range(0.0..std::f64::consts::TAU);
            let d = [rng.random_range(-0.2..0.2), 0.1 * angle.cos(), 0.1 * angle.sin()];
            let values = function(&[x[0] + d[0], x[1] + d[1], x[2] + d[2]]);
            for (form, value) in found.iter().zip(values) {
                let (centre, coefficients, rest) = form.parts(3);
                let linear: f64 = coefficients.iter().zip(d).map(|(c, d)| c * d).sum();
                assert!((value - centre - linear).abs() <= rest + 1e-15, "{value} {centre} {linear} {rest}");
                assert!(form.range().contains(value));
            }
        }
    }
}

#[test]
fn what_cancels_leaves_nothing_but_rounding() {
    let forms = forms();
    let x = forms.linear(0.5, [1.0, 2.0, 3.0].into_iter().enumerate(), 0.0);
    let (a, b) = (x * x, (x - Form::from_f64(1.0)) * x);
    assert!((x - x).range().size() < 1e-14);
    // x^2 - (x - 1) x = x, but for the two remainders.
    assert!((a - b - x).range().size() <= 2.0 * 0.6_f64.powi(2));
}

#[test]
fn a_form_reaches_what_its_unknowns_allow_alone_and_together() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    for n in [1, 6, 7, 8, 9, 30] {
        let sizes: Vec<f64> = (0..n).map(|_| rng.random_range(0.1..1.0)).collect();
        let ranges: Vec<_> = [0..1, 1..3, 3..6, 6..8, 8..9].into_iter().filter(|range| range.end <= n).collect();
        // One unknown has nothing but its size, and what has corners has no radius.
        let radius = |k: usize| if k == 0 || k > 2 { f64::INFINITY } else { 0.5 };
        let groups = || ranges.iter().enumerate().map(|(k, range)| Group { range: range.clone(), radius: radius(k) });
        let forms = Forms::new(Unknowns::new(sizes.clone(), groups()), &Rooms::default());
        let c: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
        let apart = |range: std::ops::Range<usize>| range.map(|k| c[k].abs() * sizes[k]).sum::<f64>();
        let together = |group: Group| {
            let square: f64 = c[group.range.clone()].iter().map(|c| c * c).sum();
            apart(group.range.clone()).min(square.sqrt() * group.radius)
        };
        let covered = ranges.last().map_or(0, |range| range.end);
        let expected = groups().map(together).sum::<f64>() + apart(covered..n);
        let found = forms.linear(0.0, c.iter().copied().enumerate(), 0.0).range().high;
        assert!(found >= expected && found < expected * (1.0 + 1e-11), "{n}: {found} {expected}");
    }
}
