//! One configuration of a mechanism.

/// One configuration to analyse: drive values, and the nominal coordinates that errors refer to.
#[derive(Clone, Copy, Debug)]
pub struct Case<'a> {
    /// Drive values.
    pub drives: &'a [f64],
    /// Nominal coordinates of all bodies; not finite where the nominal mechanism is not assembled.
    pub coordinates: &'a [f64],
}
