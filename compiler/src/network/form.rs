//! The three ways to state a network, and that a file keeps to one of them.

use crate::diagnostic::{Diagnostic, Place, code};
use crate::spec::{Spec, Subsystem};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// A_ij and B_ij in `from` tables.
    Blocks,
    /// E_i, L_ij, Cz_i, Dz_i as in (1), (2).
    Interaction,
    /// A, B, C of (5) with a partition.
    Collective,
}

impl Form {
    /// The form the file uses. A network without couplings counts as blocks.
    ///
    /// # Errors
    /// The file uses two of them.
    pub fn of(spec: &Spec) -> Result<Self, Diagnostic> {
        let first = |form: Form| traces(spec).find(|trace| trace.form == form);
        match [Self::Collective, Self::Interaction, Self::Blocks].map(first) {
            [Some(collective), interaction, blocks] => match interaction.or(blocks).or_else(|| own_model(spec)) {
                Some(other) => Err(mixed(&collective, &other)),
                None => Ok(Self::Collective),
            },
            [None, Some(interaction), Some(blocks)] => Err(mixed(&interaction, &blocks)),
            [None, Some(_), None] => Ok(Self::Interaction),
            [None, None, _] => Ok(Self::Blocks),
        }
    }

    fn describe(self) -> &'static str {
        match self {
            Self::Blocks => "blocks A, B of (5), per subsystem and per neighbour",
            Self::Interaction => "the interaction form (1), (2): E, L, Cz, Dz",
            Self::Collective => "the collective model (5): one A, B, C and a partition",
        }
    }
}

/// A key that belongs to one form only.
struct Trace {
    form: Form,
    key: String,
    place: Place,
}

fn traces(spec: &Spec) -> impl Iterator<Item = Trace> {
    let collective = spec.collective.iter().map(|collective| Trace {
        form: Form::Collective,
        key: "`collective`".into(),
        place: collective.place.clone(),
    });
    collective.chain(spec.subsystems.iter().flat_map(subsystem_traces))
}

fn subsystem_traces(subsystem: &Subsystem) -> impl Iterator<Item = Trace> {
    let own = [("E", &subsystem.E), ("Cz", &subsystem.Cz), ("Dz", &subsystem.Dz)];
    let own = own.map(|(key, matrix)| (Form::Interaction, key, matrix));
    let imported = subsystem.from.iter().flat_map(|import| {
        let blocks = [("A", &import.A), ("B", &import.B)].map(|(key, matrix)| (Form::Blocks, key, matrix));
        blocks.into_iter().chain([(Form::Interaction, "L", &import.L)])
    });
    let present = own.into_iter().chain(imported);
    present.filter_map(|(form, key, matrix)| {
        let place = matrix.as_ref()?.place.clone();
        Some(Trace { form, key: format!("`{key}` of subsystem `{}`", subsystem.name.value), place })
    })
}

/// The first A, B or C of a subsystem, which a collective model leaves no room for.
fn own_model(spec: &Spec) -> Option<Trace> {
    let matrices = spec.subsystems.iter().flat_map(|subsystem| {
        [("A", &subsystem.A), ("B", &subsystem.B), ("C", &subsystem.C)].map(|(key, matrix)| (subsystem, key, matrix))
    });
    matrices.into_iter().find_map(|(subsystem, key, matrix)| {
        let place = matrix.as_ref()?.place.clone();
        Some(Trace { form: Form::Blocks, key: format!("`{key}` of subsystem `{}`", subsystem.name.value), place })
    })
}

fn mixed(one: &Trace, other: &Trace) -> Diagnostic {
    Diagnostic::error(code::MIXED_FORMS, "the network is stated in two ways at once")
        .at(other.place.clone(), format!("{} belongs to {}", other.key, other.form.describe()))
        .at(one.place.clone(), format!("{} belongs to {}", one.key, one.form.describe()))
        .help("state the whole network in one of the two ways")
}
