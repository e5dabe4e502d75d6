//! Which form of a question fits a mechanism: the one place that decides it.

use crate::mechanism::Mechanism;

/// How a question is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// By closure and statics.
    Determinate,
    /// By compatibility and stiffness, too.
    OverConstrained,
}

impl Mechanism {
    /// Whether every row is needed and every joint rigid, so that load and closure need no compatibility.
    #[must_use]
    pub fn is_isostatic(&self) -> bool {
        self.form(true) == Form::Determinate
    }

    /// The form that fits; where nothing `is_forced`, elastic joints are as rigid ones.
    pub(crate) fn form(&self, is_forced: bool) -> Form {
        let gives_way = is_forced && !self.elastic.is_empty();
        if self.n_rows() == self.n_unknowns() && !gives_way { Form::Determinate } else { Form::OverConstrained }
    }
}
