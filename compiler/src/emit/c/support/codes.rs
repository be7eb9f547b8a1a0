impl Refusal {
    pub const NULL: Self = Self::of(DPC_NULL);
    pub const SIZE: Self = Self::of(DPC_SIZE);
    pub const MISALIGNED: Self = Self::of(DPC_MISALIGNED);
    pub const NOT_STARTED: Self = Self::of(DPC_NOT_STARTED);
    pub const LENGTH: Self = Self::of(DPC_LENGTH);
    pub const NO_SUCH_NEIGHBOUR: Self = Self::of(DPC_NO_SUCH_NEIGHBOUR);
    pub const NO_SUCH_ROW: Self = Self::of(DPC_REDRAW_NO_SUCH_ROW);

    const fn of(code: i32) -> Self {
        Self { code, which: -1 }
    }

    fn at(code: i32, which: usize) -> Self {
        Self { code, which: number(which) }
    }
}

/// Why a function did nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refusal {
    pub code: i32,
    /// What the code speaks of: an index, or -1.
    pub which: i32,
}

/// `dpc_status` of the header.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Status {
    pub control: i32,
    pub control_row: i32,
    pub iterations: i32,
    pub active_rows: i32,
    pub references: i32,
    pub references_row: i32,
    pub messages_missing: i32,
    pub guaranteed: u8,
    pub certified: u8,
    pub load_within: u8,
    pub degraded: u8,
}

impl Status {
    /// Of a controller that has made no step.
    pub const NONE: Self = Self {
        control: DPC_CONTROL_NONE,
        control_row: -1,
        iterations: 0,
        active_rows: 0,
        references: DPC_REFERENCES_NONE,
        references_row: -1,
        messages_missing: 0,
        guaranteed: 0,
        certified: 0,
        load_within: 0,
        degraded: 0,
    };

    /// After the first half of a step.
    pub fn of_input(control: &Control, degraded: bool) -> Self {
        let (code, row, iterations, active) = match control {
            Control::AtReference => (DPC_CONTROL_AT_REFERENCE, -1, 0, 0),
            Control::Optimal { iterations, active } => (DPC_CONTROL_OPTIMAL, -1, number(*iterations), number(*active)),
            Control::Candidate => (DPC_CONTROL_CANDIDATE, -1, 0, 0),
            Control::Infeasible { row } => (DPC_CONTROL_INFEASIBLE, number(*row), 0, 0),
            Control::IterationLimit => (DPC_CONTROL_ITERATION_LIMIT, -1, 0, 0),
            Control::NotFinite => (DPC_CONTROL_NOT_FINITE, -1, 0, 0),
        };
        Self {
            control: code,
            control_row: row,
            iterations,
            active_rows: active,
            degraded: degraded.into(),
            ..Self::NONE
        }
    }

    /// After the second half as well.
    pub fn with_references<const NB: usize>(self, whole: &dpc_runtime::Status<NB>) -> Self {
        let (references, row) = match whole.references {
            References::Nearest => (DPC_REFERENCES_NEAREST, -1),
            References::Planned => (DPC_REFERENCES_PLANNED, -1),
            References::SetPointNotFinite => (DPC_REFERENCES_SET_POINT_NOT_FINITE, -1),
            References::Kept => (DPC_REFERENCES_KEPT, -1),
            References::Waiting => (DPC_REFERENCES_WAITING, -1),
            References::Blocked { row } => (DPC_REFERENCES_BLOCKED, number(row)),
            References::Deadlock { row } => (DPC_REFERENCES_DEADLOCK, number(row)),
            References::Undrawn { row } => (DPC_REFERENCES_UNDRAWN, number(row)),
            References::OffPlan => (DPC_REFERENCES_OFF_PLAN, -1),
            References::CouplingExceeded { row } => (DPC_REFERENCES_COUPLING_EXCEEDED, number(row)),
            References::NotSteady => (DPC_REFERENCES_NOT_STEADY, -1),
        };
        Self {
            references,
            references_row: row,
            messages_missing: number(whole.missing().count()),
            // Where no input was asked for in this period, there is nothing to guarantee.
            guaranteed: (self.control != DPC_CONTROL_NONE && whole.is_guaranteed()).into(),
            certified: whole.certified.into(),
            load_within: whole.load_within.into(),
            degraded: whole.degraded.into(),
            ..self
        }
    }
}

/// What a function returns.
pub fn finish(work: impl FnOnce() -> Result<(), Refusal>) -> i32 {
    work().map_or_else(|refusal| refusal.code, |()| DPC_OK)
}

/// The same, with what the code speaks of.
pub fn finish_at(which: Out<i32>, work: impl FnOnce() -> Result<(), Refusal>) -> i32 {
    let place = match which.wanted() {
        Ok(place) => place,
        Err(refusal) => return refusal.code,
    };
    let done = work();
    if let Some(place) = place {
        place.put(done.map_or_else(|refusal| refusal.which, |()| -1));
    }
    done.map_or_else(|refusal| refusal.code, |()| DPC_OK)
}

/// What became of a message, and the step it was of where that is the trouble.
pub fn delivery(delivery: Delivery) -> (i32, i64) {
    match delivery {
        Delivery::InSequence => (DPC_DELIVERY_IN_SEQUENCE, 0),
        Delivery::Missing => (DPC_DELIVERY_MISSING, 0),
        Delivery::OutOfSequence(step) => (DPC_DELIVERY_OUT_OF_SEQUENCE, step),
        Delivery::NotFinite => (DPC_DELIVERY_NOT_FINITE, 0),
        Delivery::OtherDesign => (DPC_DELIVERY_OTHER_DESIGN, 0),
        Delivery::Unreadable => (DPC_DELIVERY_UNREADABLE, 0),
    }
}

impl From<StartError> for Refusal {
    fn from(error: StartError) -> Self {
        match error {
            StartError::NotFinite => Self::of(DPC_START_NOT_FINITE),
            StartError::OutputOutside => Self::of(DPC_START_OUTPUT_OUTSIDE),
            StartError::InputOutside { input } => Self::at(DPC_START_INPUT_OUTSIDE, input),
            StartError::InputOutOfReach => Self::of(DPC_START_INPUT_OUT_OF_REACH),
            StartError::LoadOutside { load } => Self::at(DPC_START_LOAD_OUTSIDE, load),
            StartError::OtherDesign => Self::of(DPC_START_OTHER_DESIGN),
            StartError::PlanTooShort => Self::of(DPC_START_PLAN_TOO_SHORT),
            StartError::ChangingConstraints => Self::of(DPC_START_CHANGING_CONSTRAINTS),
            StartError::NoPlan => Self::of(DPC_START_NO_PLAN),
            StartError::StateDoesNotFit { row } => Self::at(DPC_START_STATE_DOES_NOT_FIT, row),
            StartError::Undecided => Self::of(DPC_START_UNDECIDED),
        }
    }
}

impl From<Refused> for Refusal {
    fn from(refused: Refused) -> Self {
        match refused {
            Refused::OutOfSequence { .. } => Self::of(DPC_MESSAGE_OUT_OF_SEQUENCE),
            Refused::NotFinite => Self::of(DPC_MESSAGE_NOT_FINITE),
            Refused::Length { .. } => Self::of(DPC_MESSAGE_LENGTH),
            Refused::OtherLayout { .. } => Self::of(DPC_MESSAGE_LAYOUT),
            Refused::OtherScalar { .. } => Self::of(DPC_MESSAGE_SCALAR),
            Refused::OtherDesign { .. } => Self::of(DPC_MESSAGE_DESIGN),
            Refused::Malformed => Self::of(DPC_MESSAGE_MALFORMED),
            Refused::OtherSender { .. } | Refused::NotHeard { .. } | Refused::NoSuchSlot => {
                Self::of(DPC_MESSAGE_SENDER)
            }
        }
    }
}

impl From<NotRedrawn> for Refusal {
    fn from(error: NotRedrawn) -> Self {
        match error {
            NotRedrawn::NoSuchRow => Self::of(DPC_REDRAW_NO_SUCH_ROW),
            NotRedrawn::NotHeard { slot } => Self::at(DPC_REDRAW_NOT_HEARD, slot),
            NotRedrawn::NoneDrawn => Self::of(DPC_LENGTH),
            NotRedrawn::NotFinite => Self::of(DPC_REDRAW_NOT_FINITE),
            NotRedrawn::NotMember => Self::of(DPC_REDRAW_NOT_MEMBER),
            NotRedrawn::Exceeded { .. } => Self::of(DPC_REDRAW_EXCEEDED),
        }
    }
}

fn number(count: usize) -> i32 {
    i32::try_from(count).unwrap_or(i32::MAX)
}

/// `names[k]`, or NULL.
pub fn text(names: &[&'static CStr], k: u32) -> *const c_char {
    usize::try_from(k).ok().and_then(|k| names.get(k)).map_or(core::ptr::null(), |name| name.as_ptr())
}
