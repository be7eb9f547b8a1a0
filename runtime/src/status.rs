//! What a step has to say about itself, in the terms of Theorem 1.

use core::fmt;

use crate::delivery::Delivery;

/// How the input of a step came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Control {
    /// x - xref lies in E_i and the references keep their margins: xhat = xref and uhat = uref are optimal, nothing was
    /// solved. Input: (38). The guarantee holds.
    AtReference,
    /// The i-DPC problem (33)-(36) was solved. Input: (38). The guarantee holds.
    Optimal {
        /// Changes of the working set.
        iterations: usize,
        /// Rows that hold with equality.
        active: usize,
    },
    /// The iteration budget ran out, or the solver's numerical thresholds took the problem for infeasible or (in single precision)
    /// its solution for one that rounding may have spoilt, and the shifted
    /// candidate (47) was used instead. Input: (38) of the candidate. No assumption broke: the guarantee holds, and the cost
    /// still falls.
    ///
    /// The candidate satisfies the constraints: it was checked, up to 1e-9 of each row's limit plus 1e-9 of the largest
    /// |w_k|, which allows for the rounding errors of all steps since the last solution. The design has room for that: it
    /// makes the tubes for W_i and twice the rounding floor, 1e-8 of the bounds of each state (see (18) in the compiler),
    /// of which the plant needs next to nothing: from within E_i it ends a step that far inside E_i around the candidate.
    /// An input has this room through K_i only; where K_i is 0, its limit is kept to these 1e-9. In single precision the check is
    /// against what the tables state per row, [`slack`](crate::single::tables::DpcProblem::slack), and the design has all of it in
    /// reserve.
    Candidate,
    /// The i-DPC problem has no solution, and the shifted candidate is none either: the disturbance left W_i (a neighbour's
    /// z left its zref by more than Z_i, or the plant is not the model), or the start was not feasible. Input: (38) of the
    /// shifted candidate, put into the box around U_i. The guarantee is lost for this step; it holds again from the first
    /// step on at which every subsystem is feasible again, or, where states are measured with an error, step by step from there:
    /// see the crate's documentation.
    Infeasible {
        /// The row that could not be satisfied, an index into the emitted row names.
        row: usize,
    },
    /// The iteration budget ran out, or rows are so nearly parallel that the solver could not tell, and the shifted candidate
    /// violates a constraint: possible only after an infeasible step, lost messages, or an upset (a state that something else than
    /// the plant has brought about, such as that of the first step), where the candidate was made for another state. Input and
    /// guarantee as for `Infeasible`.
    IterationLimit,
    /// The measured state is not finite. Input: that of the shifted candidate without feedback, uref + du_0, put into the box
    /// around U_i. The guarantee is lost for this step, as for `Infeasible`.
    NotFinite,
}

/// How the references of a step came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum References {
    /// yref_{t+N} is the optimum of (29)-(31), (28).
    Nearest,
    /// xref_{t+N} and uref_{t+N} are those of the start-up plan; the set-point counts from its end on. The guarantee holds.
    Planned,
    /// A neighbour is on another start-up plan, or only one of the two is on one ([`Message::plan`](crate::Message::plan)), or the
    /// loads are not those the plan was made for: at the first step, under what the neighbours sent and the loads add, a state
    /// leaves the plan within one step by more than half of [`Model::drift`](crate::tables::Model::drift). So the references do not follow (7a) over the first window, or coupling
    /// constraints are planned for other neighbours. The references go on to follow the plan. The guarantee is lost.
    OffPlan,
    /// The set-point is not finite: yref stays. That is always admissible; the guarantee holds.
    SetPointNotFinite,
    /// The reference-output layer found no answer: yref stays. The guarantee holds.
    Kept,
    /// A message is missing and there are coupling constraints, whose other side is unknown; or one was missing, or
    /// [`Controller::redraw`] was not called or given a row that can only be a mistake, and no row of that changing constraint was
    /// accepted since, which all of its members would know. yref stays, which is always admissible, and the
    /// others' moves leave room for that. The guarantee is lost with the message where coupling outputs are imported, and
    /// holds where nothing but coupling constraints joins this subsystem to others.
    ///
    /// [`Controller::redraw`]: crate::Controller::redraw
    Waiting,
    /// No row of a changing coupling constraint has been accepted yet: a first message is missing, [`Controller::redraw`] was not
    /// called, or no row that was drawn holds for the references at the start, which are too near to each other. yref stays. Nothing
    /// is promised about that constraint until a row is accepted; as references have stayed, that row then holds for all steps
    /// before too.
    ///
    /// [`Controller::redraw`]: crate::Controller::redraw
    Undrawn {
        /// Index of the constraint: the fixed ones come first, then the changing ones.
        row: usize,
    },
    /// This subsystem stands still although it could come nearer to its set-point if it were alone: a coupling constraint holds
    /// it up. Others in the coupling constraints still move, so it may go on. The guarantee holds.
    Blocked {
        /// Index of the constraint that ends its way first: the fixed ones come first, then the changing ones.
        row: usize,
    },
    /// As [`Self::Blocked`], and nobody in its coupling constraints moves any more (by more than 1e-3 epsilon in a step): the deadlock
    /// after (39), or set-points that cannot be reached together. It lasts until a set-point changes or rows are drawn by another
    /// rule, but for a balance so fine that moves smaller than that end it. The guarantee holds.
    Deadlock {
        /// As for [`Self::Blocked`].
        row: usize,
    },
    /// k_h > l~_h in (27): the references of the neighbours and this one violate the tightened coupling constraint, so the
    /// assumption of Theorem 1 on k_h does not hold. yref stays unless there is a set-point and (28) lets it move. The
    /// guarantee is lost.
    CouplingExceeded {
        /// Index of the constraint: the fixed ones come first, then the changing ones.
        row: usize,
    },
    /// Only at the first step: under what the neighbours sent, a state the controller was started from moves within one
    /// step by more than [`Model::drift`](crate::tables::Model::drift), so their starts do not fit together, and chi_0 is not
    /// the chi_ss of Theorem 1. The references of the first window were laid at rest: for the first N - 1 steps they do
    /// not follow (7a) at all, whatever the neighbours' do to them. Then they go on as (7) says and settle, but may leave
    /// the tightened sets on the way. The guarantee is lost.
    NotSteady,
}

/// All a step says about itself. `NB` neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Status<const NB: usize> {
    pub control: Control,
    pub references: References,
    /// What became of each neighbour's message, by slot. Where it is not [`Delivery::InSequence`], the last values are held.
    /// Where coupling outputs are imported, xref departs from what the neighbour's reference does to it, and the guarantee is lost.
    pub deliveries: [Delivery; NB],
    /// Whether the true state is known to lie within E_i of the plan. Where states are measured exactly, an admissible
    /// [`Control`] says so. Where they are measured with an error, a step may rest on the forecast of the step before, and that is
    /// to be trusted only where all neighbours were certified then; if not, the guarantee is lost for this step, and the next one
    /// rests on the measurement alone.
    pub certified: bool,
    /// Whether the loads of this step were given and kept their bounds and rates; true without loads. Where not, the next state
    /// may leave its tube.
    pub load_within: bool,
    /// Whether at this or an earlier step the references lost the guarantee, by messages that did not arrive, by a start
    /// that did not fit, by a coupling constraint or by loads that were not given. It does not come back by itself: start anew from a steady state.
    pub degraded: bool,
}

impl Control {
    /// Whether the input is one that Theorem 1 speaks of.
    pub fn is_admissible(&self) -> bool {
        matches!(self, Self::AtReference | Self::Optimal { .. } | Self::Candidate)
    }
}

impl References {
    /// Whether the references are still those of Theorem 1, if the messages arrived.
    pub fn are_admissible(&self) -> bool {
        !self.lose_the_guarantee() && !matches!(self, Self::Undrawn { .. })
    }

    /// Whether they are not, for good.
    pub(crate) fn lose_the_guarantee(&self) -> bool {
        matches!(self, Self::CouplingExceeded { .. } | Self::NotSteady | Self::OffPlan)
    }
}

impl<const NB: usize> Status<NB> {
    /// Whether every assumption of Theorem 1 that this subsystem can see holds: at this step that its own problem is
    /// feasible, and up to this step that its neighbours' messages arrived and fitted.
    ///
    /// Theorem 1 is about the network, and its guarantee holds where every subsystem says so. One alone does not see what
    /// is wrong elsewhere until it is disturbed by it: a bad start of a subsystem that is no neighbour, messages that
    /// others missed, and, before it is told one period later, a neighbour whose problem is infeasible.
    pub fn is_guaranteed(&self) -> bool {
        let now = self.control.is_admissible() && self.references.are_admissible();
        now && self.certified && self.load_within && !self.degraded
    }

    /// The neighbours whose message did not arrive in sequence.
    pub fn missing(&self) -> impl Iterator<Item = usize> {
        self.deliveries
            .iter()
            .enumerate()
            .filter(|(_, delivery)| **delivery != Delivery::InSequence)
            .map(|(slot, _)| slot)
    }
}

impl fmt::Display for Control {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtReference => f.write_str("at reference"),
            Self::Optimal { iterations, active } => {
                write!(f, "optimal ({iterations} iterations, {active} active rows)")
            }
            Self::Candidate => f.write_str("no solution found, shifted candidate is feasible"),
            Self::Infeasible { row } => write!(f, "infeasible (row {row}), shifted candidate used"),
            Self::IterationLimit => f.write_str("iteration budget used up, shifted candidate is not feasible"),
            Self::NotFinite => f.write_str("measured state not finite, shifted candidate used without feedback"),
        }
    }
}

impl fmt::Display for References {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nearest => f.write_str("references nearest to the set-point"),
            Self::Planned => f.write_str("references of the start-up plan"),
            Self::OffPlan => f.write_str("start-up plan does not fit the neighbours"),
            Self::SetPointNotFinite => f.write_str("set-point not finite, reference kept"),
            Self::Kept => f.write_str("no reference found, kept"),
            Self::Waiting => f.write_str("reference kept until all members of its coupling constraints meet"),
            Self::Undrawn { row } => write!(f, "no row of coupling constraint {row} accepted yet"),
            Self::Blocked { row } => write!(f, "held up by coupling constraint {row}"),
            Self::Deadlock { row } => write!(f, "deadlock: held up by coupling constraint {row}, and nobody moves"),
            Self::CouplingExceeded { row } => write!(f, "coupling constraint {row} exceeded"),
            Self::NotSteady => f.write_str("start not steady with the neighbours"),
        }
    }
}

impl<const NB: usize> fmt::Display for Status<NB> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.control, self.references)?;
        for slot in self.missing() {
            if let Some(delivery) = self.deliveries.get(slot) {
                write!(f, "; message of neighbour {slot} {delivery}")?;
            }
        }
        if self.control.is_admissible() && !self.certified {
            f.write_str("; measurement errors may hide that the state left its tube")?;
        }
        if !self.load_within {
            f.write_str("; a load left its bounds or rates")?;
        }
        if self.degraded { f.write_str("; degraded") } else { Ok(()) }
    }
}
