//! Offsets by rejection and by chains.

use super::*;
use crate::clearance::samples::KINDS;

/// Coefficients without a pattern.
fn map(set: &Set, equations: usize, seed: usize) -> Vec<f64> {
    (0..equations * set.size()).map(|k| ((k + 7 * seed) as f64 * 0.618_034 + 0.3).fract() - 0.5).collect()
}

/// A clearance where nothing opens.
fn rigid(set: Set, law: Law, map: Vec<f64>) -> Member {
    Member { set, law, map, opens: Vec::new(), is_flank: false }
}

fn section(set: Set, law: Law, equations: usize) -> Section {
    let member = |(seed, set): (usize, Set)| rigid(set, law, map(&set, equations, seed));
    Section::new([set, Set::Disc { radius: 0.6 }].into_iter().enumerate().map(member).collect(), equations)
}

/// Mean and variance of a direction of no meaning, and of the squared length.
fn moments(samples: &[Vec<f64>]) -> [f64; 4] {
    let numbers: Vec<[f64; 2]> = samples
        .iter()
        .map(|u| {
            let along = u.iter().enumerate().map(|(k, u)| u * (k as f64 * 0.9).cos()).sum();
            [along, u.iter().map(|u| u * u).sum()]
        })
        .collect();
    let n = numbers.len() as f64;
    let mean = |q: usize| numbers.iter().map(|x| x[q]).sum::<f64>() / n;
    let spread = |q: usize| (numbers.iter().map(|x| (x[q] - mean(q)).powi(2)).sum::<f64>() / n).sqrt();
    [mean(0), spread(0), mean(1), spread(1)]
}

#[test]
fn a_chain_has_the_law_of_rejection() {
    let count = 1500;
    for set in KINDS {
        for (law, equations) in [(Law::Uniform, 1), (Law::Normal, 1), (Law::Uniform, 2)] {
            let section = section(set, law, equations);
            let inside: Vec<f64> = section.places.iter().map(|p| 0.25 * (p.k as f64 + 1.3).sin()).collect();
            let right = &section.matrix * DVector::from_vec(inside.clone()) + &section.middle;
            let constant = &section.from_right * (&right - &section.middle);
            let proposals = section.opened.proposals(&[], &constant).unwrap();
            let (mut rejected, mut walked) = (Vec::new(), Vec::new());
            let mut own = vec![Block::splat(0.0); section.places.len()];
            for specimen in 0..count {
                let mut dice = Dice::new(1, specimen);
                rejected.push(
                    std::iter::repeat_with(|| section.reject(&constant, &[], &proposals, &mut dice, &mut own))
                        .flatten()
                        .next()
                        .unwrap(),
                );
                walked.push(section.walk(inside.clone(), &[], &mut Dice::new(2, specimen)).unwrap());
            }
            for u in rejected.iter().chain(&walked) {
                let left = &section.matrix * DVector::from_vec(u.clone()) + &section.middle - &right;
                assert!(left.amax() < 1e-12, "{set:?}");
                for (member, offset) in section.members.iter().zip(section.offsets(u)) {
                    assert!(member.set.contains(&offset[..member.set.size()], 1e-9), "{set:?} {law:?}");
                }
            }
            let (a, b) = (moments(&rejected), moments(&walked));
            for q in [0, 2] {
                // Five standard errors of the difference of two means; spreads have about half of that.
                let error = 5.0 * a[q + 1] * (2.0 / count as f64).sqrt();
                assert!((a[q] - b[q]).abs() < error, "{set:?} {law:?} {equations} {a:?} {b:?}");
                assert!((a[q + 1] - b[q + 1]).abs() < error, "{set:?} {law:?} {equations} {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn a_chain_has_the_law_of_rejection_where_flanks_open() {
    // A bearing opens two flanks, one of which opens the other.
    let flank = |map: f64, opens: [f64; 2], law: Law| Member {
        set: Set::Interval { low: -1.0, high: 1.0 },
        law,
        map: vec![map],
        opens: opens.to_vec(),
        is_flank: true,
    };
    let (count, gaps) = (6000, [1.1, 0.9]);
    for law in [Law::Uniform, Law::Normal] {
        for weight in [0.3, 2.0] {
            // What the equations are solved for is the bearing or a flank.
            let disc = Member {
                opens: vec![0.4, 0.1, -0.2, 0.3],
                ..rigid(Set::Disc { radius: 1.0 }, law, vec![weight, -0.5 * weight])
            };
            let members = vec![disc, flank(1.0, [0.0, 0.2], law), flank(-0.7, [0.0, 0.0], law)];
            let section = Section::new(members, 1);
            let right = DVector::from_element(1, 0.2);
            let constant = &section.from_right * &right;
            let proposals = section.opened.proposals(&gaps, &constant).unwrap();
            let start: Vec<f64> = (section.matrix.transpose() * (0.2 / section.matrix.norm_squared())).data.into();
            let (mut rejected, mut walked) = (Vec::new(), Vec::new());
            let mut own = vec![Block::splat(0.0); section.places.len()];
            for specimen in 0..count {
                let mut dice = Dice::new(1, specimen);
                let drawn = || section.reject(&constant, &gaps, &proposals, &mut dice, &mut own);
                rejected.push(std::iter::repeat_with(drawn).flatten().next().unwrap());
                let y = section.walk(start.clone(), &gaps, &mut Dice::new(2, specimen)).unwrap();
                walked.push(section.opened.closed(&gaps, &y));
            }
            for x in rejected.iter().chain(&walked) {
                let y = section.opened.opened(&gaps, x).unwrap();
                assert!((&section.matrix * DVector::from_vec(y) - &right).amax() < 1e-12);
                assert!(
                    section
                        .members
                        .iter()
                        .zip(section.offsets(x))
                        .all(|(m, d)| m.set.contains(&d[..m.set.size()], 1e-9))
                );
            }
            for place in 0..4 {
                let of =
                    |samples: &[Vec<f64>]| moments(&samples.iter().map(|x| vec![x[place]]).collect::<Vec<Vec<f64>>>());
                let (a, b) = (of(&rejected), of(&walked));
                for q in [0, 2] {
                    // Five standard errors of the difference of two means.
                    let error = 5.0 * a[q + 1] * (2.0 / count as f64).sqrt();
                    assert!((a[q] - b[q]).abs() < error, "{law:?} {weight} {place} {a:?} {b:?}");
                }
            }
        }
    }
}

#[test]
fn offsets_between_two_discs_are_uniform_in_the_lens() {
    // Two pins and a bar along x that is b too long: x_2 - x_1 = b. For x_1 the two heights are free.
    let member = |sign: f64| rigid(Set::Disc { radius: 1.0 }, Law::Uniform, vec![sign, 0.0]);
    let section = Section::new(vec![member(-1.0), member(1.0)], 1);
    let b = 0.8;
    let right = DVector::from_element(1, b);
    // The density of x_1 is proportional to the product of both chords.
    let density = |x: f64| ((1.0 - x * x).max(0.0) * (1.0 - (x + b).powi(2)).max(0.0)).sqrt();
    let at = |k: i32| -1.0 + f64::from(k) / 10_000.0;
    let all: f64 = (0..20_000).map(|k| density(at(k))).sum();
    let mean: f64 = (0..20_000).map(|k| at(k) * density(at(k))).sum::<f64>() / all;
    let square: f64 = (0..20_000).map(|k| at(k).powi(2) * density(at(k))).sum::<f64>() / all;
    let count = 20_000;
    let drawn: Vec<f64> = (0..count)
        .map(|specimen| section.draw(&right, &[], &mut Dice::new(5, specimen), || None).unwrap()[0][0])
        .collect();
    let n = count as f64;
    let error = 5.0 * (square - mean * mean).sqrt() / n.sqrt();
    assert!((drawn.iter().sum::<f64>() / n - mean).abs() < error);
    assert!((drawn.iter().map(|x| x * x).sum::<f64>() / n - square).abs() < error);
}

#[test]
fn a_chain_forgets_its_start_where_little_room_is_left() {
    // Pins along a line take up nearly all that they can: a tenth of one radius is left to all of them together. Chains
    // start where each has the same of it and none is beside the line.
    let (pins, left) = (8, 0.1);
    let member = |_| rigid(Set::Disc { radius: 1.0 }, Law::Uniform, vec![1.0, 0.0]);
    let section = Section::new((0..pins).map(member).collect(), 1);
    // By how much a pin is short of its radius has the density of the chord there; of several, the convolution.
    let cells = 800;
    let short = |k: usize| left * (k as f64 + 0.5) / cells as f64;
    let one: Vec<f64> = (0..cells).map(|k| (short(k) * (2.0 - short(k))).sqrt()).collect();
    let others = (2..pins).fold(one.clone(), |sum, _| {
        (0..cells).map(|k| (0..=k).map(|i| sum[i] * one[k - i]).sum()).collect::<Vec<f64>>()
    });
    // The others are short of the rest together: middles of seven cells add up to three cells more.
    let density: Vec<f64> = (0..cells - 4).map(|k| one[k] * others[cells - 4 - k]).collect();
    let all: f64 = density.iter().sum();
    let chord = density.iter().enumerate().map(|(k, p)| p * short(k) * (2.0 - short(k))).sum::<f64>() / all;
    let count = 2000;
    let start: Vec<f64> = (0..pins).flat_map(|_| [1.0 - left / f64::from(pins), 0.0]).collect();
    let beside: Vec<f64> = (0..count)
        .map(|specimen| {
            let u = section.walk(start.clone(), &[], &mut Dice::new(3, specimen)).unwrap();
            u.chunks_exact(2).map(|pin| pin[1] * pin[1]).sum::<f64>() / f64::from(pins)
        })
        .collect();
    let n = count as f64;
    let mean = beside.iter().sum::<f64>() / n;
    let error = (beside.iter().map(|b| (b - mean).powi(2)).sum::<f64>() / n / n).sqrt();
    // Heights are uniform within the chord; 40 steps along lines of all pins for every dimension reach 0.7 of it.
    assert!((mean - chord / 3.0).abs() < 4.0 * error, "{mean} {} {error}", chord / 3.0);
}
