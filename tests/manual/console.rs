//! Commands with what they print, as the pages show them.

/// A line `$ COMMAND` and the lines after it.
#[derive(Debug, PartialEq, Eq)]
pub struct Command {
    pub text: String,
    /// Empty where the page does not show what is printed.
    pub printed: Vec<String>,
}

/// The commands of a block `console`.
///
/// # Panics
/// A line stands before the first command.
pub fn commands(block: &str) -> Vec<Command> {
    let mut commands: Vec<Command> = Vec::new();
    for line in block.lines() {
        match line.strip_prefix("$ ") {
            Some(text) => commands.push(Command { text: text.to_owned(), printed: Vec::new() }),
            None => commands.last_mut().expect("a block starts with a command").printed.push(line.to_owned()),
        }
    }
    commands
}

impl Command {
    /// Whether it is to fail: it shows a mistake.
    pub fn fails(&self) -> bool {
        self.printed.iter().any(|line| line.starts_with("error"))
    }
}

/// Whether `printed` is what `shown` says: a line `...` stands for any lines, `...` in a line for any text. Spaces at the ends
/// of lines do not count, nor do empty lines at the end.
pub fn agrees(shown: &[String], printed: &str) -> bool {
    let printed = printed.trim_end().lines().map(str::trim_end).collect::<Vec<_>>();
    let end = shown.iter().rposition(|line| !line.trim().is_empty()).map_or(0, |last| last + 1);
    lines_agree(&shown[..end], &printed)
}

fn lines_agree(shown: &[String], printed: &[&str]) -> bool {
    match (shown.split_first(), printed.split_first()) {
        (None, _) => printed.is_empty(),
        (Some((line, rest)), _) if line.trim() == "..." => {
            (0..=printed.len()).any(|skipped| lines_agree(rest, &printed[skipped..]))
        }
        (Some(_), None) => false,
        (Some((line, rest)), Some((first, others))) => line_agrees(line.trim_end(), first) && lines_agree(rest, others),
    }
}

fn line_agrees(shown: &str, printed: &str) -> bool {
    let Some((start, rest)) = shown.split_once("...") else { return shown == printed };
    let Some(mut left) = printed.strip_prefix(start) else { return false };
    let mut parts = rest.split("...").collect::<Vec<_>>();
    let end = parts.pop().unwrap_or_default();
    for part in parts {
        let Some(at) = left.find(part) else { return false };
        left = &left[at + part.len()..];
    }
    left.ends_with(end)
}

#[cfg(test)]
mod tests {
    use super::{Command, agrees, commands};

    fn lines(text: &str) -> Vec<String> {
        text.lines().map(str::to_owned).collect()
    }

    #[test]
    fn commands_are_told_from_what_they_print() {
        let found = commands("$ one\n1\n\n2\n$ two\n");
        let one = Command { text: "one".to_owned(), printed: lines("1\n\n2") };
        assert_eq!(found, [one, Command { text: "two".to_owned(), printed: Vec::new() }]);
    }

    #[test]
    fn dots_stand_for_anything_and_nothing_else_does() {
        assert!(agrees(&lines("a\n...\nd"), "a\nb\nc\nd\n"));
        assert!(agrees(&lines("a\n...\nd"), "a\nd"));
        assert!(agrees(&lines("took ... s, ... MiB"), "took 1.5 s, 3 MiB"));
        assert!(!agrees(&lines("took ... s"), "took 1.5 ms"));
        assert!(!agrees(&lines("a\n...\nd"), "a\nb\nc"));
        assert!(!agrees(&lines("a"), "a\nb"));
        assert!(!agrees(&lines("a\nb"), "a"));
    }
}
