//! Moments, histograms and counts of samples, mergeable without loss.

use crate::interrupt;
use crate::math::lanes::block::{Block, LANES, Mask, bits_if};
use crate::mechanism::dim::BINS;
use crate::mechanism::status::Status;
use crate::questions::columns::Sample;
use crate::questions::random::request::Request;

/// Fine bins per handed-out bin; quantiles are read from the fine ones.
const FINE: usize = 8;
/// All fine bins of a quantity.
const ALL: usize = BINS * FINE;
/// Room beyond the first-order range, for what the exact closure adds.
const ROOM: f64 = 1.25;
/// The share of the samples that may be beyond a range, of the smallest tail that is asked for.
const BEYOND: f64 = 0.05;
/// What is in fewer of the fine bins than one in so many is not resolved, where the range is not that of first order.
const CROWDED: usize = 8;
/// Samples by which ranges are chosen before all are drawn, where those of first order are much too wide.
const FIRST: usize = 128;
/// How often ranges are chosen.
const MOST_RANGES: usize = 8;
/// Errors below this part of a mechanism's size are rounding.
const ROUNDING: f64 = 1e-12;

/// The range of every quantity's histogram.
pub struct Ranges {
    low: Vec<f64>,
    width: Vec<f64>,
    /// Fine bins per unit of each quantity.
    density: Vec<f64>,
    /// Which are no longer those of first order.
    found: Vec<bool>,
    /// Which miss samples all the same: what is beyond them is not known.
    missed: Vec<bool>,
}

impl Ranges {
    /// From the mean and half-range of every component.
    pub fn new(mean: &[f64], half: &[f64], translations: usize) -> Self {
        // A quantity that cannot vary still needs a bin to fall in.
        let reach: Vec<f64> =
            mean.iter().zip(half).map(|(m, h)| (ROOM * h).max(1e-12 * m.abs()).max(f64::MIN_POSITIVE.sqrt())).collect();
        let mut low: Vec<f64> = mean.iter().zip(&reach).map(|(m, r)| m - r).collect();
        let mut width: Vec<f64> = reach.iter().map(|r| 2.0 * r).collect();
        let size =
            |range: std::ops::Range<usize>| range.map(|i| (mean[i].abs() + reach[i]).powi(2)).sum::<f64>().sqrt();
        low.extend([0.0, 0.0]);
        width.extend([size(0..translations), size(translations..mean.len())]);
        let density = width.iter().map(|w| ALL as f64 / w).collect();
        let (found, missed) = (vec![false; low.len()], vec![false; low.len()]);
        Self { low, width, density, found, missed }
    }

    /// Draws samples, again and again until all but a few of them are within the ranges: those of first order miss what
    /// moves the output by its square, and a few that go far would leave all others in one bin. `size` is that of the mechanism.
    pub fn until_found<T>(
        mut self,
        request: &Request,
        size: f64,
        draw: impl Fn(&Request, &Self) -> Vec<T>,
        tally: impl Fn(&T) -> &Tally,
    ) -> (Self, Vec<T>) {
        let tails = request.probabilities.iter().map(|p| p.min(1.0 - p));
        let few = BEYOND * tails.fold(0.5, f64::min);
        // A load holds the play, which is most of what first order reaches.
        self.found.fill(request.loaded);
        if request.loaded && request.samples > FIRST {
            self.choose(&Request { samples: FIRST, ..request.clone() }, size, 0.0, 1.0, &draw, &tally);
            self.missed.fill(false);
        }
        let drawn = self.choose(request, size, few, 0.25, &draw, &tally);
        (self, drawn)
    }

    /// Draws samples until the ranges will do; narrower ones have a part of what the samples take beside them as room.
    fn choose<T>(
        &mut self,
        request: &Request,
        size: f64,
        few: f64,
        room: f64,
        draw: &impl Fn(&Request, &Self) -> Vec<T>,
        tally: &impl Fn(&T) -> &Tally,
    ) -> Vec<T> {
        for tried in 1.. {
            let drawn = draw(request, self);
            let better = self.better(&drawn.iter().map(tally).collect::<Vec<_>>(), few, room, size);
            if better.is_empty() {
                return drawn;
            }
            if tried == MOST_RANGES || interrupt::is_asked() {
                for (q, _) in better {
                    self.missed[q] = true;
                }
                return drawn;
            }
            for (q, [low, high]) in better {
                (self.low[q], self.width[q], self.found[q]) = (low, high - low, true);
                self.density[q] = ALL as f64 / self.width[q];
            }
        }
        unreachable!("the last try returns")
    }

    /// Better ranges of quantities for which these will not do, with a share of the samples that may be beyond.
    fn better(&self, drawn: &[&Tally], few: f64, room: f64, size: f64) -> Vec<(usize, [f64; 2])> {
        let few = few * drawn.iter().map(|tally| tally.count).sum::<u64>() as f64;
        let of = |q: usize| {
            let (low, high) = (self.low[q], self.low[q] + self.width[q]);
            let far = drawn.iter().fold(0.0, |far: f64, tally| far.max(tally.largest[q]));
            let bin = |b: usize| drawn.iter().map(|tally| tally.bins(q)[b]).sum::<u64>() as f64;
            // A size has no other end.
            let is_size = q + 2 >= self.len();
            let farthest = [if is_size { 0.0 } else { low.min(-far) }, high.max(far)];
            if far <= ROUNDING * size {
                return None;
            }
            if (bin(ALL - 1) > few || !is_size && bin(0) > few)
                && farthest[1] - farthest[0] > (1.0 + ROUNDING) * self.width[q]
            {
                return Some((q, farthest));
            }
            if !self.found[q] {
                return None;
            }
            // How many bins from an end have but a few samples.
            let empty = |nth: &dyn Fn(usize) -> usize| {
                let mut sum = 0.0;
                (0..ALL).position(|k| {
                    sum += bin(nth(k));
                    sum > few
                })
            };
            let (first, last) = (empty(&|k| k)?, ALL - 1 - empty(&|k| ALL - 1 - k)?);
            let room = (room * (last - first) as f64) as usize + 1;
            let [first, last] = [first.saturating_sub(room), (last + 1 + room).min(ALL)];
            let at = |b: usize| low + self.width[q] * b as f64 / ALL as f64;
            let is_wide = at(last) - at(first) > ROUNDING * size.max(far);
            (last - first < ALL / CROWDED && is_wide).then(|| (q, [at(first), at(last)]))
        };
        (0..self.len()).filter_map(of).collect()
    }

    fn len(&self) -> usize {
        self.low.len()
    }

    /// Width of the fine bins.
    pub fn resolution(&self) -> Vec<f64> {
        self.width.iter().map(|w| w / ALL as f64).collect()
    }

    /// Edges of the handed-out bins.
    pub fn edges(&self) -> Vec<f64> {
        let of = |q: usize| (0..=BINS).map(move |b| self.low[q] + self.width[q] * b as f64 / BINS as f64);
        (0..self.len()).flat_map(of).collect()
    }
}

/// What is kept of a set of samples.
#[derive(Clone)]
pub struct Tally {
    /// Solved samples.
    pub count: u64,
    /// Mean of every component.
    pub mean: Vec<f64>,
    /// Sums of products of deviations from the mean, row by row.
    products: Vec<f64>,
    bins: Vec<u64>,
    /// Largest size of every quantity.
    pub largest: Vec<f64>,
    /// Samples beyond the limits, by the quantity; in the end those beyond any.
    outside: Vec<u64>,
    /// Samples whose sizes leave an interference, by the clearance.
    pub interference: Vec<u64>,
    /// Samples with first-order errors below thresholds, and those that were compared with them.
    pub below: Vec<u64>,
    pub compared: u64,
    /// Samples by status.
    pub statuses: [u64; Status::ALL.len()],
    /// Samples solved plainly.
    pub fallbacks: u64,
    /// The samples themselves.
    pub kept: Option<Vec<Sample>>,
}

/// Sums of the components and of their products about a common shift, and the largest size of every
/// quantity, lane by lane.
pub struct Sums {
    count: u64,
    values: Vec<Block>,
    /// Lower triangle, row by row.
    products: Vec<Block>,
    largest: Vec<Block>,
}

impl Sums {
    pub fn new(components: usize, quantities: usize) -> Self {
        let zeros = |n: usize| vec![Block::splat(0.0); n];
        Self {
            count: 0,
            values: zeros(components),
            products: zeros(components * (components + 1) / 2),
            largest: zeros(quantities),
        }
    }

    /// Adds the good lanes of a block; the others may hold anything.
    #[inline(always)]
    pub fn add(&mut self, quantities: &[Block], good: &Mask, shift: &[f64]) {
        self.count += good.count();
        // One loop over the lanes for each number of components, so that nothing goes through memory.
        match self.values.len() {
            3 => self.add_components::<3, 6>(quantities, good, shift),
            6 => self.add_components::<6, 21>(quantities, good, shift),
            n => unreachable!("errors have 3 or 6 components, not {n}"),
        }
    }

    #[inline(always)]
    fn add_components<const N: usize, const P: usize>(&mut self, quantities: &[Block], good: &Mask, shift: &[f64]) {
        let (values, quantities_of_error) = (&mut self.values[..N], &quantities[..N]);
        let (products, shift) = (&mut self.products[..P], &shift[..N]);
        let mut l = 0;
        while l < LANES {
            let mut about = [0.0; N];
            let mut k = 0;
            let mut i = 0;
            while i < N {
                let value = quantities_of_error[i].0[l] - shift[i];
                about[i] = f64::from_bits(value.to_bits() & good.0[l]);
                values[i].0[l] += about[i];
                let mut j = 0;
                while j <= i {
                    products[k].0[l] = about[i].mul_add(about[j], products[k].0[l]);
                    k += 1;
                    j += 1;
                }
                i += 1;
            }
            l += 1;
        }
        for (largest, quantity) in self.largest.iter_mut().zip(quantities) {
            let mut l = 0;
            while l < LANES {
                let size = f64::from_bits(quantity.0[l].abs().to_bits() & good.0[l]);
                largest.0[l] = if size > largest.0[l] { size } else { largest.0[l] };
                l += 1;
            }
        }
    }
}

impl Tally {
    pub fn new(components: usize, sources: usize, ranges: &Ranges) -> Self {
        Self {
            count: 0,
            mean: vec![0.0; components],
            products: vec![0.0; components * components],
            bins: vec![0; ranges.len() * ALL],
            largest: vec![0.0; ranges.len()],
            outside: vec![0; ranges.len() + 1],
            interference: vec![0; sources],
            below: Vec::new(),
            compared: 0,
            statuses: [0; Status::ALL.len()],
            fallbacks: 0,
            kept: None,
        }
    }

    /// Adds one solved sample.
    pub fn add(&mut self, ranges: &Ranges, shift: &[f64], quantities: &[f64], limits: &[[f64; 2]]) {
        let mut sums = Sums::new(self.mean.len(), quantities.len());
        let blocks: Vec<Block> = quantities.iter().map(|&q| Block::splat(q)).collect();
        let mut first = Mask::NONE;
        first.0[0] = u64::MAX;
        sums.add(&blocks, &first, shift);
        self.count_block(ranges, &blocks, &first);
        self.statuses[Status::Ok as usize] += 1;
        self.count_outside(limits, &blocks, &first);
        self.absorb(&sums, shift);
    }

    /// Counts the good lanes of a block of quantities into the histograms.
    #[inline(always)]
    #[allow(unsafe_code)]
    pub fn count_block(&mut self, ranges: &Ranges, quantities: &[Block], good: &Mask) {
        const { assert!(ALL.is_power_of_two()) };
        for (q, values) in quantities.iter().enumerate() {
            let (low, density) = (ranges.low[q], ranges.density[q]);
            // Beyond the range the end bins serve.
            let mut bin = [0_u32; LANES];
            let mut i = 0;
            while i < LANES {
                let inside = ((values.0[i] - low) * density).max(0.0).min((ALL - 1) as f64);
                // SAFETY: between 0 and the last bin; `max` has turned a NaN into 0.
                bin[i] = unsafe { inside.to_int_unchecked::<i32>() } as u32;
                i += 1;
            }
            let bins = &mut self.bins[q * ALL..][..ALL];
            for i in 0..LANES {
                // The last bin as a mask changes nothing but spares a check.
                bins[bin[i] as usize & (ALL - 1)] += good.0[i] & 1;
            }
        }
    }

    /// Counts the good lanes of a block that are beyond the limits.
    #[inline(always)]
    pub fn count_outside(&mut self, limits: &[[f64; 2]], quantities: &[Block], good: &Mask) {
        let mut any = Mask::NONE;
        for ((&[low, high], values), outside) in limits.iter().zip(quantities).zip(&mut self.outside) {
            if low == f64::NEG_INFINITY && high == f64::INFINITY {
                continue;
            }
            for i in 0..LANES {
                let out = good.0[i] & (bits_if(values.0[i] < low) | bits_if(values.0[i] > high));
                any.0[i] |= out;
                *outside += out & 1;
            }
        }
        if let Some(outside) = self.outside.last_mut() {
            *outside += any.count();
        }
    }

    /// Share of the samples beyond the limits of each quantity, and beyond any; NaN where there is none. A sample without
    /// a pose keeps to no limit.
    pub fn outside(&self, limits: &[[f64; 2]]) -> (Vec<f64>, f64) {
        let drawn = self.drawn();
        let share = |k: usize| (self.outside[k] + drawn - self.count) as f64 / drawn as f64;
        let is_limited = |limit: &[f64; 2]| limit.iter().any(|bound| bound.is_finite());
        let last = self.outside.len() - 1;
        let of = |k: usize| if limits.get(k).is_some_and(is_limited) { share(k) } else { f64::NAN };
        ((0..last).map(of).collect(), if limits.iter().any(is_limited) { share(last) } else { f64::NAN })
    }

    /// Adds the moments of the samples summed about `shift`.
    pub fn absorb(&mut self, sums: &Sums, shift: &[f64]) {
        let n = self.mean.len();
        for (largest, block) in self.largest.iter_mut().zip(&sums.largest) {
            *largest = block.0.iter().fold(*largest, |a, &b| a.max(b));
        }
        let total = |b: &Block| b.0.iter().sum::<f64>();
        if sums.count == 0 {
            return;
        }
        let count = sums.count as f64;
        let offset: Vec<f64> = sums.values.iter().map(|b| total(b) / count).collect();
        let mean: Vec<f64> = offset.iter().zip(shift).map(|(o, s)| o + s).collect();
        let mut products = vec![0.0; n * n];
        let mut k = 0;
        for i in 0..n {
            for j in 0..=i {
                let about_mean = total(&sums.products[k]) - count * offset[i] * offset[j];
                products[i * n + j] = about_mean;
                products[j * n + i] = about_mean;
                k += 1;
            }
        }
        self.merge_moments(sums.count, &mean, &products);
    }

    /// Chan's update.
    fn merge_moments(&mut self, count: u64, mean: &[f64], products: &[f64]) {
        let n = self.mean.len();
        if count == 0 {
            return;
        }
        let (a, b) = (self.count as f64, count as f64);
        let between: Vec<f64> = (0..n).map(|i| mean[i] - self.mean[i]).collect();
        for i in 0..n {
            for j in 0..n {
                self.products[i * n + j] += products[i * n + j] + between[i] * between[j] * (a * b / (a + b));
            }
        }
        for i in 0..n {
            self.mean[i] += between[i] * (b / (a + b));
        }
        self.count += count;
    }

    /// Adds all samples of another tally.
    pub fn merge(&mut self, other: &Self) {
        self.merge_moments(other.count, &other.mean, &other.products);
        for (a, b) in self.outside.iter_mut().zip(&other.outside) {
            *a += b;
        }
        self.fallbacks += other.fallbacks;
        self.compared += other.compared;
        self.below.resize(other.below.len(), 0);
        self.below.iter_mut().zip(&other.below).for_each(|(a, b)| *a += b);
        self.interference.iter_mut().zip(&other.interference).for_each(|(a, b)| *a += b);
        if let Some(more) = &other.kept {
            self.kept.get_or_insert_default().extend_from_slice(more);
        }
        self.bins.iter_mut().zip(&other.bins).for_each(|(a, b)| *a += b);
        self.statuses.iter_mut().zip(&other.statuses).for_each(|(a, b)| *a += b);
        self.largest.iter_mut().zip(&other.largest).for_each(|(a, b)| *a = a.max(*b));
    }

    /// Samples drawn, solved or not.
    pub fn drawn(&self) -> u64 {
        self.statuses.iter().sum()
    }

    /// Share of the samples drawn whose sizes leave an interference, by the clearance.
    pub fn share_of_interference(&self) -> Vec<f64> {
        let drawn = self.drawn();
        self.interference.iter().map(|count| *count as f64 / drawn as f64).collect()
    }

    /// Unbiased covariance.
    pub fn covariance(&self) -> Vec<f64> {
        let n = self.mean.len();
        let of = |(k, p): (usize, &f64)| {
            // Rounding may leave a component that does not vary slightly below zero.
            let p = if k % (n + 1) == 0 { p.max(0.0) } else { *p };
            p / (self.count as f64 - 1.0)
        };
        self.products.iter().enumerate().map(of).collect()
    }

    /// The mean square of a component about a value.
    pub fn variance_about(&self, i: usize, value: f64) -> f64 {
        let n = self.mean.len();
        (self.products[i * (n + 1)] / self.count as f64).max(0.0) + (self.mean[i] - value).powi(2)
    }

    /// The fourth moment of a component about its mean, by the middles of its fine bins.
    pub fn fourth_moment(&self, ranges: &Ranges, i: usize) -> f64 {
        let width = ranges.width[i] / ALL as f64;
        let of = |(b, &count): (usize, &u64)| {
            let middle = (b as f64 + 0.5).mul_add(width, ranges.low[i]);
            count as f64 * (middle - self.mean[i]).powi(4)
        };
        self.bins(i).iter().enumerate().map(of).sum::<f64>() / self.count as f64
    }

    fn bins(&self, q: usize) -> &[u64] {
        &self.bins[q * ALL..(q + 1) * ALL]
    }

    /// A quantile of a quantity, interpolated within its fine bin; no further out than any sample. NaN beyond a range that
    /// misses samples.
    pub fn quantile(&self, ranges: &Ranges, q: usize, probability: f64) -> f64 {
        let rank = probability * self.count as f64;
        let mut below = 0.0;
        for (b, &count) in self.bins(q).iter().enumerate() {
            let here = count as f64;
            if here > 0.0 && below + here >= rank {
                if ranges.missed[q] && (b == 0 || b == ALL - 1) {
                    break;
                }
                let place = b as f64 + ((rank - below) / here).clamp(0.0, 1.0);
                let value = ranges.low[q] + ranges.width[q] * place / ALL as f64;
                return value.clamp(-self.largest[q], self.largest[q]);
            }
            below += here;
        }
        f64::NAN
    }

    /// The share of the samples below a value of a quantity, interpolated within its fine bin.
    pub fn below(&self, ranges: &Ranges, q: usize, value: f64) -> f64 {
        let place = ((value - ranges.low[q]) * ranges.density[q]).clamp(0.0, ALL as f64);
        let bins = self.bins(q);
        let whole = bins[..place as usize].iter().sum::<u64>() as f64;
        let part = bins.get(place as usize).map_or(0.0, |&count| count as f64 * place.fract());
        (whole + part) / self.count as f64
    }

    /// Counts in the handed-out bins.
    pub fn histogram(&self) -> Vec<u64> {
        self.bins.chunks_exact(FINE).map(|fine| fine.iter().sum()).collect()
    }
}
