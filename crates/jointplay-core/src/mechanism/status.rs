//! What became of a configuration or of a sample. A status is a result, never an error.

/// The outcome of one configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// Solved.
    Ok = 0,
    /// The drives ask for what the links cannot reach.
    NotAssembled = 1,
    /// The closure Jacobian is singular within the tolerance: a body moves with the drives held.
    Singular = 2,
    /// A body is free to move.
    Underconstrained = 3,
    /// A reaction vanishes, so that the load does not decide where the joint goes.
    Undetermined = 4,
    /// Over-constrained, members carry force.
    Strained = 5,
    /// Rigid and over-constrained, and the clearances cannot absorb the deviations.
    NotAssemblable = 6,
    /// The pose lies behind a singularity: no way leads there on which the determinant of the closure keeps its sign.
    OtherBranch = 7,
    /// A drive or a joint would have to leave its range.
    OutsideLimits = 8,
    /// Friction holds the mechanism, however hard the drives pull.
    Jammed = 9,
}

impl Status {
    /// Every status, in the order of its code.
    pub const ALL: [Self; 10] = [
        Self::Ok,
        Self::NotAssembled,
        Self::Singular,
        Self::Underconstrained,
        Self::Undetermined,
        Self::Strained,
        Self::NotAssemblable,
        Self::OtherBranch,
        Self::OutsideLimits,
        Self::Jammed,
    ];

    /// The name that results carry.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::NotAssembled => "not_assembled",
            Self::Singular => "singular",
            Self::Underconstrained => "underconstrained",
            Self::Undetermined => "undetermined",
            Self::Strained => "strained",
            Self::NotAssemblable => "not_assemblable",
            Self::OtherBranch => "other_branch",
            Self::OutsideLimits => "outside_limits",
            Self::Jammed => "jammed",
        }
    }

    /// The number that arrays carry.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }
}
