//! One controller with its inbox, and its part of the plant.

/// What a node holds, and the state of what it controls.
pub struct Process<C, I, M, S, const NX: usize, const NU: usize, const NY: usize, const NZ: usize> {
    pub controller: C,
    pub inbox: I,
    /// The last one it sent.
    pub message: M,
    pub set_point: [S; NY],
    pub x: [S; NX],
    pub u: [S; NU],
    /// What neighbours feel of it.
    pub z: [S; NZ],
}

/// Puts `values` where a link says.
pub fn place<S: Copy>(imported: &mut [S], first: Option<usize>, values: &[S]) {
    let places = first.and_then(|first| imported.get_mut(first..)).unwrap_or_default();
    places.iter_mut().zip(values).for_each(|(place, value)| *place = *value);
}
