//! Coupling constraints (3) whose rows are redrawn while running.
//!
//! At step t all members of such a constraint know the same: yref_{t+N-1} of all of them. Each draws the row by the same rule
//! from nothing but that, and accepts it by the same test, k_{h,t+N-1} <= l~_h of (26), (27). So they have the same row
//! without a coordinator, and Theorem 1's argument for (28) goes through unchanged: at every step the row in force satisfies
//! k_{h,t+N-1} <= l~_h before the members move, and (28) keeps k_{h,t+N} <= l~_h, whichever row was in force before.
//!
//! All sums here are over the members in the order of the network, one after the other: what is the same for all members is
//! computed in the same order by all of them, and comes out the same to the last bit. That needs the same numbers to begin
//! with: messages must carry yref unrounded, and a rule must use nothing that differs between machines, such as the sine and
//! cosine of a system's library (`dpc-planar` does without).
//!
//! What happens when a message is missing, and why that is safe, is in the crate's documentation.

use core::fmt;

use super::linear::finite;
use super::tables::{ChangingRow, CouplingRow, Import, Member};
use super::{Real, precision};

/// A row may be accepted if k_h exceeds l~_h by no more than this share of its margin: rows that hold with equality are common,
/// since the members may use all the room there is, and must not be lost by rounding. The emitted margins have ten times that in
/// reserve.
pub(crate) const ACCEPTANCE: Real = precision::KEPT;

/// own . y_i + others . y_j <= l, between the outputs of one time. Made by hand, or by [`Pair::apart`] and [`Meeting::beyond`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpace<const NY: usize, const NJ: usize> {
    /// `H_h^[i]` of this subsystem.
    pub own: [Real; NY],
    /// `H_h^[j]` of the others, over the imported outputs, at the places that [`Link::y`](super::Link) and [`Import`] say; zero but for
    /// the members of the constraint.
    pub others: [Real; NJ],
    /// l_h.
    pub l: Real,
}

/// What all members of a changing constraint know at a step: yref_{t+N-1} of all of them, and the margins of (26).
#[derive(Debug, Clone, Copy)]
pub struct Meeting<'a, const NY: usize, const NJ: usize> {
    row: &'a ChangingRow,
    own: &'a [Real; NY],
    others: &'a [Real; NJ],
}

/// A [`Meeting`] of two subsystems with equally many outputs.
#[derive(Debug, Clone, Copy)]
pub struct Pair<'a, const NY: usize, const NJ: usize> {
    meeting: Meeting<'a, NY, NJ>,
    import: Import,
    own_is_first: bool,
    /// yref_{t+N-1} of the one that comes first in the network.
    pub first: [Real; NY],
    /// That of the other.
    pub second: [Real; NY],
}

/// Why a row was not redrawn. The one before stays in force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NotRedrawn {
    /// There is no such changing constraint.
    NoSuchRow,
    /// The message of a member is missing, in this slot. yref stays until a row is accepted again: [`References::Waiting`], or
    /// [`References::Undrawn`] if none was ever accepted.
    ///
    /// [`References::Waiting`]: crate::References::Waiting
    /// [`References::Undrawn`]: crate::References::Undrawn
    NotHeard { slot: usize },
    /// The rule gave none, which is its way to keep the row.
    NoneDrawn,
    /// It holds a number that is not finite: a mistake, which others may not have made. yref will stay: [`References::Waiting`].
    ///
    /// [`References::Waiting`]: crate::References::Waiting
    NotFinite,
    /// It has a coefficient on an output of a subsystem that is no member: likewise.
    NotMember,
    /// k_{h,t+N-1} <= l~_h does not hold for it.
    Exceeded { k: Real, l_tilde: Real },
}

/// What is in force.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Held<const NY: usize, const NJ: usize> {
    /// With its margin of (26). `None`: none was ever accepted.
    row: Option<(CouplingRow<NY, NJ>, Real)>,
    /// Whether all members are known to hold the same.
    shared: bool,
    /// The last step at which it was redrawn, or confirmed, with all members heard.
    met: i64,
}

/// What a changing constraint means for a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum InForce<const NY: usize, const NJ: usize> {
    /// No row has been accepted yet.
    Undrawn,
    /// The others may hold another row.
    Unsure,
    Row {
        row: CouplingRow<NY, NJ>,
        margin: Real,
    },
}

impl<const NY: usize, const NJ: usize> HalfSpace<NY, NJ> {
    /// The row that restricts nothing. It is accepted as any other: where a rule draws it, nothing is kept.
    pub const NONE: Self = Self { own: [0.0; NY], others: [0.0; NJ], l: 0.0 };
}

impl<'a, const NY: usize, const NJ: usize> Meeting<'a, NY, NJ> {
    pub(crate) fn new(row: &'a ChangingRow, own: &'a [Real; NY], others: &'a [Real; NJ]) -> Self {
        Self { row, own, others }
    }

    /// yref_{t+N-1} of each member, in the order of the network.
    pub fn outputs(&self) -> impl Iterator<Item = &'a [Real]> + use<'a, NY, NJ> {
        let (own, others) = (self.own, self.others);
        self.row.members.iter().map(move |member| part(member, own, others))
    }

    /// k_{h,t+N-1} of (27).
    pub fn k(&self, drawn: &HalfSpace<NY, NJ>) -> Real {
        let terms = self.row.members.iter().flat_map(|member| {
            let row = part(member, &drawn.own, &drawn.others);
            row.iter().zip(part(member, self.own, self.others)).map(|(h, y)| h * y)
        });
        terms.fold(0.0, |sum, term| sum + term)
    }

    /// What (26) takes of the row: an upper bound of the sum over all members of the supports of [C_j 0] Delta_j^chi and of Z_j.
    pub fn margin(&self, drawn: &HalfSpace<NY, NJ>) -> Real {
        let members = self.row.members.iter();
        members.fold(0.0, |sum, member| sum + support(member, part(member, &drawn.own, &drawn.others)))
    }

    /// l~_h of (26).
    pub fn l_tilde(&self, drawn: &HalfSpace<NY, NJ>) -> Real {
        drawn.l - self.margin(drawn)
    }

    /// Whether the row may be used: k_{h,t+N-1} <= l~_h, up to the rounding errors that the emitted margins have in reserve (1e-9 of
    /// the margin).
    pub fn admits(&self, drawn: &HalfSpace<NY, NJ>) -> bool {
        self.k(drawn) <= self.l_tilde(drawn) + ACCEPTANCE * self.margin(drawn)
    }

    /// The row normal . y >= bound on this subsystem's outputs alone, where it is the only member: for instance of a constraint that
    /// keeps it off an obstacle. `bound` is what the true outputs are to keep, without the margins of (26).
    pub fn beyond(&self, normal: &[Real; NY], bound: Real) -> HalfSpace<NY, NJ> {
        HalfSpace { own: normal.map(|entry| -entry), others: [0.0; NJ], l: -bound }
    }

    /// The row normal . (outputs of all members) <= limit, with the outputs in the order of [`Self::outputs`], so that all members
    /// write it alike. `limit` is what the true outputs are to keep, without the margins of (26). `None` where `normal` has another
    /// length.
    pub fn below(&self, normal: &[Real], limit: Real) -> Option<HalfSpace<NY, NJ>> {
        let mut drawn = HalfSpace { own: [0.0; NY], others: [0.0; NJ], l: limit };
        let mut rest = normal;
        for member in self.row.members {
            let places = match member.import {
                None => &mut drawn.own[..],
                Some(import) => drawn.others.get_mut(import.first..)?.get_mut(..import.outputs)?,
            };
            let (entries, others) = rest.split_at_checked(places.len())?;
            places.iter_mut().zip(entries).for_each(|(place, entry)| *place = *entry);
            rest = others;
        }
        rest.is_empty().then_some(drawn)
    }

    /// The two that meet, if there are two and they have as many outputs as this subsystem.
    pub fn pair(&self) -> Option<Pair<'a, NY, NJ>> {
        let [first, second] = self.row.members else { return None };
        let (import, own_is_first) = match (first.import, second.import) {
            (None, Some(import)) => (import, true),
            (Some(import), None) => (import, false),
            _ => return None,
        };
        let point = |member| part(member, self.own, self.others).try_into().ok();
        Some(Pair { meeting: *self, import, own_is_first, first: point(first)?, second: point(second)? })
    }
}

impl<const NY: usize, const NJ: usize> Pair<'_, NY, NJ> {
    /// What (26) takes of normal . (y_first - y_second) >= distance.
    pub fn margin(&self, normal: &[Real; NY]) -> Real {
        let [first, second] = self.meeting.row.members else { return 0.0 };
        // A support is the same in opposite directions.
        support(first, normal) + support(second, normal)
    }

    /// The row normal . (y_first - y_second) >= distance, as this subsystem sees it. `distance` is what the true outputs are to keep,
    /// without the margins of (26), which are charged when the row is accepted: it holds now if
    /// normal . (first - second) >= distance + [`Self::margin`].
    pub fn apart(&self, normal: &[Real; NY], distance: Real) -> HalfSpace<NY, NJ> {
        let opposite = normal.map(|entry| -entry);
        let (own, other) = if self.own_is_first { (opposite, *normal) } else { (*normal, opposite) };
        let mut others = [0.0; NJ];
        others.iter_mut().skip(self.import.first).zip(other).for_each(|(place, entry)| *place = entry);
        HalfSpace { own, others, l: -distance }
    }
}

/// The entries of one member.
fn part<'a, const NY: usize, const NJ: usize>(
    member: &Member,
    own: &'a [Real; NY],
    others: &'a [Real; NJ],
) -> &'a [Real] {
    match member.import {
        None => own,
        Some(import) => others.get(import.first..).and_then(|rest| rest.get(..import.outputs)).unwrap_or(&[]),
    }
}

/// Upper bound of what (26) takes of row . y_j.
fn support(member: &Member, row: &[Real]) -> Real {
    let along = |generator: &&[Real]| generator.iter().zip(row).fold(0.0, |sum, (g, h)| sum + g * h).abs();
    member.generators.iter().map(along).fold(0.0, |sum, term| sum + term)
}

impl<const NY: usize, const NJ: usize> Held<NY, NJ> {
    pub(crate) const UNDRAWN: Self = Self { row: None, shared: false, met: i64::MIN };

    /// All members were heard at `step`, and drew: the row is the new one if it may be used, and stays otherwise.
    pub(crate) fn redraw(
        &mut self,
        step: i64,
        meeting: &Meeting<'_, NY, NJ>,
        drawn: Option<HalfSpace<NY, NJ>>,
    ) -> Result<(), NotRedrawn> {
        let drawn = drawn.map(|drawn| qualified(meeting, &drawn)).unwrap_or(Err(NotRedrawn::NoneDrawn));
        // A rule that gives such rows is a mistake, and others may not have made it.
        if !matches!(drawn, Err(NotRedrawn::NotFinite | NotRedrawn::NotMember)) {
            self.met = step;
        }
        self.row = Some(drawn?);
        self.shared = true;
        Ok(())
    }

    /// What holds at `step`. Where the members did not all meet, others may have redrawn the row since.
    pub(crate) fn at(&mut self, step: i64) -> InForce<NY, NJ> {
        self.shared &= self.met == step;
        match self.row {
            None => InForce::Undrawn,
            Some((row, margin)) if self.shared => InForce::Row { row, margin },
            Some(_) => InForce::Unsure,
        }
    }
}

/// The row as (28) needs it, with its margin, if it may be used.
fn qualified<const NY: usize, const NJ: usize>(
    meeting: &Meeting<'_, NY, NJ>,
    drawn: &HalfSpace<NY, NJ>,
) -> Result<(CouplingRow<NY, NJ>, Real), NotRedrawn> {
    if !(finite(&drawn.own) && finite(&drawn.others) && drawn.l.is_finite()) {
        return Err(NotRedrawn::NotFinite);
    }
    let member = |c: usize| {
        let imports = meeting.row.members.iter().filter_map(|member| member.import);
        imports.into_iter().any(|import| c >= import.first && c - import.first < import.outputs)
    };
    if drawn.others.iter().enumerate().any(|(c, entry)| *entry != 0.0 && !member(c)) {
        return Err(NotRedrawn::NotMember);
    }
    let (k, l_tilde) = (meeting.k(drawn), meeting.l_tilde(drawn));
    if meeting.admits(drawn) {
        let members = meeting.row.members.iter().fold(0.0, |count, _| count + 1.0);
        Ok((CouplingRow { own: drawn.own, others: drawn.others, l_tilde, members }, meeting.margin(drawn)))
    } else {
        Err(NotRedrawn::Exceeded { k, l_tilde })
    }
}

impl fmt::Display for NotRedrawn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSuchRow => f.write_str("no such changing constraint"),
            Self::NotHeard { slot } => write!(f, "message of neighbour {slot} is missing"),
            Self::NoneDrawn => f.write_str("the rule gave no row"),
            Self::NotFinite => f.write_str("row holds a number that is not finite"),
            Self::NotMember => f.write_str("row has a coefficient on an output of a subsystem that is no member"),
            Self::Exceeded { k, l_tilde } => write!(f, "row does not hold now: {k} exceeds {l_tilde}"),
        }
    }
}

impl core::error::Error for NotRedrawn {}
