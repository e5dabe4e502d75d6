//! The four questions, each with its form on lanes and its form for over-constrained mechanisms.

pub mod given;
pub mod loaded;
pub mod random;
pub mod worst;

pub use given::over_constrained::Forced;
pub use loaded::first_order_on_lanes::FirstOrder;
pub use loaded::on_lanes::Contact;
pub use loaded::over_constrained::Strain;
pub use loaded::over_constrained::StrainTable;
pub use random::over_constrained::UnitScatter;
pub use random::specimens::UnitTable;
pub use random::tally::BINS;
pub use random::tally::Kept;
pub use worst::on_lanes::Climb;
pub use worst::on_lanes::Site;
pub use worst::on_lanes::Task;
pub use worst::worker::Climbed;
pub use worst::worker::Height;
pub use worst::worker::Pace;
