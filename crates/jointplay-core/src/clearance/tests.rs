use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::clearance::draw::points::Points;
use crate::clearance::draw::{Draw, Stream};
use crate::clearance::offset::inner;
use crate::clearance::samples::{DEGENERATE, KINDS};
use crate::clearance::*;
use crate::math::lanes::block::{Block, LANES};

const LAWS: [Law; 4] = [Law::Uniform, Law::Boundary, Law::Normal, Law::Gauss];
const BOUNDED: [Law; 3] = [Law::Uniform, Law::Boundary, Law::Normal];

fn sets() -> Vec<Set> {
    [&KINDS[..], &DEGENERATE].concat()
}

fn samples(set: &Set, law: Law, blocks: usize) -> Vec<Vec<f64>> {
    let mut stream = Stream::new(1, 2);
    drawn(set, blocks, |out| stream.draw(set, law, out))
}

fn drawn(set: &Set, blocks: usize, mut draw: impl FnMut(&mut [Block])) -> Vec<Vec<f64>> {
    let mut samples = Vec::with_capacity(blocks * LANES);
    let mut drawn = vec![Block::splat(f64::NAN); set.size()];
    for _ in 0..blocks {
        draw(&mut drawn);
        samples.extend((0..LANES).map(|i| drawn.iter().map(|b| b.0[i]).collect()));
    }
    samples
}

/// A wrench whose components do about the same work.
fn wrench(set: &Set, rng: &mut impl Rng) -> Vec<f64> {
    let weight = |k| if set.half_width(k) > 0.0 { 1.0 / set.half_width(k) } else { 1.0 };
    (0..set.size()).map(|k| rng.random_range(-1.0..1.0) * weight(k)).collect()
}

fn rng() -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(7)
}

#[test]
fn support_is_attained_on_the_face_and_never_exceeded_by_samples() {
    let mut rng = rng();
    for set in sets() {
        for law in BOUNDED {
            for offset in samples(&set, law, 200) {
                let w = wrench(&set, &mut rng);
                let face = set.face(&w, 0.0);
                let support = set.support(&w);
                assert!((inner(&w, &face.centre) - support).abs() < 2e-15 * (1.0 + support), "{set:?}");
                assert!(set.contains(&face.centre[..set.size()], 1e-14));
                assert!(set.contains(&offset, 1e-14), "{set:?} {law:?} {offset:?}");
                assert!(inner(&w, &offset) <= support + 2e-15 * (1.0 + support));
            }
        }
    }
}

#[test]
fn half_widths_are_the_largest_components() {
    for set in sets() {
        for k in 0..set.size() {
            for sign in [-1.0, 1.0] {
                let mut w = vec![0.0; set.size()];
                w[k] = sign;
                assert!(set.support(&w) <= set.half_width(k) * (1.0 + 1e-15));
            }
            let mut w = vec![0.0; set.size()];
            w[k] = 1.0;
            assert!((set.support(&w) - set.half_width(k)).abs() < 1e-15, "{set:?} {k}");
        }
    }
}

#[test]
fn on_the_boundary_nothing_is_left_inside() {
    for set in sets().iter().filter(|s| !s.is_zero()) {
        for offset in samples(set, Law::Boundary, 20) {
            // About its middle, every set but the off-centre interval is symmetric.
            let (mean, _) = set.moments(Law::Boundary);
            let further: Vec<f64> = offset.iter().zip(mean).map(|(u, m)| m + (u - m) * (1.0 + 1e-9)).collect();
            assert!(!set.contains(&further, 1e-12), "{set:?} {offset:?}");
        }
    }
}

#[test]
fn own_coordinates_keep_offsets_gradients_and_membership() {
    let mut rng = rng();
    for set in sets().iter().filter(|s| !s.is_zero()) {
        let n = set.size();
        for offset in samples(set, Law::Uniform, 20) {
            let unit = set.to_unit(&offset);
            let back = set.of_unit(&unit);
            assert!((0..n).all(|k| (back[k] - offset[k]).abs() < 1e-15));
            let mut projected = unit;
            set.project_unit(&mut projected[..n]);
            assert!((0..n).all(|k| (projected[k] - unit[k]).abs() < 1e-15), "inside stays");
            // w . d offset = gradient . d unit
            let w = wrench(set, &mut rng);
            let step: [f64; MAX_SIZE] = std::array::from_fn(|_| rng.random_range(-0.1..0.1));
            let moved = set.of_unit(&std::array::from_fn::<f64, MAX_SIZE, _>(|k| unit[k] + step[k]));
            let work: f64 = (0..n).map(|k| w[k] * (moved[k] - back[k])).sum();
            assert!((work - inner(&set.unit_gradient(&w)[..n], &step[..n])).abs() < 1e-14);
        }
    }
}

#[test]
fn projections_are_the_nearest_points() {
    let mut rng = rng();
    for set in sets().iter().filter(|s| !s.is_zero()) {
        let n = set.size();
        let inside: Vec<[f64; MAX_SIZE]> = samples(set, Law::Boundary, 10)
            .into_iter()
            .chain(samples(set, Law::Uniform, 10))
            .map(|offset| set.to_unit(&offset))
            .collect();
        for _ in 0..200 {
            let reach = rng.random_range(0.5..4.0);
            // A factor that is a point has no direction to project along.
            let from: Vec<f64> = set.to_unit(&vec![1.0; n])[..n]
                .iter()
                .map(|u| {
                    if *u == 0.0 && set.half_width(0) * set.half_width(1) == 0.0 {
                        0.0
                    } else {
                        reach * rng.random_range(-1.0..1.0)
                    }
                })
                .collect();
            let mut onto = from.clone();
            set.project_unit(&mut onto);
            assert!(set.contains(&set.of_unit(&onto)[..n], 1e-14));
            let beyond: Vec<f64> = from.iter().zip(&onto).map(|(f, o)| f - o).collect();
            for point in &inside {
                // The variational inequality, which decides, and the distance itself.
                let within: Vec<f64> = point.iter().zip(&onto).map(|(p, o)| p - o).collect();
                assert!(inner(&beyond, &within) < 1e-14, "{set:?} {from:?} {onto:?}");
                let away: Vec<f64> = point.iter().zip(&from).map(|(p, f)| p - f).collect();
                assert!(inner(&beyond, &beyond) <= inner(&away, &away) + 1e-14);
            }
        }
    }
}

#[test]
fn moments_agree_with_samples() {
    for set in sets() {
        for law in LAWS {
            let (mean, variance) = set.moments(law);
            let samples = samples(&set, law, 3000);
            let n = samples.len() as f64;
            for i in 0..set.size() {
                let sum: f64 = samples.iter().map(|s| s[i]).sum();
                let squares: f64 = samples.iter().map(|s| (s[i] - mean[i]).powi(2)).sum();
                // Five standard errors of the mean; the variance's is below 0.4 % for every law here.
                assert!((sum / n - mean[i]).abs() <= 5.0 * (variance[i] / n).sqrt() + 1e-15);
                assert!((squares / n - variance[i]).abs() <= 0.02 * variance[i], "{set:?} {law:?} {i}");
                for j in 0..i {
                    let mixed: f64 = samples.iter().map(|s| s[i] * s[j]).sum();
                    // Squares of dependent components can be correlated: up to twice the error of independent ones.
                    assert!((mixed / n).abs() <= 10.0 * (variance[i] * variance[j] / n).sqrt(), "{set:?} {i} {j}");
                }
            }
        }
    }
}

/// By quantile functions: the same laws, and twenty times closer than as many pseudo-random numbers.
#[test]
fn moments_of_sobol_points_are_close() {
    let mut rejected = 0;
    for set in sets() {
        for law in LAWS {
            let mut points = Points::new(1, 0, 1 << 16, 0, 2);
            let samples = drawn(&set, (1 << 16) / LANES, |out| {
                points.go_on();
                points.draw(&set, law, out);
            });
            if points.took_rest() {
                assert!(law == Law::Normal && set.size() > 2, "{set:?} {law:?}");
                rejected += 1;
                continue;
            }
            let (mean, variance) = set.moments(law);
            let n = samples.len() as f64;
            for i in 0..set.size() {
                let sum: f64 = samples.iter().map(|s| s[i]).sum();
                let squares: f64 = samples.iter().map(|s| (s[i] - mean[i]).powi(2)).sum();
                assert!((sum / n - mean[i]).abs() <= 0.25 * (variance[i] / n).sqrt() + 1e-15, "{set:?} {law:?} {i}");
                assert!((squares / n - variance[i]).abs() <= 1e-3 * variance[i], "{set:?} {law:?} {i}");
                for j in 0..i {
                    let mixed: f64 = samples.iter().map(|s| s[i] * s[j]).sum();
                    let one = (variance[i] * variance[j] / n).sqrt();
                    assert!((mixed / n).abs() <= 0.5 * one, "{set:?} {law:?} {i} {j}");
                }
            }
            if law != Law::Gauss {
                assert!(samples.iter().all(|offset| set.contains(offset, 1e-12)), "{set:?} {law:?}");
            }
        }
    }
    assert!(rejected > 0);
}

/// Wrenches that leave something undecided: every pattern of vanishing reactions and equal ones.
fn ties(set: &Set) -> Vec<Vec<f64>> {
    let grid = |n: usize| {
        (0..3_usize.pow(n as u32))
            .map(move |code| (0..n).map(|k| (code / 3_usize.pow(k as u32) % 3) as f64 - 1.0).collect::<Vec<f64>>())
    };
    match *set {
        Set::Disc { .. } | Set::Diamond { .. } | Set::Interval { .. } | Set::Ball { .. } | Set::Plate { .. } => {
            let arm = |k| if set.is_zero() { 1.0 } else { set.half_width(0) / set.half_width(k) };
            grid(set.size()).map(|f| f.iter().enumerate().map(|(k, f)| f * arm(k)).collect()).collect()
        }
        Set::Journal { half_length, .. } | Set::Sleeve { half_length, .. } => {
            let ends =
                |f: &[f64]| vec![f[0] + f[2], f[1] + f[3], half_length * (f[3] - f[1]), half_length * (f[0] - f[2])];
            let first = set.size() - 4;
            grid(set.size()).map(|f| [f[..first].to_vec(), ends(&f[first..])].concat()).collect()
        }
        Set::Guide { half_length, half_width, half_height, .. } => grid(4)
            .flat_map(|f| {
                let tie = half_height * f[0].abs().max(f[3].abs()) + half_width * f[1].abs().max(f[2].abs());
                [0.0, 0.5 * tie, tie, -tie, 1.0 + 2.0 * tie, -3.0]
                    .map(|roll| vec![f[0], f[1], roll, half_length * f[2], half_length * f[3]])
            })
            .collect(),
    }
}

#[test]
fn faces_reach_as_far_as_the_support_function_bends() {
    let mut rng = rng();
    for set in sets() {
        for w in ties(&set) {
            let face = set.face(&w, 1e-9);
            assert!((inner(&w, &face.centre) - set.support(&w)).abs() < 1e-14, "{set:?} {w:?}");
            assert!(face.half_width(&w) < 1e-14, "{set:?} {w:?}");
            let mut widest = 0.0_f64;
            for _ in 0..20 {
                // The one-sided derivative of the support function is the support function of the face.
                let v = wrench(&set, &mut rng);
                let step = 1e-7;
                let moved = |sign: f64| {
                    let to: Vec<f64> = w.iter().zip(&v).map(|(w, v)| w + sign * step * v).collect();
                    (set.support(&to) - set.support(&w)) / step
                };
                let half_width = face.half_width(&v);
                // Discs curve: half of the second derivative, r v^2 / |R|, times the step.
                assert!((0.5 * (moved(1.0) + moved(-1.0)) - half_width).abs() < 1e-5, "{set:?} {w:?} {v:?}");
                widest = widest.max(half_width);
            }
            assert_eq!(face.is_point(), widest == 0.0, "{set:?} {w:?}");
        }
    }
}

#[test]
fn the_nearest_points_of_faces_are_on_them_and_nearest() {
    let mut rng = rng();
    for set in sets().iter().filter(|s| !s.is_zero()) {
        let n = set.size();
        let offsets = samples(set, Law::Uniform, 1);
        for w in ties(set) {
            let face = set.face(&w, 1e-9);
            let support = set.support(&w);
            let onto: Vec<[f64; MAX_SIZE]> = offsets.iter().map(|offset| face.nearest(offset)).collect();
            let unit: Vec<[f64; MAX_SIZE]> = onto.iter().map(|o| set.to_unit(o)).collect();
            for _ in 0..10 {
                let (i, j) = (rng.random_range(0..onto.len()), rng.random_range(0..onto.len()));
                assert!(set.contains(&onto[i][..n], 1e-14), "{set:?} {w:?}");
                assert!((inner(&w, &onto[i]) - support).abs() < 1e-13, "{set:?} {w:?} {:?}", onto[i]);
                let from = set.to_unit(&offsets[i]);
                let (mut turn, mut still) = (0.0, 0.0);
                for k in 0..n {
                    turn += (from[k] - unit[i][k]) * (unit[j][k] - unit[i][k]);
                    still += (onto[i][k] - offsets[i][k]).abs();
                }
                assert!(turn < 1e-14, "{set:?} {w:?}: another point of the face is nearer");
                if w.iter().all(|w| *w == 0.0) {
                    assert!(still < 1e-15, "what nothing pushes stays");
                }
            }
        }
    }
}

#[test]
fn the_farthest_points_of_faces_are_on_them_and_as_far_as_they_reach() {
    let mut rng = rng();
    for set in sets() {
        let n = set.size();
        for w in ties(&set) {
            let face = set.face(&w, 1e-9);
            for _ in 0..20 {
                let v = wrench(&set, &mut rng);
                let opposite: Vec<f64> = v.iter().map(|v| -v).collect();
                let ends = [face.farthest(&v), face.farthest(&opposite)];
                for end in &ends {
                    assert!(set.contains(&end[..n], 1e-13), "{set:?} {w:?} {v:?}");
                    assert!((inner(&w, end) - set.support(&w)).abs() < 1e-13, "{set:?} {w:?} {v:?}");
                }
                let width = 0.5 * (inner(&v, &ends[0]) - inner(&v, &ends[1]));
                assert!((width - face.half_width(&v)).abs() < 1e-13, "{set:?} {w:?} {v:?}");
            }
        }
    }
}

#[test]
fn rounding_noise_decides_nothing() {
    let mut rng = rng();
    for set in sets().iter().filter(|s| !s.is_zero()) {
        for w in ties(set) {
            let noisy: Vec<f64> = w.iter().map(|w| w + 1e-13 * rng.random_range(-1.0..1.0)).collect();
            let (face, other) = (set.face(&w, 1e-9), set.face(&noisy, 1e-9));
            assert_eq!(face.is_point(), other.is_point());
            for k in 0..set.size() {
                assert!((face.centre[k] - other.centre[k]).abs() < 1e-12, "{set:?} {w:?}");
            }
        }
    }
}

#[test]
fn a_tie_exposes_an_edge_and_no_load_exposes_all() {
    let set = Set::Diamond { gap: 1.0, half_length: 2.0 };
    let edge = set.face(&[1.0, 2.0], 1e-12);
    assert!(!edge.is_point());
    assert!((edge.half_width(&[1.0, 0.0]) - 0.5).abs() < 1e-15);
    assert!(edge.half_width(&[1.0, 2.0]).abs() < 1e-15);
    let whole = set.face(&[0.0, 0.0], 1e-12);
    assert!((whole.half_width(&[0.0, 1.0]) - 0.5).abs() < 1e-15);
    assert!(set.face(&[1.0, 0.0], 1e-12).is_point());
}

#[test]
fn a_force_through_one_end_of_a_pin_leaves_the_other_end_free() {
    let set = Set::Journal { radius: 0.1, half_length: 2.0, axial: 0.3 };
    // The moment about normal of a force 1 along side at +2 along the axis.
    let face = set.face(&[0.0, 1.0, 0.0, 0.0, 2.0], 1e-12);
    let centre = [0.0, 0.05, 0.0, 0.0, 0.025];
    assert!(face.centre.iter().zip(centre).all(|(a, b)| (a - b).abs() < 1e-16));
    assert!((face.half_width(&[1.0, 0.0, 0.0, 0.0, 0.0]) - 0.3).abs() < 1e-15);
    assert!((face.half_width(&[0.0, 0.0, 1.0, 0.0, 0.0]) - 0.05).abs() < 1e-15);
    assert!((face.half_width(&[0.0, 0.0, 0.0, 1.0, 0.0]) - 0.025).abs() < 1e-15);
}

#[test]
fn sizes_without_bound_are_refused() {
    let refused = |set: Set, message: &str| {
        assert_eq!(set.check().unwrap_err().to_string(), message);
    };
    let guide = Set::Guide { gap: 0.1, half_length: 1.0, half_width: 0.0, half_height: 0.0 };
    refused(guide, "half_width of the guide is 0: it must be finite and above zero");
    let journal = Set::Journal { radius: 0.1, half_length: 0.0, axial: 0.0 };
    refused(journal, "half_length of the journal is 0: it must be finite and above zero");
    let ball = Set::Ball { radius: -1.0 };
    refused(ball, "radius of the ball is -1: it must be finite and not negative");
    let interval = Set::Interval { low: 0.1, high: 1.0 };
    refused(interval, "low of the interval is 0.1: it must not be above zero");
    let guide = Set::Guide { gap: 0.1, half_length: 1.0, half_width: 0.0, half_height: 1.0 };
    assert!(guide.check().is_ok());
}
