//! A configuration, ready to be climbed.

use crate::closure::newton::State;
use crate::mechanism::status::Status;
use crate::questions::worst::on_lanes::Site;
use crate::questions::worst::starts::Extreme;

/// One configuration, ready to be climbed.
pub(crate) struct Prepared<'a> {
    pub nominal: State,
    /// Known deviations in place, no play taken.
    pub built: State,
    pub site: Site<'a>,
    pub extremes: Vec<Extreme>,
    pub(crate) status: Status,
}
