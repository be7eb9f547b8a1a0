//! Does any text at all end in a network or in errors that point into it?
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::collections::BTreeSet;

use dpc_codegen::diagnostic::{Diagnostics, Source};
use dpc_codegen::network::Network;
use dpc_tests::{Random, cases, lower};

const MUTATIONS_PER_CASE: usize = 1000;

/// What a mutation puts in: pieces of TOML, numbers at the edge, text that is hard to draw.
const PIECES: [&str; 50] = [
    "[",
    "]",
    "{",
    "}",
    "[[",
    "]]",
    "=",
    ",",
    ".",
    "\"",
    "'",
    "#",
    "\n",
    "\r\n",
    "\t",
    " ",
    "nan",
    "-inf",
    "inf",
    "0",
    "-1",
    "1e30",
    "-1e30",
    "1e-300",
    "1e999",
    "99999999999999999999",
    "0x1F",
    "1979-05-27",
    "true",
    "A",
    "B",
    "C",
    "E",
    "L",
    "Cz",
    "H",
    "h",
    "min",
    "max",
    "from",
    "left",
    "subsystem",
    "[subsystem.left]",
    "[[coupling-constraint]]",
    "[[changing-constraint]]",
    "between = [\"left\"]",
    "µ [°C]",
    "\u{0}",
    "\u{202e}",
    "\"\\u0007\"",
];

const NUMBERS: [&str; 16] = [
    "nan", "-inf", "inf", "0", "-0.0", "1", "-1", "1e30", "-1e30", "1e-300", "5e-324", "1e999", "1e-16", "3", "1e15",
    "0.1",
];

#[test]
fn no_text_makes_the_compiler_panic_and_every_error_has_its_place() {
    let mut outcomes = (0, 0, BTreeSet::new());
    for (seed, case) in cases("accept").iter().enumerate() {
        let mut random = Random(seed as u64 + 1);
        for _ in 0..MUTATIONS_PER_CASE {
            let text = mutated(&case.text, &mut random);
            match lower(Source { path: case.path.clone(), text: text.clone() }) {
                Ok(network) => {
                    assert_sound(&network, &text);
                    outcomes.0 += 1;
                }
                Err(errors) => {
                    assert_drawn(&errors, &text);
                    outcomes.1 += 1;
                    outcomes.2.extend(errors.0.iter().map(|error| error.code));
                }
            }
        }
    }
    // The mutations must reach past the TOML reader, and some must leave a valid file.
    let (accepted, rejected, codes) = outcomes;
    println!("{accepted} accepted, {rejected} rejected with {codes:?}");
    assert!(accepted >= 100 && rejected >= 500 && codes.len() >= 20, "{accepted} {rejected} {codes:?}");
}

#[test]
fn texts_that_are_not_toml_are_drawn_too() {
    for text in [
        "",
        "\n",
        "\u{feff}",
        "\u{0}",
        "=",
        "[",
        "[a.b",
        "\"",
        "a = \"\"\"\n",
        "é = [1, 2\n",
        "\r",
        "a = 1\rb = 2",
        "😀",
    ] {
        let errors = lower(Source { path: "x.toml".into(), text: text.into() }).expect_err("no network");
        assert_drawn(&errors, text);
    }
    let deep = format!("name = {}", "[".repeat(100_000));
    assert_drawn(&lower(Source { path: "x.toml".into(), text: deep.clone() }).expect_err("no network"), &deep);
}

/// The sentence on [`Network`].
fn assert_sound(network: &Network, text: &str) {
    for subsystem in &network.subsystems {
        let (n, m, p, nz) = (subsystem.n(), subsystem.m(), subsystem.p(), subsystem.nz());
        assert!(1 <= n && 1 <= p && p <= m, "{text}");
        assert_eq!((subsystem.A.shape(), subsystem.B.shape(), subsystem.C.shape()), ((n, n), (n, m), (p, n)), "{text}");
        assert_eq!((subsystem.Cz.shape(), subsystem.Dz.shape()), ((nz, n), (nz, m)), "{text}");
        assert_eq!((subsystem.reserve.len(), subsystem.coupling_outputs.len()), (nz, nz), "{text}");
        for (j, L) in &subsystem.L {
            assert_eq!(L.shape(), (subsystem.E.ncols(), network.subsystems[*j].nz()), "{text}");
            assert!(L.amax() > 0.0, "{text}");
        }
        for set in [&subsystem.X, &subsystem.U] {
            assert!(set.h.iter().all(|h| *h > 0.0 && h.is_finite()), "{text}");
            assert_eq!((set.H.nrows(), set.rows.len()), (set.h.len(), set.h.len()), "{text}");
        }
        let matrices = [&subsystem.A, &subsystem.B, &subsystem.C, &subsystem.E, &subsystem.Cz, &subsystem.Dz];
        let weights = [&subsystem.Q, &subsystem.R, &subsystem.T, &subsystem.X.H, &subsystem.U.H];
        assert!(matrices.iter().chain(&weights).all(|matrix| matrix.iter().all(|x| x.is_finite())), "{text}");
        assert!(subsystem.L.values().all(|L| L.iter().all(|x| x.is_finite())), "{text}");
    }
    for constraint in &network.changing_constraints {
        let exposed = |j: &usize| network.subsystems[*j].exposed.as_ref();
        assert!(!constraint.members.is_empty() && constraint.members.is_sorted(), "{text}");
        assert!(constraint.members.iter().all(|j| exposed(j).is_some()) && !network.start_anywhere, "{text}");
    }
    for constraint in &network.coupling_constraints {
        assert!(constraint.l > 0.0 && constraint.H.keys().eq(constraint.Hz.keys()), "{text}");
    }
}

fn assert_drawn(errors: &Diagnostics, text: &str) {
    assert!(!errors.is_empty(), "{text}");
    for error in &errors.0 {
        assert!(!error.labels.is_empty(), "{}: no place\n{text}", error.title);
        for (place, _) in &error.labels {
            assert!(text.get(place.clone()).is_some(), "{}: {place:?} is not in\n{text}", error.title);
        }
    }
    let source = Source { path: "x.toml".into(), text: text.into() };
    let drawn = errors.render(&source, false);
    assert!(errors.0.iter().all(|error| drawn.contains(error.code)), "{text}");
}

/// One to three tokens, or lines, or numbers among numbers, deleted, doubled, swapped, or replaced.
fn mutated(text: &str, random: &mut Random) -> String {
    match random.below(4) {
        0 => shuffled(text.split_inclusive('\n').collect(), random),
        1 => renumbered(tokens(text), random),
        _ => shuffled(tokens(text), random),
    }
}

fn renumbered(mut tokens: Vec<&str>, random: &mut Random) -> String {
    let numbers: Vec<_> = (0..tokens.len()).filter(|k| tokens[*k].parse::<f64>().is_ok()).collect();
    for _ in 0..=random.below(3) {
        let k = numbers[random.below(numbers.len())];
        tokens[k] = NUMBERS[random.below(NUMBERS.len())];
    }
    tokens.concat()
}

fn shuffled(mut tokens: Vec<&str>, random: &mut Random) -> String {
    for _ in 0..=random.below(3) {
        let (k, other) = (random.below(tokens.len()), random.below(tokens.len()));
        match random.below(5) {
            0 => drop(tokens.remove(k)),
            1 => tokens.insert(k, tokens[k]),
            2 => tokens.swap(k, other),
            3 => tokens[k] = tokens[other],
            _ => tokens[k] = PIECES[random.below(PIECES.len())],
        }
    }
    tokens.concat()
}

/// Words, and every other character on its own.
fn tokens(text: &str) -> Vec<&str> {
    let is_word = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    let starts = text.char_indices().scan('\n', |before, (at, c)| {
        let joins = is_word(*before) && is_word(c);
        *before = c;
        Some((at, joins))
    });
    let mut cuts: Vec<_> = starts.filter(|(_, joins)| !joins).map(|(at, _)| at).collect();
    cuts.push(text.len());
    cuts.windows(2).map(|cut| &text[cut[0]..cut[1]]).collect()
}
