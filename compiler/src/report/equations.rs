//! The paper's equations that the page refers to, by number.

use maud::{Markup, html};

/// Number, statement, what it is for.
const ALL: [(&str, &str, &str); 27] = [
    (
        "(1), (2)",
        "x⁺ = A x + B u + E s,  y = C x,  z = C_z x + D_z u,  s = Σ_j L_j z_j",
        "a subsystem, and what its neighbours' coupling outputs z do to it",
    ),
    ("(3)", "Σ_j H_j y_j ≤ l", "a constraint over outputs of several subsystems"),
    ("(6), (30)", "ỹ⁺ − ỹ ∈ B(ε)", "a reference output moves by ε per step at most"),
    (
        "(7)",
        "x̃⁺ = A x̃ + B ũ + E s̃,  ẽ⁺ = ẽ + ỹ⁺ − C x̃,  ũ = 𝒦 χ,  χ = (x̃, ẽ)",
        "the references that follow a reference output",
    ),
    ("(8)", "χ⁺ = ℱ χ + 𝒢 ỹ⁺", "all references together; Assumption 3: ℱ is Schur"),
    ("(9)", "χ_ss = (I − ℱ)⁻¹ 𝒢 ỹ", "references at rest"),
    ("(12), (13)", "χ − χ_ss ∈ Δ^χ", "how far moving references are from those at rest"),
    ("(15)", "x̂⁺ = A x̂ + B û + E s̃", "the nominal model that plans are made with"),
    ("(17), (38)", "u = û + K (x − x̂)", "what is applied"),
    ("(18)", "x − x̂ ∈ ℰ,  F ℰ ⊕ E 𝒮 ⊆ ℰ,  F = A + B K", "the tube: how far a state may be off its plan"),
    ("(20)", "W = E 𝒮,  𝒮 = ⊕ L_j Z_j", "what acts on the deviation from the plan; (20′) adds disturbances"),
    ("(21)", "(C_z + D_z K) ℰ ⊕ B(ρ) ⊆ Z", "the box that z − z̃ stays in"),
    ("(22), (23)", "(C_z + D_z K) ℰ ⊕ Δ^z ⊆ Z", "the reserve Δ^z: what a plan may be off its reference in z"),
    ("(24)", "F Σ ⊆ Σ", "the terminal set is invariant"),
    ("(25a)", "(C_z + D_z K) Σ ⊆ Δ^z", "the terminal set fits into the reserve"),
    (
        "(25b)",
        "(x̃, ũ)_ss(∏Y) ⊕ Δ^χ ⊕ (I, K) Σ ⊆ X̂ × Û",
        "set-points, moving references and terminal set fit into the tightened limits; (25b′) adds loads",
    ),
    (
        "(26), (27)",
        "l̃ = l − Σ_j ( max over Δ^χ + max over Z )",
        "what is left of a coupling constraint for the references; (26′) for rows drawn while running",
    ),
    ("(28)", "H_i ỹ⁺ ≤ l̃ − Σ_{j≠i} H_j ỹ − (n−1)/n (l̃ − k)", "each subsystem's share of what is left"),
    ("(29)", "min γ‖ỹ⁺ − ỹ‖² + ‖ỹ⁺ − set-point‖²_T", "where a reference output moves"),
    ("(31)", "ỹ ∈ Y", "the set-points that can be reached"),
    ("(33), (34)", "min Σ ‖x̂ − x̃‖²_Q + ‖û − ũ‖²_R + ‖x̂_N − x̃_N‖²_P", "the i-DPC problem of each step"),
    ("(35a)", "x − x̂ ∈ ℰ", "the plan starts within the tube; (35a′) with measurement errors"),
    ("(35b)", "ẑ − z̃ ∈ Δ^z", "the plan keeps within the reserve"),
    ("(35c)", "x̂ ∈ X̂ ⊆ X ⊖ ℰ", "the plan keeps the tightened state limits"),
    ("(35d)", "û ∈ Û ⊆ U ⊖ K ℰ", "and those of the inputs"),
    ("(36)", "x̂_N − x̃_N ∈ Σ", "the plan ends in the terminal set"),
    ("(37)", "Fᵀ P F − P = −(Q + Kᵀ R K)", "the terminal weight"),
];

/// References to equations, linked to the table.
pub fn eq(numbers: &str) -> Markup {
    let parts: Vec<&str> = numbers.split(", ").collect();
    html! {
        span.eq {
            @for (k, number) in parts.iter().enumerate() {
                @if k > 0 { ", " }
                @match place(number) {
                    Some(row) => a href=(format!("#eq-{row}")) { (number) },
                    None => (number),
                }
            }
        }
    }
}

/// The row of the table that states an equation; one with a prime is stated beside that without.
fn place(number: &str) -> Option<usize> {
    let plain = number.replace(['\'', '′'], "");
    ALL.iter().position(|(numbers, ..)| numbers.split(", ").any(|known| known == plain))
}

pub fn section() -> Markup {
    html! {
        section id="equations" {
            h2 { "Equations" }
            p.note {
                "Numbers are those of M. Farina, G. Betti, L. Giulioni, R. Scattolini, “An approach to distributed predictive control for \
                 tracking: theory and applications”, IEEE Transactions on Control Systems Technology. A tilde marks references, a hat plans; \
                 ⊕ and ⊖ are the Minkowski sum and the Pontryagin difference; a prime marks what this compiler adds to an equation."
            }
            div.wide {
                table.equations {
                    thead { tr { th scope="col" { "No." } th scope="col" { "Equation" } th scope="col" { "What it says" } } }
                    tbody {
                        @for (row, (numbers, statement, meaning)) in ALL.iter().enumerate() {
                            tr id=(format!("eq-{row}")) { td { (numbers) } td.math { (statement) } td { (meaning) } }
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_find_their_rows() {
        for number in ["(18)", "(25b)", "(26')", "(20′)", "(35a)", "(13)", "(6)", "(4)"] {
            assert_eq!(place(number).is_some(), number != "(4)", "{number}");
        }
        assert_eq!(place("(30)"), place("(6)"));
    }
}
