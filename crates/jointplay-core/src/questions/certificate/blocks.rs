//! Products of sets in coordinates of their own, parts of them, and what their optimality conditions leave.
//!
//! In own coordinates (see [`Set::of_unit`]) every set is a product of unit balls and polytopes. A part of the product is
//! a box of coordinates, and a list of corners for each polytope. At a maximum u* of a function over the product
//! every block is where its part of the gradient g is largest: with g known to be in a box,
//!
//! ```text
//! ball       u* = g / |g|
//! polytope   u* in the hull of the corners that some g in the box does not put below another corner
//! ```
//!
//! Where the product is divided into slabs ([`slabs`](super::slabs)), each of their places is one more coordinate, which
//! comes after those of the sets and depends on them.
//!
//! The blocks are larger than the sets by a part of `2^-48`. Their maps to offsets are linear with rounded
//! coefficients, and a coefficient off by a part of `2^-52` is a coordinate off by as much.

use crate::clearance::{Set, Shape};
use crate::math::interval::Interval;
use crate::math::vector::norm;
use crate::mechanism::Source;
use crate::questions::certificate::slabs::{SHARED, Slabs};

/// How large the blocks are.
const UNIT: f64 = 1.0 + 1.0 / (1_u64 << 48) as f64;
/// The middle of a box is moved to the boundary of its ball where it is farther from the middle of the ball than this.
const OUTER: f64 = 0.5;
/// Which part of a slab is cut off where no offsets are in it, and rounds of this.
const CUT: f64 = 0.15;
const TRIMMED: usize = 5;
/// Rounds in which a point is moved into slabs.
const ROUNDS: usize = 8;

/// A block: its first coordinate, and how many it has.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub first: usize,
    pub size: usize,
    /// Corners of a polytope; none for a ball.
    corners: Vec<Vec<f64>>,
}

/// A part of the product: a box of coordinates, and which corners of every block are left.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub x: Vec<Interval>,
    corners: Vec<u64>,
}

fn between(first: usize) -> Block {
    Block { first, size: 1, corners: vec![vec![-UNIT], vec![UNIT]] }
}

fn ball(first: usize, size: usize) -> Block {
    Block { first, size, corners: Vec::new() }
}

/// All corners of a box of given half-widths.
fn corners(half_widths: &[f64]) -> impl Iterator<Item = Vec<f64>> + '_ {
    let side = |corner: u32, k: usize| if corner >> k & 1 == 1 { half_widths[k] } else { -half_widths[k] };
    (0..1_u32 << half_widths.len()).map(move |corner| (0..half_widths.len()).map(|k| side(corner, k)).collect())
}

fn blocks_of(set: &Set, first: usize) -> Vec<Block> {
    match set.shape() {
        Shape::Round { size, .. } => vec![ball(first, size)],
        Shape::Diamond { .. } => vec![between(first), between(first + 1)],
        Shape::Interval { .. } => vec![between(first)],
        Shape::Pin(pin) => {
            let across = first + pin.across();
            (first..across).map(between).chain([ball(across, 2), ball(across + 2, 2)]).collect()
        }
        // Squares at the middle of the axis, and what is left of them at its ends.
        Shape::Tapered(tapered) => {
            let left = |part: f64| -> Vec<f64> {
                (0..2 * tapered.n).map(|k| UNIT * (1.0 - part * tapered.tapers[k / 2])).collect()
            };
            let at = |along: f64| {
                let squares = corners(&left(along.abs())).collect::<Vec<_>>();
                squares.into_iter().map(move |square| [vec![along * UNIT], square].concat())
            };
            let all = [0.0, 1.0, -1.0].into_iter().flat_map(at).collect();
            vec![Block { first, size: set.size(), corners: all }]
        }
    }
}

impl Block {
    pub fn range(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.size
    }

    /// What the distance from a point of the ball does not exceed; nothing is said of a polytope.
    pub fn radius(&self, from: &[f64]) -> f64 {
        if self.corners.is_empty() { UNIT * (UNIT + norm(&from[self.range()])) } else { f64::INFINITY }
    }

    /// The same, and from a point to another one.
    pub fn radius_with(&self, from: &[f64], other: &[f64]) -> f64 {
        let off: Vec<f64> = self.range().map(|k| other[k] - from[k]).collect();
        self.radius(from).max(norm(&off) * UNIT)
    }

    /// What the distance from a point to any in the part does not exceed.
    pub fn reach(&self, part: &Part, from: &[f64]) -> f64 {
        let far = |k: usize| (part.x[k].hull(Interval::from_point(from[k])) - Interval::from_point(from[k])).size();
        (norm(&self.range().map(far).collect::<Vec<_>>()) * UNIT).min(self.radius(from))
    }

    /// A ball around the part: the block itself where it is one, or a ball around what is left of it; an interval is one, too.
    /// Its middle as seen from a point, and its radius; `None` for other polytopes.
    pub fn ball(&self, part: &Part, from: &[f64], is_left: bool) -> Option<(Vec<f64>, f64)> {
        if !self.corners.is_empty() && self.size > 1 {
            return None;
        }
        let middle: Vec<f64> = self.range().map(|k| part.x[k].middle()).collect();
        let half: Vec<f64> =
            self.range().zip(&middle).map(|(k, m)| (part.x[k] - Interval::from_point(*m)).size()).collect();
        let radius = norm(&half) * UNIT;
        let from = &from[self.range()];
        if self.corners.is_empty() && (radius >= UNIT || !is_left) {
            return Some((from.iter().map(|f| -f).collect(), UNIT * UNIT));
        }
        // The difference, rounded, is off by less than its radius grows.
        let far = middle.iter().chain(from).fold(0.0, |far: f64, x| far.max(x.abs()));
        Some((middle.iter().zip(from).map(|(m, f)| m - f).collect(), radius + 1e-15 * far))
    }

    /// What `g . (x - from)` does not exceed on the part.
    pub fn support(&self, part: &Part, number: usize, g: &[Interval], from: &[f64]) -> f64 {
        let (g, from) = (&g[self.range()], &from[self.range()]);
        if g.iter().all(|g| g.is_zero()) {
            return 0.0;
        }
        let to = |x: &dyn Fn(usize) -> Interval| {
            let along = |k: usize| g[k] * (x(k) - Interval::from_point(from[k]));
            (0..self.size).fold(Interval::ZERO, |sum, k| sum + along(k)).high
        };
        let in_box = to(&|k| part.x[self.first + k]);
        let in_set = if self.corners.is_empty() {
            beyond(g, from)
        } else {
            let left = self.corners_left(part.corners[number]);
            left.map(|corner| to(&|k| Interval::from_point(corner[k]))).fold(f64::NEG_INFINITY, f64::max)
        };
        in_box.min(in_set)
    }

    fn corners_left(&self, left: u64) -> impl Iterator<Item = &Vec<f64>> {
        self.corners.iter().enumerate().filter(move |(k, _)| left >> k & 1 == 1).map(|(_, corner)| corner)
    }

    /// Leaves of a part where a maximum can be that has its gradient in a box; false where nothing is left.
    fn leave_optima(&self, part: &mut Part, number: usize, g: &[Interval]) -> bool {
        let g = &g[self.range()];
        let left: Vec<Interval> = if self.corners.is_empty() {
            (0..self.size).map(|k| share(g, k).scaled(UNIT)).collect()
        } else {
            let ahead = |corner: &[f64], other: &[f64]| {
                let terms = g.iter().zip(corner.iter().zip(other));
                terms.fold(Interval::ZERO, |sum, (g, (a, b))| {
                    sum + *g * (Interval::from_point(*a) - Interval::from_point(*b))
                })
            };
            let height = |corner: &[f64]| corner.iter().zip(g).map(|(x, g)| x * g.middle()).sum::<f64>();
            let Some(best) = self.corners.iter().max_by(|a, b| height(a).total_cmp(&height(b))) else { return false };
            let stays = |corner: &Vec<f64>| !(ahead(best, corner).low > 0.0);
            let kept = self.corners.iter().enumerate().filter(|(_, corner)| stays(corner));
            part.corners[number] &= kept.fold(0, |kept, (k, _)| kept | 1 << k);
            let along = |k: usize| {
                let reached = self.corners_left(part.corners[number]).map(|corner| Interval::from_point(corner[k]));
                reached.reduce(Interval::hull)
            };
            match (0..self.size).map(along).collect() {
                Some(hull) => hull,
                None => return false,
            }
        };
        self.range().zip(left).all(|(k, left)| {
            let common = part.x[k].common(left);
            part.x[k] = common.unwrap_or(part.x[k]);
            common.is_some()
        })
    }

    /// Where a part is expanded about, a point of the set: the middle of the box; on the boundary of a ball where the
    /// part is there; the mean of what is left of several corners.
    fn centre(&self, part: &Part, number: usize) -> Vec<f64> {
        if !self.corners.is_empty() && self.size > 1 {
            let left: Vec<&Vec<f64>> = self.corners_left(part.corners[number]).collect();
            let mean = |k: usize| left.iter().map(|corner| corner[k] / UNIT).sum::<f64>() / left.len() as f64;
            return (0..self.size).map(mean).collect();
        }
        let mut middle: Vec<f64> = self.range().map(|k| part.x[k].middle()).collect();
        let distance = norm(&middle);
        if self.corners.is_empty() && distance > OUTER {
            for x in &mut middle {
                *x /= distance;
            }
        }
        middle
    }
}

/// The component of `g / |g|`, for g in a box.
fn share(g: &[Interval], k: usize) -> Interval {
    let others = (0..g.len()).filter(|&j| j != k).fold(Interval::ZERO, |sum, j| sum + g[j].square());
    // It grows with g_k, and goes to zero where the others grow.
    let at = |x: f64, square: f64| {
        let x = Interval::from_point(x);
        if x.is_zero() { x } else { x / (x.square() + Interval::from_point(square)).root() }
    };
    let (low, high) = (g[k].low, g[k].high);
    let least = at(low, if low >= 0.0 { others.high } else { others.low });
    let most = at(high, if high >= 0.0 { others.low } else { others.high });
    Interval::new(least.low.max(-1.0), most.high.min(1.0))
}

/// What `g . (x - from)` does not exceed on the ball: `|g| - g . from`, written without the difference,
///
/// ```text
/// |g| - g . c = (|g x c|^2 + |g|^2 (1 - |c|^2)) / (|g| + g . c)
/// ```
fn beyond(g: &[Interval], from: &[f64]) -> f64 {
    let from: Vec<Interval> = from.iter().map(|&x| Interval::from_point(x)).collect();
    let sum = |of: &dyn Fn(usize) -> Interval| (0..g.len()).fold(Interval::ZERO, |sum, k| sum + of(k));
    let square = sum(&|k| g[k].square());
    let (size, along) = (square.root().scaled(UNIT), sum(&|k| g[k] * from[k]));
    let plain = (size - along).high;
    let across = (0..g.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let across = across.fold(Interval::ZERO, |sum, (i, j)| sum + (g[i] * from[j] - g[j] * from[i]).square());
    let rest = Interval::from_point(UNIT).square() - sum(&|k| from[k].square());
    let together = size + along;
    if together.low > 0.0 { plain.min(((across + square * rest) / together).high) } else { plain }
}

/// The product of the sets of some sources.
pub(super) struct Product {
    pub blocks: Vec<Block>,
    /// Coordinates of the sets, and what they are divided into besides.
    pub n: usize,
    pub slabs: Slabs,
}

impl Product {
    pub fn of(sources: &[Source]) -> Self {
        let blocks: Vec<Block> = sources.iter().flat_map(|source| blocks_of(&source.set, source.first)).collect();
        let n = blocks.iter().map(|block| block.size).sum();
        Self { blocks, n, slabs: Slabs::none(n) }
    }

    /// Divides it into slabs.
    pub fn divide(&mut self, slabs: Slabs) {
        self.blocks.extend((0..slabs.len()).map(|k| between(self.n + k)));
        self.slabs = slabs;
    }

    /// How far it goes along a direction, which has no share in slabs.
    pub fn reach(&self, direction: &[f64]) -> f64 {
        let g: Vec<Interval> = direction.iter().map(|&g| Interval::from_point(g)).collect();
        self.spread(&self.whole(), &g, &vec![0.0; direction.len()]).high
    }

    /// Whether of some ball only a part is left that a smaller ball holds.
    pub fn is_smaller(&self, part: &Part) -> bool {
        let is_smaller = |block: &Block| {
            let widths: Vec<f64> = block.range().map(|k| 0.5 * part.x[k].width()).collect();
            norm(&widths) < 1.0
        };
        self.blocks.iter().filter(|block| block.corners.is_empty()).any(is_smaller)
    }

    /// All of it.
    pub fn whole(&self) -> Part {
        let x = self.blocks.iter().flat_map(|block| vec![Interval::of_size(UNIT); block.size]);
        Part { x: x.collect(), corners: vec![u64::MAX; self.blocks.len()] }
    }

    /// What of it is in given slabs; `None` where nothing is.
    pub fn cell(&self, places: &[Interval]) -> Option<Part> {
        let mut part = self.whole();
        part.x[self.n..].copy_from_slice(places);
        if self.is_empty(&part) {
            return None;
        }
        self.trim(&mut part);
        Some(part)
    }

    /// Cuts off the sides of slabs in which no offsets of a part are.
    fn trim(&self, part: &mut Part) {
        for k in (self.n..part.x.len()).cycle().take(TRIMMED * self.slabs.len()) {
            for is_low in [true, false] {
                let all = part.x[k];
                let cut = CUT * all.width();
                let [off, left] = if is_low {
                    [Interval::new(all.low, all.low + cut), Interval::new(all.low + cut - SHARED, all.high)]
                } else {
                    [Interval::new(all.high - cut, all.high), Interval::new(all.low, all.high - cut + SHARED)]
                };
                part.x[k] = off;
                part.x[k] = if self.is_empty(part) { left } else { all };
            }
        }
    }

    /// Whether no offsets of a part are in its slabs, as some directions show in which they do not go as far.
    fn is_empty(&self, part: &Part) -> bool {
        let middle = vec![0.0; part.x.len()];
        self.slabs.ahead().iter().any(|ahead| {
            let farthest =
                self.supports(part, ahead, &middle).fold(Interval::ZERO, |sum, s| sum + Interval::from_point(s));
            farthest.high < 0.0
        })
    }

    /// The blocks that are sets, by their numbers.
    fn own(&self) -> impl Iterator<Item = (usize, &Block)> {
        self.blocks.iter().enumerate().take_while(|(_, block)| block.first < self.n)
    }

    /// A point of a part, or near it, that belongs to the product; in its slabs as far as that goes.
    pub fn centre(&self, part: &Part) -> Vec<f64> {
        let mut x: Vec<f64> = self.own().flat_map(|(number, block)| block.centre(part, number)).collect();
        for _ in 0..if self.slabs.len() > 0 { ROUNDS } else { 0 } {
            self.slabs.move_to_middle(&mut x, &part.x);
            x.iter_mut().zip(&part.x).for_each(|(x, within)| *x = x.clamp(within.low, within.high));
            for (_, block) in self.own().filter(|(_, block)| block.corners.is_empty()) {
                let size = norm(&x[block.range()]).max(1.0);
                x[block.range()].iter_mut().for_each(|x| *x /= size);
            }
        }
        self.slabs.point(&x)
    }

    /// What `g . (x - from)` does not exceed on a part, block by block.
    pub fn supports<'p>(
        &'p self,
        part: &'p Part,
        g: &'p [Interval],
        from: &'p [f64],
    ) -> impl Iterator<Item = f64> + 'p {
        self.blocks.iter().enumerate().map(move |(number, block)| block.support(part, number, g, from))
    }

    /// All values of `g . (x - from)` on a part and on the lines to it from the point.
    pub fn spread(&self, part: &Part, g: &[Interval], from: &[f64]) -> Interval {
        let sum = |g: &[Interval]| {
            let all = self.supports(part, g, from).fold(Interval::ZERO, |sum, s| sum + Interval::from_point(s));
            all.high.max(0.0)
        };
        let opposite: Vec<Interval> = g.iter().map(|g| -*g).collect();
        Interval::new(-sum(&opposite), sum(g))
    }

    /// What forms are written about: the middle of a part that is divided into slabs, at the place of the point. Along the
    /// slabs poses differ little from that of the point; across them they are where the offsets have no share in them.
    pub fn base(&self, part: &Part, point: &[f64]) -> Vec<f64> {
        let mut base = point.to_vec();
        if self.slabs.len() > 0 {
            base.iter_mut().zip(&part.x).take(self.n).for_each(|(base, x)| *base = x.middle());
        }
        base
    }

    /// Leaves of a part where a maximum can be that has its gradient along the coordinates of the sets in a box; false
    /// where nothing is left.
    pub fn leave_optima(&self, part: &mut Part, g: &[Interval]) -> bool {
        if !self.own().all(|(number, block)| block.leave_optima(part, number, g)) {
            return false;
        }
        let n = self.n;
        let places = self.slabs.places(&part.x[..n]);
        let is_left = part.x[n..].iter_mut().zip(places).all(|(t, place)| {
            let common = t.common(place);
            *t = common.unwrap_or(*t);
            common.is_some()
        });
        is_left && !self.is_empty(part)
    }

    /// Two halves of a part along a coordinate.
    pub fn halves(&self, part: &Part, coordinate: usize) -> [Part; 2] {
        let middle = part.x[coordinate].middle();
        let shared = if coordinate < self.n { 0.0 } else { SHARED };
        let mut halves = [part.clone(), part.clone()];
        halves[0].x[coordinate].high = middle + shared;
        halves[1].x[coordinate].low = middle - shared;
        halves
    }
}

impl Part {
    /// The part as it is, with a point.
    pub fn around(&self, point: &[f64]) -> Vec<Interval> {
        self.x.iter().zip(point).map(|(x, p)| x.hull(Interval::from_point(*p))).collect()
    }

    /// Whether a point is in its box.
    pub fn has(&self, point: &[f64]) -> bool {
        self.x.iter().zip(point).all(|(x, p)| x.contains(*p))
    }
}
