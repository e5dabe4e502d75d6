//! Flanks of couplings in a section, whose play opens and closes with what the other clearances take.
//!
//! In own coordinates an offset x of a flank displaces its row by `y = x g`, with `g = g_0 + B y` linear in the
//! coordinates y of all clearances ([`crate::redundancy::openings`]; y is x for those that are no flanks). The
//! compatibility of the y is linear, and where the offsets are compatible the law p of the x has in y the density
//!
//! ```text
//! p(x(y)) |det dx/dy|,   |det dx/dy| = |det(1 - X B_f)| / product of all g
//! ```
//!
//! with the columns `B_f` of the flanks and X the diagonal of their x. The gaps are known where the y are compatible only:
//! multiples of the equations may be added to B, and with them the determinant depends on the rows that are taken for
//! redundant. Of all these B the one that is least in the displacements of the flanks is taken. The law is then that of
//! specimens which are kept where flanks miss each other by less than a small length all together, whatever their order.
//!
//! A proposal takes the x of the flanks that are free by their law and solves for all y. In the coordinates that are free
//! its density is `p(x_free) |det dx_free/dy_free|` along the section; what remains of the density above is its weight.

use nalgebra::{DMatrix, DVector};

use crate::math::decomposition::{determinant, pseudo_inverse};
use crate::math::lanes::block::{Block, LANES, Mask, bits_if};
use crate::math::lanes::simd::{Kernel, dispatch};

/// No coordinate of a flank that opens flanks is above this in proposals.
const WIDEST: f64 = 2.0;
/// Up to so many flanks that open one another the determinant is looked at in all corners.
const CORNERS: usize = 10;
/// Proposals are not made where a flank that they are solved for may close to less than this part.
const NARROWEST: f64 = 0.1;
/// Nor where the gaps of flanks change one another by more than the rest of this part.
const CONTRACTS: f64 = 0.5;
/// Directions in which equations ask for less than this part of the most are not there.
const ASKS: f64 = 1e-9;

/// The flanks of a section.
#[derive(Clone, Debug, Default)]
pub(crate) struct Opened {
    /// Their coordinates.
    places: Vec<usize>,
    precisions: Vec<f64>,
    /// By gap, what all coordinates do to it, what those of the flanks do to it, and how much all of them do at most.
    rates: Vec<Vec<f64>>,
    together: Vec<Vec<f64>>,
    reach: Vec<f64>,
    /// By gap, what those of the flanks do to it by the least of all maps that agree where the equations hold.
    least: Vec<Vec<f64>>,
    /// The part of it by the clearances beside flanks.
    reach_beside: Vec<f64>,
    /// What flanks do to one another at most, and the free ones along the section at least, as determinants.
    bends: [f64; 2],
    /// The numbers of those that are free, and of those that the equations are solved for.
    free: Vec<usize>,
    bound: Vec<usize>,
    /// By gap of a free flank, what free coordinates do to it along the section: those beside flanks, and those of flanks.
    beside: Vec<Vec<f64>>,
    along: Vec<Vec<f64>>,
    /// What the equations are solved for.
    solved: Vec<usize>,
    free_places: Vec<usize>,
}

/// What the proposals of a specimen have in common.
pub(crate) struct Proposals {
    /// The gaps of the free flanks where all free coordinates are zero.
    gaps: Vec<f64>,
    /// A weight that none is above.
    pub largest: f64,
}

fn dot<'a>(rates: &[f64], y: impl IntoIterator<Item = &'a f64>) -> f64 {
    rates.iter().zip(y).map(|(b, y)| b * y).sum()
}

fn size(rates: &[f64]) -> f64 {
    rates.iter().map(|b| b.abs()).sum()
}

impl Opened {
    /// From the places of the flanks with their precisions and half-widths, from the equations of all coordinates, from
    /// what these do to the gaps, and the clearances beside flanks at most; the bound coordinates follow from the free ones
    /// by `-from_free`.
    pub fn new(
        flanks: &[(usize, f64, f64)],
        equations: &DMatrix<f64>,
        rates: Vec<Vec<f64>>,
        reach_beside: Vec<f64>,
        bound: &[usize],
        free: &[usize],
        from_free: &DMatrix<f64>,
    ) -> Self {
        let (places, precisions): (Vec<usize>, Vec<f64>) = flanks.iter().map(|flank| (flank.0, flank.1)).unzip();
        let numbers = |among: &[usize]| (0..places.len()).filter(|&f| among.contains(&places[f])).collect();
        let (own_free, own_bound): (Vec<usize>, Vec<usize>) = (numbers(free), numbers(bound));
        let along_section = |f: &usize| -> Vec<f64> {
            let follows =
                |c: usize| -> f64 { bound.iter().enumerate().map(|(r, &j)| rates[*f][j] * from_free[(r, c)]).sum() };
            free.iter().enumerate().map(|(c, &j)| rates[*f][j] - follows(c)).collect()
        };
        let all: Vec<Vec<f64>> = own_free.iter().map(along_section).collect();
        let column = |f: &usize| free.iter().position(|&j| j == places[*f]).unwrap_or_default();
        let columns: Vec<usize> = own_free.iter().map(column).collect();
        let without = |row: &Vec<f64>| {
            let mut row = row.clone();
            for &c in &columns {
                row[c] = 0.0;
            }
            row
        };
        let beside = all.iter().map(without).collect();
        let along: Vec<Vec<f64>> = all.iter().map(|row| columns.iter().map(|&c| row[c]).collect()).collect();
        let together: Vec<Vec<f64>> = rates.iter().map(|row| places.iter().map(|&j| row[j]).collect()).collect();
        let reach = reach_beside.iter().zip(&together).map(|(reach, row)| reach + WIDEST * size(row)).collect();
        let least = least(&together, flanks, equations);
        let bends = [extremes(&least)[1], extremes(&along)[0]];
        Self {
            places,
            precisions,
            rates,
            together,
            reach,
            least,
            reach_beside,
            bends,
            free: own_free,
            bound: own_bound,
            beside,
            along,
            solved: bound.to_vec(),
            free_places: free.to_vec(),
        }
    }

    pub const fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// By how much coordinates may change a gap at most.
    pub fn reach(&self) -> f64 {
        self.reach.iter().copied().fold(0.0, f64::max)
    }

    /// The gaps that coordinates leave.
    fn gaps(&self, at_rest: &[f64], y: &[f64]) -> Vec<f64> {
        at_rest.iter().zip(&self.rates).map(|(rest, rates)| rest + dot(rates, y)).collect()
    }

    /// Coordinates with those of the flanks as parts of their gaps.
    pub fn closed(&self, at_rest: &[f64], y: &[f64]) -> Vec<f64> {
        let mut x = y.to_vec();
        self.places.iter().zip(self.gaps(at_rest, y)).for_each(|(&j, gap)| x[j] /= gap);
        x
    }

    /// The other way about.
    pub fn opened(&self, at_rest: &[f64], x: &[f64]) -> Option<Vec<f64>> {
        let mut rest = x.to_vec();
        self.places.iter().for_each(|&j| rest[j] = 0.0);
        let splat = |values: &[f64]| values.iter().map(|value| Block::splat(*value)).collect::<Vec<Block>>();
        let own: Vec<f64> = self.places.iter().map(|&j| x[j]).collect();
        let mut solved = splat(&own);
        let gaps = splat(&self.gaps(at_rest, &rest));
        let all = dispatch(Solve { y: &mut solved, gaps: &gaps, rates: &self.together });
        let mut y = x.to_vec();
        self.places.iter().zip(solved).for_each(|(&j, own)| y[j] = own.0[0]);
        all.has(0).then_some(y)
    }

    /// What is common to all proposals where the bound coordinates are the constant and what follows from the free ones;
    /// `None` where proposals are of no use.
    pub fn proposals(&self, at_rest: &[f64], constant: &DVector<f64>) -> Option<Proposals> {
        for (f, gap) in at_rest.iter().enumerate() {
            if gap + self.reach[f] > WIDEST && self.together.iter().any(|row| row[f] != 0.0) {
                return None;
            }
        }
        // Diagonals that outweigh the rest of their rows: the determinant along the section is positive everywhere.
        if self.along.iter().any(|row| 1.0 - size(row) < CONTRACTS) {
            return None;
        }
        // No coordinate of a flank is above its gap.
        let widest: Vec<f64> = at_rest.iter().zip(&self.reach).map(|(gap, reach)| gap + reach).collect();
        let narrowest = |&f: &usize| -> f64 {
            let by_flanks: f64 = self.together[f].iter().zip(&widest).map(|(rate, most)| rate.abs() * most).sum();
            at_rest[f] - self.reach_beside[f] - by_flanks
        };
        let narrowest: Vec<f64> = self.bound.iter().map(narrowest).collect();
        if narrowest.iter().any(|gap| *gap < NARROWEST) {
            return None;
        }
        let [most, least] = self.bends;
        let largest = most / (least * narrowest.iter().product::<f64>());
        let gap = |&f: &usize| -> f64 {
            at_rest[f] + self.solved.iter().zip(constant.iter()).map(|(&j, b)| self.rates[f][j] * b).sum::<f64>()
        };
        Some(Proposals { gaps: self.free.iter().map(gap).collect(), largest })
    }

    /// Makes coordinates of the offsets of the free flanks, in a block of proposals; gives where that is possible.
    #[inline(always)]
    pub fn open_free(&self, proposals: &Proposals, own: &mut [Block]) -> Mask {
        let mut y: Vec<Block> = self.free.iter().map(|&f| own[self.places[f]]).collect();
        let mut gaps = Vec::with_capacity(y.len());
        for (gap, row) in proposals.gaps.iter().zip(&self.beside) {
            let mut sum = Block::splat(0.0);
            for (rate, &j) in row.iter().zip(&self.free_places) {
                add_times(&mut sum, *rate, &own[j]);
            }
            gaps.push(Block::splat(*gap).add(&sum));
        }
        let solved = Solve { y: &mut y, gaps: &gaps, rates: &self.along }.run();
        self.free.iter().zip(y).for_each(|(&f, y)| own[self.places[f]] = y);
        solved
    }

    /// How large a bound coordinate of a block of proposals may be: of a flank, its gap.
    #[inline(always)]
    pub fn most(&self, place: usize, at_rest: &[f64], own: &[Block]) -> Block {
        let Some(f) = self.bound.iter().copied().find(|&f| self.places[f] == place) else { return Block::splat(1.0) };
        let mut sum = Block::splat(0.0);
        for (rate, y) in self.rates[f].iter().zip(own) {
            add_times(&mut sum, *rate, y);
        }
        Block::splat(at_rest[f]).add(&sum)
    }

    /// Makes offsets of the coordinates of all flanks of a proposal, and of the gaps at rest what they are there; gives
    /// whether all are open.
    pub fn close(&self, gaps: &mut [f64], u: &mut [f64]) -> bool {
        gaps.iter_mut().zip(&self.rates).for_each(|(gap, rates)| *gap += dot(rates, &*u));
        self.places.iter().zip(&*gaps).for_each(|(&j, gap)| u[j] /= gap);
        gaps.iter().all(|gap| *gap > 0.0)
    }

    /// The weight of a proposal, by its gaps and offsets.
    pub fn weight(&self, gaps: &[f64], u: &[f64], room: &mut Vec<f64>) -> f64 {
        let opened: f64 = self.bound.iter().map(|&f| gaps[f]).product();
        self.bend(u, room) / (opened * bend(&self.along, |k| u[self.places[self.free[k]]], room))
    }

    /// What flanks do to the gaps of one another, as a determinant.
    fn bend(&self, x: &[f64], room: &mut Vec<f64>) -> f64 {
        bend(&self.least, |f| x[self.places[f]], room)
    }

    /// The logarithm of the density that the flanks add.
    pub fn log_density(&self, at_rest: &[f64], y: &[f64]) -> f64 {
        let gaps = self.gaps(at_rest, y);
        let x = self.closed(at_rest, y);
        let law = self.places.iter().zip(&self.precisions).map(|(&j, precision)| -0.5 * precision * x[j] * x[j]);
        law.sum::<f64>() + (self.bend(&x, &mut Vec::new()) / gaps.iter().product::<f64>()).abs().ln()
    }

    /// What the flanks leave of the line `y + t along`.
    pub fn chord(&self, at_rest: &[f64], y: &[f64], along: &[f64]) -> [f64; 2] {
        let mut chord = [f64::NEG_INFINITY, f64::INFINITY];
        for (f, &j) in self.places.iter().enumerate() {
            let (gap, opening) = (at_rest[f] + dot(&self.rates[f], y), dot(&self.rates[f], along));
            for side in [1.0, -1.0] {
                let (left, rate) = (gap - side * y[j], side * along[j] - opening);
                if rate > 0.0 {
                    chord[1] = chord[1].min(left / rate);
                } else if rate < 0.0 {
                    chord[0] = chord[0].max(left / rate);
                }
            }
        }
        chord
    }
}

/// Finds the y with `y = X (gaps + rates y)`, which begin as the x, for every lane; gives where no gap is closed.
///
/// By elimination without pivoting: in proposals the diagonals of `1 - X rates` outweigh the rest of their rows, and
/// elsewhere a pivot that is not positive means flanks that pass through each other.
struct Solve<'a> {
    y: &'a mut [Block],
    gaps: &'a [Block],
    rates: &'a [Vec<f64>],
}

impl Kernel for Solve<'_> {
    type Output = Mask;

    #[inline(always)]
    fn run(self) -> Mask {
        let Self { y, gaps, rates } = self;
        let n = y.len();
        let mut matrix = Vec::with_capacity(n * n);
        for (f, rates) in rates.iter().enumerate() {
            for (k, rate) in rates.iter().enumerate() {
                let unit = Block::splat(f64::from(u8::from(f == k)));
                matrix.push(unit.sub(&y[f].mul(&Block::splat(*rate))));
            }
        }
        for (y, gap) in y.iter_mut().zip(gaps) {
            *y = y.mul(gap);
        }
        let mut open = Mask([u64::MAX; LANES]);
        let keep_positive = |block: &Block, open: &mut Mask| {
            for lane in 0..LANES {
                open.0[lane] &= bits_if(block.0[lane] > 0.0);
            }
        };
        for p in 0..n {
            keep_positive(&matrix[p * n + p], &mut open);
            for row in p + 1..n {
                let factor = matrix[row * n + p].div(&matrix[p * n + p]);
                for k in p + 1..n {
                    matrix[row * n + k] = matrix[row * n + k].sub(&factor.mul(&matrix[p * n + k]));
                }
                y[row] = y[row].sub(&factor.mul(&y[p]));
            }
        }
        for p in (0..n).rev() {
            for k in p + 1..n {
                y[p] = y[p].sub(&matrix[p * n + k].mul(&y[k]));
            }
            y[p] = y[p].div(&matrix[p * n + p]);
        }
        for (gap, rates) in gaps.iter().zip(rates) {
            let mut gap = *gap;
            for (rate, y) in rates.iter().zip(&*y) {
                add_times(&mut gap, *rate, y);
            }
            keep_positive(&gap, &mut open);
        }
        open
    }
}

/// Adds so many times a block.
#[inline(always)]
fn add_times(sum: &mut Block, factor: f64, block: &Block) {
    if factor != 0.0 {
        *sum = sum.add(&block.mul(&Block::splat(factor)));
    }
}

/// The least of the maps `B + L A` of the displacements of flanks, with A their columns of the equations, any L, and own
/// coordinates that are the displacements as parts of the half-widths.
fn least(together: &[Vec<f64>], flanks: &[(usize, f64, f64)], equations: &DMatrix<f64>) -> Vec<Vec<f64>> {
    if together.iter().flatten().all(|b| *b == 0.0) {
        return together.to_vec();
    }
    let half = |k: usize| flanks[k].2;
    let asked = DMatrix::from_fn(equations.nrows(), flanks.len(), |i, k| equations[(i, flanks[k].0)] / half(k));
    let rates = DMatrix::from_fn(flanks.len(), flanks.len(), |f, k| together[f][k] / half(k));
    let Some(inverse) = pseudo_inverse(&asked, ASKS * asked.norm()) else { return together.to_vec() };
    let rates = &rates - &rates * inverse * asked;
    (0..flanks.len()).map(|f| (0..flanks.len()).map(|k| rates[(f, k)] * half(k)).collect()).collect()
}

/// `|det(1 - X B)|`
fn bend(rates: &[Vec<f64>], x: impl Fn(usize) -> f64, room: &mut Vec<f64>) -> f64 {
    if rates.iter().flatten().all(|b| *b == 0.0) {
        return 1.0;
    }
    room.clear();
    for (f, rates) in rates.iter().enumerate() {
        let x = x(f);
        room.extend(rates.iter().enumerate().map(|(k, rate)| f64::from(u8::from(f == k)) - x * rate));
    }
    determinant(rates.len(), room).abs()
}

/// Bounds of `det(1 - X B)` in magnitude, for diagonal X from -1 to 1. The determinant is linear in each x, so that the
/// largest magnitude is that of a corner, and so is the smallest where no sign changes; for many flanks by Hadamard's
/// inequality, and by the product of what the diagonals outweigh their rows by.
fn extremes(rates: &[Vec<f64>]) -> [f64; 2] {
    let opening: Vec<usize> = (0..rates.len()).filter(|&f| rates[f].iter().any(|b| *b != 0.0)).collect();
    if opening.len() > CORNERS {
        let by = |part: fn(f64) -> f64| rates.iter().map(|row| part(size(row))).product();
        return [by(|size| (1.0 - size).max(0.0)), by(|size| 1.0 + size)];
    }
    let mut room = Vec::new();
    let corner = |number: usize| {
        let side = |f: usize| {
            let place = opening.iter().position(|o| *o == f);
            place.map_or(0.0, |place| if number >> place & 1 == 1 { 1.0 } else { -1.0 })
        };
        bend(rates, side, &mut room)
    };
    (0..1 << opening.len()).map(corner).fold([f64::INFINITY, 0.0], |[least, most], b| [least.min(b), most.max(b)])
}
