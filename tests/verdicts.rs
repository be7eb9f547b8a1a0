//! Is the solver right about problems that are made to mislead it?

use dpc_tests::adversarial::{Kind, Verdicts, examine};
use dpc_tests::cases_wanted;

/// A hundred times as many by `cargo run --release -p bench --bin verdicts`.
#[test]
fn no_verdict_is_wrong() {
    for (seed, kind) in Kind::ALL.into_iter().enumerate() {
        let verdicts: Verdicts = examine(kind, seed as u64, cases_wanted(300));
        println!("{kind:?}: {verdicts}");
        assert!(verdicts.wrong.is_empty(), "{kind:?}: {:#?}", verdicts.wrong.first());
        let decided = verdicts.solved + verdicts.refuted + verdicts.rounded;
        assert!(decided == verdicts.problems && verdicts.undecided == 0, "{kind:?}: {verdicts}");
        let expected = if kind == Kind::Infeasible { verdicts.refuted } else { verdicts.solved };
        assert!(expected * 3 > verdicts.problems, "{kind:?}: {verdicts}");
    }
}
