//! Files that are nearly networks: every way in which a file of somebody's goes wrong, made by a seeded generator.
//!
//! Depends on nothing, so that the tests of the program, which are in another package, can include it.

/// A mutated file.
#[derive(Debug, Clone)]
pub struct Mutant {
    /// Which kind of mutation made it.
    pub kind: &'static str,
    pub bytes: Vec<u8>,
}

/// Mutants of some texts, the same ones for the same seed.
pub struct Mutations {
    random: Random,
    texts: Vec<String>,
}

type Mutation = fn(&str, &mut Random) -> Vec<u8>;

const KINDS: [(&str, Mutation); 22] = [
    ("bytes flipped", flipped_bytes),
    ("bytes inserted", inserted_bytes),
    ("cut off", cut_off),
    ("piece left out", left_out),
    ("text unquoted", unquoted_text),
    ("lines shuffled", shuffled_lines),
    ("two files in one", two_files),
    ("line twice", doubled_line),
    ("line deleted", deleted_line),
    ("lines swapped", swapped_lines),
    ("odd numbers", odd_numbers),
    ("scaled numbers", scaled_numbers),
    ("signs turned", turned_signs),
    ("numbers quoted", quoted_numbers),
    ("keys renamed", renamed_keys),
    ("keys exchanged", exchanged_keys),
    ("rows swapped", swapped_rows),
    ("row left out", row_left_out),
    ("table emptied", emptied_table),
    ("value nested", nested_value),
    ("names replaced", replaced_names),
    ("line breaks of Windows", windows_lines),
];

/// So many of the first kinds mostly leave no TOML.
const SYNTACTIC: usize = 8;

impl Mutations {
    pub fn new(seed: u64, texts: Vec<String>) -> Self {
        Self { random: Random(seed), texts }
    }

    /// One to three mutations of one kind, of one of the texts.
    pub fn draw(&mut self) -> Mutant {
        let text = self.texts[self.random.below(self.texts.len())].clone();
        // What only spoils the syntax is soon refused: two of three files shall get farther.
        let from = if self.random.below(3) == 0 { 0 } else { SYNTACTIC };
        let (kind, mutation) = KINDS[from + self.random.below(KINDS.len() - from)];
        let mut bytes = mutation(&text, &mut self.random);
        for _ in 0..self.random.below(3) {
            if let Ok(text) = std::str::from_utf8(&bytes) {
                bytes = mutation(text, &mut self.random);
            }
        }
        Mutant { kind, bytes }
    }
}

/// Files that no chance would draw: too deep, too long, too many, in the wrong encoding. `good` is a valid file.
pub fn extremes(good: &str) -> Vec<Mutant> {
    let many = |count: usize, table: &dyn Fn(usize) -> String| (0..count).map(table).collect::<String>();
    let with = |kind, text: String| Mutant { kind, bytes: text.into_bytes() };
    let stated = |line: &str| good.replacen("horizon = ", &format!("{line}\nhorizon = "), 1);
    let horizon = |value: &str| {
        let lines = good
            .lines()
            .map(|line| if line.starts_with("horizon") { format!("horizon = {value}") } else { line.into() });
        lines.collect::<Vec<_>>().join("\n")
    };
    let mut all = vec![
        with("empty", String::new()),
        with("blank", " \n\t\r\n".into()),
        with("only a comment", "# nothing\n".into()),
        Mutant { kind: "no UTF-8", bytes: vec![0xff, 0xfe, 0x00, 0x80] },
        Mutant { kind: "UTF-16", bytes: good.encode_utf16().flat_map(u16::to_le_bytes).collect() },
        Mutant { kind: "Latin-1", bytes: [b"# Pr\xfcfstand\n", good.as_bytes()].concat() },
        with("byte order mark", format!("\u{feff}{good}")),
        with("line breaks of Windows", good.replace('\n', "\r\n")),
        with("line breaks of old", good.replace('\n', "\r")),
        with("NUL inside", good.replacen('=', "=\0", 1)),
        with("NUL at the end", format!("{good}\0")),
        with("brackets too deep", format!("name = {}", "[".repeat(200_000))),
        with("tables too deep", format!("a = {}", "{ a = ".repeat(100_000))),
        with("dots too deep", format!("{}x = 1\n", "a.".repeat(100_000))),
        with("headings too deep", format!("[{}x]\n", "a.".repeat(100_000))),
        with("a long row", stated(&format!("A = [[{}]]", "1.0, ".repeat(200_000)))),
        with("many rows", stated(&format!("A = [{}]", "[1.0], ".repeat(200_000)))),
        with("a long name", good.replacen("name = \"", &format!("name = \"{}", "n".repeat(100_000)), 1)),
        with("a long number", good.replacen("horizon = ", &format!("horizon = 1{}", "0".repeat(10_000)), 1)),
        with("a long comment", format!("# {}\n{good}", "x".repeat(1_000_000))),
        with("many comments", format!("{}{good}", "# x\n".repeat(200_000))),
        with("many unknown keys", format!("{}{good}", many(20_000, &|i| format!("key-{i} = {i}\n")))),
        with("many empty subsystems", format!("{good}\n{}", many(100_000, &|i| format!("[subsystem.s{i}]\n")))),
        with("many empty constraints", format!("{good}\n{}", many(20_000, &|_| "[[coupling-constraint]]\n".into()))),
        with(
            "many neighbours",
            format!("{good}\n{}", many(20_000, &|i| format!("[subsystem.left.from.n{i}]\nA = [[1.0]]\n"))),
        ),
        with(
            "many states",
            format!("{good}\n[subsystem.wide]\nstates = [{}]\n", many(50_000, &|i| format!("\"x{i}\", "))),
        ),
        with("the same state often", format!("{good}\n[subsystem.wide]\nstates = [{}]\n", "\"x\", ".repeat(50_000))),
    ];
    let horizons = [
        "1000000000",
        "-1",
        "0",
        "500",
        "501",
        "9223372036854775807",
        "9223372036854775808",
        "3.0",
        "1e3",
        "nan",
        "\"3\"",
        "[3]",
    ];
    all.extend(horizons.map(|value| with("odd horizons", horizon(value))));
    all
}

/// Numbers at which arithmetic turns odd.
const NUMBERS: [&str; 30] = [
    "nan",
    "-nan",
    "inf",
    "-inf",
    "0",
    "0.0",
    "-0.0",
    "1",
    "-1",
    "1e308",
    "-1e308",
    "1.8e308",
    "1e999",
    "-1e999",
    "1e30",
    "-1e30",
    "1.1e30",
    "1e-30",
    "1e-300",
    "5e-324",
    "1e-999",
    "9223372036854775807",
    "-9223372036854775808",
    "99999999999999999999999999999999999999",
    "0xffffffff",
    "0b1",
    "1_000_000",
    "1e15",
    "1e-16",
    "0.999999999999",
];

const NAMES: [&str; 14] = [
    "",
    " ",
    "µ",
    "水位",
    "tänk",
    "😀",
    "a b",
    "x [",
    "x]",
    "\\u0000",
    "\\u202e",
    "fn",
    "../../etc/passwd",
    "𝒙\u{301} [°C]",
];

const BYTES: [u8; 14] = [0, 9, 10, 13, 0x1b, b'"', b'\'', b'[', b']', b'{', b'}', b'#', b'=', 0xff];

fn flipped_bytes(text: &str, random: &mut Random) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..=random.below(4) {
        if let Some(k) = random.index(bytes.len()) {
            bytes[k] ^= 1 << random.below(8);
        }
    }
    bytes
}

fn inserted_bytes(text: &str, random: &mut Random) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..=random.below(4) {
        let byte = BYTES[random.below(BYTES.len())];
        bytes.insert(random.below(bytes.len() + 1), byte);
    }
    bytes
}

fn cut_off(text: &str, random: &mut Random) -> Vec<u8> {
    text.as_bytes()[..random.below(text.len() + 1)].to_vec()
}

fn left_out(text: &str, random: &mut Random) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    let start = random.below(bytes.len() + 1);
    let end = (start + random.below(40)).min(bytes.len());
    bytes.drain(start..end);
    bytes
}

fn deleted_line(text: &str, random: &mut Random) -> Vec<u8> {
    lines(text, random, |lines, k, _| {
        lines.remove(k);
    })
}

fn doubled_line(text: &str, random: &mut Random) -> Vec<u8> {
    lines(text, random, |lines, k, _| lines.insert(k, lines[k]))
}

fn swapped_lines(text: &str, random: &mut Random) -> Vec<u8> {
    lines(text, random, |lines, k, other| lines.swap(k, other))
}

fn shuffled_lines(text: &str, random: &mut Random) -> Vec<u8> {
    let mut lines: Vec<&str> = text.lines().collect();
    (1..lines.len()).rev().for_each(|k| lines.swap(k, random.below(k + 1)));
    lines.join("\n").into_bytes()
}

/// `change` is told two lines.
fn lines(text: &str, random: &mut Random, change: impl Fn(&mut Vec<&str>, usize, usize)) -> Vec<u8> {
    let mut lines: Vec<&str> = text.lines().collect();
    if let Some(k) = random.index(lines.len()) {
        let other = random.below(lines.len());
        change(&mut lines, k, other);
    }
    lines.join("\n").into_bytes()
}

fn odd_numbers(text: &str, random: &mut Random) -> Vec<u8> {
    numbers(text, random, |_, random| NUMBERS[random.below(NUMBERS.len())].to_owned())
}

fn scaled_numbers(text: &str, random: &mut Random) -> Vec<u8> {
    let factors = [-1e9, -1.0, -0.01, 1e-12, 1e-6, 0.01, 0.5, 0.9, 1.1, 2.0, 10.0, 1e3, 1e6, 1e9, 1e12];
    numbers(text, random, |number, random| {
        let factor = factors[random.below(factors.len())];
        number.parse::<f64>().map_or_else(|_| number.to_owned(), |number| format!("{:?}", number * factor))
    })
}

fn turned_signs(text: &str, random: &mut Random) -> Vec<u8> {
    numbers(text, random, |number, _| match number.strip_prefix('-') {
        Some(positive) => positive.to_owned(),
        None => format!("-{number}"),
    })
}

fn quoted_numbers(text: &str, random: &mut Random) -> Vec<u8> {
    numbers(text, random, |number, random| match random.below(3) {
        0 => format!("\"{number}\""),
        1 => format!("[{number}]"),
        _ => "true".to_owned(),
    })
}

/// Changes one to three numbers, or in one of eight cases all of a line.
fn numbers(text: &str, random: &mut Random, change: impl Fn(&str, &mut Random) -> String) -> Vec<u8> {
    let mut pieces: Vec<String> = tokens(text).into_iter().map(str::to_owned).collect();
    let is_number =
        |piece: &String| piece.starts_with(|c: char| c.is_ascii_digit() || c == '-') && piece.parse::<f64>().is_ok();
    let all: Vec<usize> = (0..pieces.len()).filter(|k| is_number(&pieces[*k])).collect();
    let Some(first) = random.index(all.len()) else { return text.as_bytes().to_vec() };
    let count = if random.below(8) == 0 { 8 } else { 1 + random.below(3) };
    for k in all.into_iter().skip(first).take(count) {
        pieces[k] = change(&pieces[k], random);
    }
    pieces.concat().into_bytes()
}

fn unquoted_text(text: &str, random: &mut Random) -> Vec<u8> {
    tokens_that(text, random, |piece| piece == "\"", |random| ["", "'", "\"\"\"", "1"][random.below(4)].to_owned())
}

fn renamed_keys(text: &str, random: &mut Random) -> Vec<u8> {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let keyed: Vec<usize> =
        (0..lines.len()).filter(|k| lines[*k].contains('=') || lines[*k].starts_with('[')).collect();
    if let Some(k) = random.index(keyed.len()) {
        let line = &mut lines[keyed[k]];
        let at = line.char_indices().nth(random.below(6)).map_or(0, |(at, _)| at);
        let letter = ["q", "Z", "-", "", "é", "."][random.below(6)];
        let end = line[at..].chars().next().map_or(at, |c| at + c.len_utf8());
        line.replace_range(at..end, letter);
    }
    lines.join("\n").into_bytes()
}

fn exchanged_keys(text: &str, random: &mut Random) -> Vec<u8> {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let keyed: Vec<usize> = (0..lines.len()).filter(|k| lines[*k].contains(" = ")).collect();
    if let (Some(a), Some(b)) = (random.index(keyed.len()), random.index(keyed.len())) {
        let (a, b) = (keyed[a], keyed[b]);
        let key = |line: &str| line.split(" = ").next().unwrap_or_default().to_owned();
        let (of_a, of_b) = (key(&lines[a]), key(&lines[b]));
        lines[a] = lines[a].replacen(&of_a, &of_b, 1);
        lines[b] = lines[b].replacen(&of_b, &of_a, 1);
    }
    lines.join("\n").into_bytes()
}

fn swapped_rows(text: &str, random: &mut Random) -> Vec<u8> {
    rows(text, random, |rows| rows.reverse())
}

fn row_left_out(text: &str, random: &mut Random) -> Vec<u8> {
    rows(text, random, |rows| rows.truncate(rows.len() - 1))
}

/// Changes the rows of a matrix that stands on one line.
fn rows(text: &str, random: &mut Random, change: impl Fn(&mut Vec<&str>)) -> Vec<u8> {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let matrices: Vec<usize> = (0..lines.len()).filter(|k| lines[*k].contains("], [")).collect();
    if let Some(k) = random.index(matrices.len()) {
        let line = lines[matrices[k]].clone();
        let mut rows: Vec<&str> = line.split("], [").collect();
        change(&mut rows);
        lines[matrices[k]] = rows.join("], [");
    }
    lines.join("\n").into_bytes()
}

fn emptied_table(text: &str, random: &mut Random) -> Vec<u8> {
    let lines: Vec<&str> = text.lines().collect();
    let headings: Vec<usize> = (0..lines.len()).filter(|k| lines[*k].starts_with('[')).collect();
    let Some(k) = random.index(headings.len()) else { return text.as_bytes().to_vec() };
    let end = headings.get(k + 1).copied().unwrap_or(lines.len());
    [&lines[..=headings[k]], &lines[end..]].concat().join("\n").into_bytes()
}

fn nested_value(text: &str, random: &mut Random) -> Vec<u8> {
    let depth = [1, 2, 60, 5000][random.below(4)];
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let keyed: Vec<usize> = (0..lines.len()).filter(|k| lines[*k].contains(" = ")).collect();
    if let Some(k) = random.index(keyed.len()) {
        let line = &lines[keyed[k]];
        let (key, value) = line.split_once(" = ").unwrap_or((line, ""));
        lines[keyed[k]] = format!("{key} = {}{value}{}", "[".repeat(depth), "]".repeat(depth));
    }
    lines.join("\n").into_bytes()
}

fn replaced_names(text: &str, random: &mut Random) -> Vec<u8> {
    let name = NAMES[random.below(NAMES.len())];
    let mut pieces: Vec<&str> = text.split('"').collect();
    let quoted: Vec<usize> = (0..pieces.len()).filter(|k| k % 2 == 1).collect();
    if let Some(k) = random.index(quoted.len()) {
        pieces[quoted[k]] = name;
    }
    pieces.join("\"").into_bytes()
}

fn windows_lines(text: &str, random: &mut Random) -> Vec<u8> {
    odd_numbers(&text.replace('\n', "\r\n"), random)
}

fn two_files(text: &str, random: &mut Random) -> Vec<u8> {
    let cut = random.below(text.lines().count() + 1);
    let head: String = text.lines().take(cut).flat_map(|line| [line, "\n"]).collect();
    (head + text).into_bytes()
}

fn tokens_that(
    text: &str,
    random: &mut Random,
    which: impl Fn(&str) -> bool,
    change: impl Fn(&mut Random) -> String,
) -> Vec<u8> {
    let mut pieces: Vec<String> = tokens(text).into_iter().map(str::to_owned).collect();
    let all: Vec<usize> = (0..pieces.len()).filter(|k| which(&pieces[*k])).collect();
    if let Some(k) = random.index(all.len()) {
        pieces[all[k]] = change(random);
    }
    pieces.concat().into_bytes()
}

/// Words and numbers, and every other character on its own.
fn tokens(text: &str) -> Vec<&str> {
    let is_word = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    let mut cuts = vec![0];
    let mut before = None;
    for (at, c) in text.char_indices() {
        if before.is_some_and(|before| !(is_word(before) && is_word(c))) {
            cuts.push(at);
        }
        before = Some(c);
    }
    cuts.push(text.len());
    cuts.windows(2).map(|cut| &text[cut[0]..cut[1]]).collect()
}

/// SplitMix64.
struct Random(u64);

impl Random {
    /// An integer of 0 to `limit - 1`.
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % limit as u64) as usize
    }

    /// `None` where there is nothing to choose from.
    fn index(&mut self, length: usize) -> Option<usize> {
        (length > 0).then(|| self.below(length))
    }
}
