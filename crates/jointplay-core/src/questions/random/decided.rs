//! What a load decides of specimens.

use std::sync::OnceLock;

use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;

/// The sources of which a load decides the place in the specimen without deviations, also where its work has a minimum in the
/// middle. Specimens in which forces leave such a source open are solved by themselves.
pub(super) struct Decided<'a> {
    mechanism: &'a Mechanism,
    case: Case<'a>,
    by_source: OnceLock<Vec<bool>>,
}

impl<'a> Decided<'a> {
    pub const fn new(mechanism: &'a Mechanism, case: Case<'a>) -> Self {
        Self { mechanism, case, by_source: OnceLock::new() }
    }

    /// Whether one of some sources is.
    pub fn any(&self, sources: &[usize]) -> bool {
        let m = self.mechanism;
        let found = || m.loaded_specimen(&m.centre, &self.case).map_or_else(Vec::new, |loaded| loaded.decided);
        !sources.is_empty() && {
            let decided = self.by_source.get_or_init(found);
            sources.iter().any(|&source| decided.get(source).is_some_and(|decided| *decided))
        }
    }
}
