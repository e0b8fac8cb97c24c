//! Why a near field cannot be summed.

/// Why a way of summing does not suit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unsuitable {
    /// Images without end.
    #[error("in a periodic domain the near field needs a cut-off: it has no sum over all images")]
    Periodic,
    /// A cut-off that is no length, or a switch or skin that does not go with it.
    #[error(
        "the cut-off must be finite and positive, its switch wider than 0 and at most half of it, its skin at least 0 (m), \
         not {} with a switch of {} and a skin of {}", .0.radius, .0.switch_width, .0.skin
    )]
    CutOff(super::CutOff),
    /// More than one image of a grain within the cut-off.
    #[error("the cut-off must be at most half the shortest side of the periodic domain ({half} m), not {radius} m")]
    LongCutOff {
        /// The cut-off, m.
        radius: f64,
        /// Half the shortest side, m.
        half: f64,
    },
    /// A tolerance that nothing can meet, or that would let everything pass.
    #[error("the tolerance of the tree must be between {} and {}, not {}", super::TIGHTEST, super::LOOSEST, .0)]
    Tolerance(f64),
}

/// Grains between which there is no finite force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Singular {
    /// Two grains at the same point, or so close that the force between them is no finite number.
    #[error("the near field of grains {0} and {1} has no finite value: their centres coincide")]
    Coincident(usize, usize),
    /// A position, a strength or a force is no finite number.
    #[error("the near field of grain {0} has no finite value")]
    NotFinite(usize),
}
