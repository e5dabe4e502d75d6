//! What programs that are solved together have in common.

use crate::cone::bodies::Own;
use crate::cone::lanes::cones::Cone;
use crate::cone::standard::Standard;
use crate::cone::{Kind, Program, Springs};

/// Which program is solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// Where the load holds the mechanism.
    Pose,
    /// The smallest factor on the clearances with which it can be assembled, elastic parts held rigid.
    Assembly,
}

/// A block's place among the components of all blocks, and what it is.
#[derive(Clone, Debug)]
pub(super) struct Place {
    pub first: usize,
    pub size: usize,
    pub part: Part,
}

/// What a block is, as far as programs have it in common.
#[derive(Clone, Debug)]
pub(super) enum Part {
    /// Offsets in coordinates of the set's own: the first of these, and the pairs of coordinate and
    /// component where one displaces the other.
    Offsets { first: usize, terms: Vec<(usize, usize)> },
    /// An elastic part that takes part.
    Spring,
    /// An elastic part held rigid.
    Rigid,
}

/// Number and order of everything in the programs' arrays.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub question: Question,
    pub places: Vec<Place>,
    pub cones: Vec<Cone>,
    /// Number of coordinates and of sizes.
    pub n: usize,
    pub n_sizes: usize,
    /// Number of components.
    pub width: usize,
    /// The equations that are independent, and the others.
    pub rows: Vec<usize>,
    pub implied: Vec<usize>,
}

impl Layout {
    /// The layout of programs like this one; nothing where there is nothing to solve for.
    pub fn of(program: &Program, question: Question) -> Option<Self> {
        let standard = match question {
            Question::Pose => Standard::pose(program),
            Question::Assembly => Standard::assembly(program, Springs::Rigid),
        };
        let implied = (0..program.n_equations()).filter(|i| !standard.rows.contains(i)).collect();
        let mut layout = Self {
            question,
            places: Vec::new(),
            cones: Vec::new(),
            n: 0,
            n_sizes: 0,
            width: 0,
            rows: standard.rows,
            implied,
        };
        let (mut slot, mut data) = (0, 0);
        for block in &program.blocks {
            let part = match &block.kind {
                Kind::Spring(_) if question == Question::Pose => Part::Spring,
                Kind::Spring(_) => Part::Rigid,
                Kind::Clearance(set) | Kind::Fixed(set) => {
                    let own = Own::of(set);
                    let first = layout.n;
                    let scaled = question == Question::Assembly && matches!(block.kind, Kind::Clearance(_));
                    for (from, atom) in own.atoms() {
                        let cone = Cone { atom, first: first + from, slot, data, size: layout.n_sizes, scaled };
                        slot += cone.slots();
                        data += cone.data_size();
                        layout.n_sizes += cone.sizes();
                        layout.cones.push(cone);
                    }
                    layout.n += own.columns().len();
                    let columns = own.columns().iter().enumerate();
                    let terms = columns
                        .flat_map(|(k, column)| (0..set.size()).filter(|c| column[*c] != 0.0).map(move |c| (k, c)));
                    Part::Offsets { first, terms: terms.collect() }
                }
            };
            layout.places.push(Place { first: layout.width, size: block.size(), part });
            layout.width += block.size();
        }
        (layout.n > 0 && !layout.rows.is_empty()).then_some(layout)
    }

    /// Whether a block's set has the same moving parts here as in the layout.
    pub fn fits(&self, own: &Own, place: &Place) -> bool {
        let Part::Offsets { first, terms } = &place.part else { return true };
        let columns = own.columns();
        let mut cones = self.cones.iter().skip_while(|cone| cone.first < *first);
        own.atoms().all(|(from, atom)| {
            let same = |cone: &Cone| {
                cone.first == first + from
                    && std::mem::discriminant(&cone.atom) == std::mem::discriminant(&atom)
                    && cone.atom.size() == atom.size()
            };
            cones.next().is_some_and(same)
        }) && cones.next().is_none_or(|cone| cone.first >= first + columns.len())
            && columns.iter().flatten().filter(|c| **c != 0.0).count() == terms.len()
    }
}
