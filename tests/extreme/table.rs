//! What the runs came to, for people and as Markdown.

use super::harness::{Case, Verdict};
use std::fmt::Write;

pub struct Row {
    case: String,
    method: String,
    count: usize,
    figures: String,
    wrong: Vec<String>,
}

impl Row {
    pub fn new(case: &Case, method: &str, count: usize, verdict: &Verdict, wrong: Vec<String>) -> Self {
        let figures = match verdict {
            Verdict::Panicked(_) => "panicked | | | | | |".into(),
            Verdict::Refused(why) => format!("refused: {} | | | | | |", why.replace('|', "/")),
            Verdict::Placed(p, _) => {
                let e = p.error();
                format!(
                    "placed | {:.1e} | {:.2} | {:.2} | {:.2} | {:.3} | {:.2} |",
                    e.epsilon,
                    100.0 * e.mean,
                    100.0 * e.max,
                    p.closest(),
                    p.report.noise.all,
                    p.seconds
                )
            }
        };
        Self { case: case.name.clone(), method: method.into(), count, figures, wrong }
    }
}

/// Columns of the Markdown.
const HEAD: &str = "| scene | method | N | outcome | epsilon | mean % | max % | closest pair | noise | s |
|---|---|---|---|---|---|---|---|---|---|
";

#[derive(Default)]
pub struct Table {
    rows: Vec<Row>,
}

impl Table {
    pub fn push(&mut self, row: Row) {
        self.rows.push(row);
    }

    pub fn markdown(&self) -> String {
        let mut out = String::from(HEAD);
        for r in &self.rows {
            let wrong = if r.wrong.is_empty() { String::new() } else { format!(" **{}**", r.wrong.join("; ")) };
            writeln!(out, "| {}{wrong} | {} | {} | {}", r.case, r.method, r.count, r.figures).unwrap();
        }
        out
    }

    /// The runs with which something was wrong.
    pub fn wrong(&self) -> Vec<String> {
        let bad = self.rows.iter().filter(|r| !r.wrong.is_empty());
        bad.map(|r| format!("{} by {} with {}: {}", r.case, r.method, r.count, r.wrong.join("; "))).collect()
    }

    /// Prints the table, and fails where something was wrong.
    pub fn finish(&self, title: &str) {
        println!("\n## {title}\n\n{}", self.markdown());
        let wrong = self.wrong();
        assert!(wrong.is_empty(), "{} of {} runs:\n{}", wrong.len(), self.rows.len(), wrong.join("\n"));
    }
}
