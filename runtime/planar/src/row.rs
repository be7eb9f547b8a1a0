//! A half-plane.

/// `normal`' p >= `bound`, where p is y_first - y_second for a pair, and y for a body alone.
///
/// In the form of (3) it is H_first = -normal, H_second = normal, l = -`bound`, with the margins of (26) already taken off
/// l if the need contained them. A controller of dpc-runtime takes them off itself: give it the normal, and as distance the
/// clearance that the true positions are to keep along it, without the margins:
///
/// ```ignore
/// let need = Sum(clearance, |n: &[f64; 2]| pair.margin(n));
/// let row = rule.row(&pair.first, &pair.second, &need)?;
/// Some(pair.apart(&row.normal, clearance.need(&row.normal)))
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Unit length up to rounding.
    pub normal: [f64; 2],
    /// In the unit of positions.
    pub bound: f64,
}
