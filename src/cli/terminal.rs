//! Output for terminals only, not for pipes: fitted lines and colors.
//!
//! Programs that read a pipe get each line whole, as it was written.

use std::io::IsTerminal;

/// Letters of a line, where the shell does not say how many there are (`COLUMNS`).
const WIDTH: usize = 80;
/// Fewer leave no room behind a label.
const LEAST: usize = 40;
/// Labels end here at the latest.
const LABELS: usize = 30;

/// A report as standard output is to show it.
pub fn shown(text: &str) -> String {
    if !std::io::stdout().is_terminal() {
        return text.to_owned();
    }
    let folded = folded(text, width());
    if is_colored() { colored(&folded) } else { folded }
}

/// A word at the head of a message on standard error, where that is a terminal.
pub fn marked(word: &str) -> String {
    let is_red = std::io::stderr().is_terminal() && is_colored();
    if is_red { paint(word, RED) } else { word.to_owned() }
}

/// Takes away a line of progress that stands where a message is to stand.
pub fn clear_line() {
    if std::io::stderr().is_terminal() {
        eprint!("\r\u{1b}[K");
    }
}

/// Whether terminals are to be colored: not where `NO_COLOR` is set to something (no-color.org), or where they cannot.
pub fn is_colored() -> bool {
    let is_off = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
    let terminal = std::env::var("TERM").unwrap_or_default();
    !is_off && terminal != "dumb" && !(cfg!(windows) && std::env::var_os("WT_SESSION").is_none())
}

fn width() -> usize {
    let columns = std::env::var("COLUMNS").ok().and_then(|c| c.parse().ok()).filter(|c| *c >= LEAST);
    columns.unwrap_or(WIDTH)
}

/// Lines of at most `width` letters, broken between words; what follows stands under where the value began.
fn folded(text: &str, width: usize) -> String {
    text.lines().map(|line| fold(line, width) + "\n").collect()
}

fn fold(line: &str, width: usize) -> String {
    if line.chars().count() <= width {
        return line.to_owned();
    }
    let inset = line.chars().take_while(|c| *c == ' ').count();
    let value = value_of(line, inset);
    let margin = " ".repeat(value.unwrap_or(inset + 2).min(width / 2));
    // Columns before the value stay as they are.
    let start = line.char_indices().nth(value.unwrap_or(inset)).map_or(line.len(), |(at, _)| at);
    let (mut out, mut current) = (String::new(), line[..start].to_owned());
    let (mut is_first, mut gap) = (true, 0);
    for part in line[start..].split(' ') {
        // Between two spaces stands nothing: wide gaps of tables stay as they are.
        gap += 1;
        if part.is_empty() {
            continue;
        }
        let space = if is_first { 0 } else { gap };
        if !is_first && current.chars().count() + space + part.chars().count() > width {
            out += current.trim_end();
            out.push('\n');
            current.clone_from(&margin);
        } else {
            current += &" ".repeat(space);
        }
        current += part;
        (is_first, gap) = (false, 0);
    }
    out + current.trim_end()
}

/// Where the value of a line begins: behind the last wide gap among the labels. None of a sentence.
fn value_of(line: &str, inset: usize) -> Option<usize> {
    let letters: Vec<char> = line.chars().collect();
    let mut gaps = (2.max(inset + 1)..letters.len().min(LABELS))
        .filter(|&i| letters[i] != ' ' && letters[i - 1] == ' ' && letters[i - 2] == ' ');
    gaps.next_back()
}

const RED: &str = "31;1";
const GREEN: &str = "32";
const YELLOW: &str = "33;1";

/// Words at the head of a line, and their colors.
const MARKS: [(&str, &str); 6] = [
    ("good ", GREEN),
    ("LOOK ", YELLOW),
    ("BAD ", RED),
    ("WARNING ", YELLOW),
    ("MISPLACED ", RED),
    ("UNCONVERGED ", RED),
];

fn colored(text: &str) -> String {
    let line = |line: &str| {
        let rest = line.trim_start();
        let inset = &line[..line.len() - rest.len()];
        let mark = MARKS.iter().find(|(word, _)| !inset.is_empty() && rest.starts_with(word));
        match mark {
            Some((word, color)) => {
                let word = word.trim_end();
                format!("{inset}{}{}\n", paint(word, color), &rest[word.len()..])
            }
            None => format!("{line}\n"),
        }
    };
    text.lines().map(line).collect()
}

fn paint(word: &str, color: &str) -> String {
    format!("\u{1b}[{color}m{word}\u{1b}[0m")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_broken_between_words_under_their_values() {
        let note =
            "  note             the atmosphere is cut at 0.904452 of the radius, which encloses nearly all of the mass";
        assert_eq!(
            fold(note, 60),
            "  note             the atmosphere is cut at 0.904452 of the\n                   radius, which encloses nearly all of the\n                   mass"
        );
        let verdict =
            "    LOOK   density        1.49 % off on average (1 % is good, 5 % is much); more particles bring it down";
        let lines: Vec<String> = fold(verdict, 80).lines().map(str::to_owned).collect();
        assert_eq!(lines.len(), 2);
        assert_eq!(lines[1], format!("{}particles bring it down", " ".repeat(26)));
        let table = format!("a    b         {}", "c    d ".repeat(10));
        assert!(fold(&table, 60).starts_with("a    b         c    d c    d"), "columns lose their gaps");
        assert_eq!(fold("short", 80), "short");
        assert_eq!(fold("  \u{3c1}\u{3c1}\u{3c1}", 5), "  \u{3c1}\u{3c1}\u{3c1}");
    }

    #[test]
    fn no_word_is_broken_and_none_is_lost() {
        let long = "x".repeat(100);
        for width in [40, 57, 80, 120] {
            for text in [
                format!(
                    "a line without an inset, of several words that go on and on and on and on, {long} and on again"
                ),
                format!(
                    "    body one       {long}, velocity [0.000000e0, -2.368323e-1, 0.000000e0] and some words more"
                ),
                format!("      {}", "word ".repeat(60)),
                "of the words that have two letters it is as of all".repeat(4),
                format!("  {}", "of the words that have two letters it is as of all ".repeat(4)),
            ] {
                let folded = folded(&text, width);
                let words = |t: &str| t.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
                assert_eq!(words(&folded), words(&text));
                let is_short = |l: &str| l.chars().count() <= width || l.contains(&long);
                assert!(folded.lines().all(is_short), "{folded}");
            }
        }
    }

    #[test]
    fn marks_are_colored_and_nothing_else_is() {
        let text = "good news at the left\n    good   pairs\n    BAD    balance\n  note   good\n";
        let painted = colored(text);
        assert_eq!(painted.matches('\u{1b}').count(), 4, "{painted:?}");
        assert!(painted.contains("    \u{1b}[32mgood\u{1b}[0m   pairs\n"), "{painted:?}");
        assert_eq!(painted.replace("\u{1b}[32m", "").replace("\u{1b}[31;1m", "").replace("\u{1b}[0m", ""), text);
    }
}
