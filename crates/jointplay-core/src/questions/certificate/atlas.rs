//! Enclosures that together hold the poses for all values that the sets allow.
//!
//! One box holds them all where clearances are small. Where they are not, the sets are divided into cells of slabs, and
//! every cell has a box of its own. Where two cells meet, each has exactly one pose for every value. Both depend on the
//! value without a jump and nowhere meet another pose, so that they are the same in all values if they are in one: this
//! is proved for one value of every pair of neighbours, and all belong to the branch of the middle then.

use std::ops::Range;
use std::rc::Rc;

use crate::interrupt;
use crate::math::interval::Interval;
use crate::math::vector::norm;
use crate::questions::certificate::blocks::Part;
use crate::questions::certificate::errors::{Errors, Expansion, Refused};
use crate::questions::certificate::slabs::SHARED;

/// Expansions over all of the sets.
pub(super) struct Atlas {
    pub cells: Vec<Rc<Expansion>>,
}

/// The places that the cells have along each of the slabs.
struct Grid {
    divisions: Vec<u32>,
}

impl Grid {
    /// All cells by their numbers along the slabs, from the middle outwards.
    fn cells(&self) -> Vec<Vec<u32>> {
        let mut cells = vec![Vec::new()];
        for &divisions in &self.divisions {
            let longer = |cell: &Vec<u32>| (0..divisions).map(|k| [&cell[..], &[k]].concat()).collect::<Vec<_>>();
            cells = cells.iter().flat_map(longer).collect();
        }
        cells.sort_by(|a, b| norm(&self.middle(a)).total_cmp(&norm(&self.middle(b))));
        cells
    }

    fn edge(&self, slab: usize, k: u32) -> f64 {
        2.0 * f64::from(k) / f64::from(self.divisions[slab]) - 1.0
    }

    fn middle(&self, cell: &[u32]) -> Vec<f64> {
        let middle = |(slab, &k): (usize, &u32)| 0.5 * (self.edge(slab, k) + self.edge(slab, k + 1));
        cell.iter().enumerate().map(middle).collect()
    }

    /// Whether two neighbours have the same pose at a point of both: between points of the sets in them, or in the middle
    /// across the slabs.
    fn are_one_branch(&self, errors: &Errors<'_>, both: [(&Vec<u32>, &Expansion); 2]) -> bool {
        let product = &errors.encloser.product;
        let [(a, one), (b, other)] = both;
        let slab = (0..a.len()).find(|&slab| a[slab] != b[slab]).unwrap_or(0);
        let [from, to] = [one, other].map(|cell| product.centre(&cell.enclosure.part));
        let [first, last] = [&from, &to].map(|x| x[product.n + slab]);
        let along = (self.edge(slab, a[slab].max(b[slab])) - first) / (last - first);
        let on_line: Vec<f64> =
            from.iter().zip(&to).take(product.n).map(|(from, to)| from + along * (to - from)).collect();
        let middle: Vec<f64> = self.middle(a).iter().zip(self.middle(b)).map(|(a, b)| 0.5 * (a + b)).collect();
        let is_one = |x| errors.encloser.is_one_branch(x, [&one.enclosure, &other.enclosure]);
        is_one(product.slabs.point(&on_line)) || is_one(product.slabs.at(&middle))
    }

    fn places(&self, cell: &[u32]) -> Vec<Interval> {
        let places =
            |(slab, &k): (usize, &u32)| Interval::new(self.edge(slab, k) - SHARED, self.edge(slab, k + 1) + SHARED);
        cell.iter().enumerate().map(places).collect()
    }
}

fn are_neighbours(a: &[u32], b: &[u32]) -> bool {
    a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).sum::<u32>() == 1
}

impl Atlas {
    /// Of one cell, or of so many along what moves most; `None` where there is nothing to divide, or there would be more
    /// cells than `most`.
    pub fn new(errors: &mut Errors<'_>, divisions: u32, most: u64) -> Result<Option<Self>, Refused> {
        let all = 0..errors.encloser.chart.mechanism.size();
        let at = errors.encloser.middle().ok_or(Refused::Singular)?;
        if divisions == 1 {
            let whole = errors.expansion(&errors.encloser.product.whole(), at, &all)?;
            return Ok(Some(Self { cells: vec![Rc::new(whole)] }));
        }
        if errors.encloser.product.slabs.len() == 0 && !errors.encloser.divide(&at) {
            return Ok(None);
        }
        let sizes = &errors.encloser.product.slabs.sizes;
        let of = |size: &f64| (f64::from(divisions) * size).ceil() as u32;
        let grid = Grid { divisions: sizes.iter().map(of).collect() };
        if grid.divisions.iter().map(|&d| u64::from(d)).product::<u64>() > most {
            return Ok(None);
        }
        let product = &errors.encloser.product;
        let mut cells: Vec<(Vec<u32>, Rc<Expansion>)> = Vec::new();
        for cell in grid.cells() {
            interrupt::check();
            let Some(part) = product.cell(&grid.places(&cell)) else { continue };
            let neighbours: Vec<_> = cells.iter().filter(|(other, _)| are_neighbours(other, &cell)).collect();
            let about = |x: Vec<f64>| {
                let at = match neighbours.first() {
                    Some((_, known)) => errors.encloser.beside(x, &known.enclosure),
                    None if cells.is_empty() => errors.encloser.middle(),
                    None => None,
                };
                let found = errors.expansion(&part, at.ok_or(Refused::NotEnclosed)?, &all)?;
                let is_one = |(other, known): &&(Vec<u32>, Rc<Expansion>)| {
                    grid.are_one_branch(errors, [(other, known.as_ref()), (&cell, &found)])
                };
                if neighbours.iter().copied().all(|one| is_one(&one)) { Ok(found) } else { Err(Refused::NotEnclosed) }
            };
            // Bounds are closer about a point in the sets; beside them, in the middle across the slabs, more is enclosed.
            let found = about(product.centre(&part)).or_else(|_| about(product.slabs.at(&grid.middle(&cell))))?;
            cells.push((cell, Rc::new(found)));
        }
        Ok(Some(Self { cells: cells.into_iter().map(|(_, found)| found).collect() }))
    }

    /// The expansion over a part that belongs to the one of another expansion.
    pub fn expanded(
        &self,
        errors: &Errors<'_>,
        part: &Part,
        within: &Expansion,
        components: &Range<usize>,
    ) -> Option<Expansion> {
        let x = errors.encloser.product.centre(part);
        // The point may lie beside the part.
        let known = if within.enclosure.part.has(&x) { within } else { self.around(&x)? };
        let at = errors.encloser.at(x, &known.enclosure)?;
        errors.expansion(part, at, components).ok()
    }

    /// The expansion over a cell that a point is in.
    fn around(&self, x: &[f64]) -> Option<&Expansion> {
        self.cells.iter().find(|cell| cell.enclosure.part.has(x)).map(Rc::as_ref)
    }
}
