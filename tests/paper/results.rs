//! The tables that the tests make: printed, and written to `docs/src/results/alaric.md` where that is asked for.
//!
//! Each test writes its own section between two marks, so that tests can be run one by one:
//!
//! ```sh
//! SPH_PREP_RESULTS=docs/src/results cargo test --release --test all -- --include-ignored --test-threads 1 paper::
//! ```

use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// The page is read and written by one test at a time.
static PAGE: Mutex<()> = Mutex::new(());

/// The order of the sections.
const SECTIONS: [&str; 7] = ["table1", "table2", "fig6", "fig10", "fig12", "fig16", "cost"];

const HEAD: &str = "# ALARIC: the paper's tables and figures, and what comes out here

Written by the tests themselves, in one command from the root of the repository (some minutes):

```sh
SPH_PREP_RESULTS=docs/src/results cargo test --release --test all -- --include-ignored --test-threads 1 paper::
```

Wendland C4; epsilon is the sum of (rho - rho*)^2/n over that of rho*^2/n with the mass re-fitted, as in the paper.
";

/// A table in Markdown.
pub struct Table {
    text: String,
}

impl Table {
    pub fn new(title: &str, about: &str, columns: &[&str]) -> Self {
        let rule = vec!["---"; columns.len()].join("|");
        Self { text: format!("## {title}\n\n{about}\n\n| {} |\n|{rule}|\n", columns.join(" | ")) }
    }

    pub fn row(&mut self, cells: &[String]) {
        self.text += &format!("| {} |\n", cells.join(" | "));
    }

    /// A remark below the rows.
    pub fn note(&mut self, text: &str) {
        self.text += &format!("\n{text}\n");
    }

    /// Prints it, and puts it into the page as `section` if one is asked for.
    pub fn publish(&self, section: &str) {
        println!("\n{}", self.text);
        if let Some(folder) = folder() {
            put(&folder.join("alaric.md"), section, &self.text);
        }
    }
}

/// Where results are to go, relative to the root of the repository.
pub fn folder() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(std::env::var_os("SPH_PREP_RESULTS")?);
    std::fs::create_dir_all(&folder).unwrap();
    Some(folder)
}

fn mark(section: &str) -> String {
    format!("<!-- {section} -->\n")
}

fn put(page: &Path, section: &str, text: &str) {
    let _one = PAGE.lock().unwrap_or_else(|e| e.into_inner());
    assert!(SECTIONS.contains(&section), "'{section}' is no section");
    let old = std::fs::read_to_string(page).unwrap_or_default();
    let kept = |name: &str| {
        let begin = old.find(&mark(name))? + mark(name).len();
        let end = old[begin..].find("<!-- ").map_or(old.len(), |i| begin + i);
        Some(old[begin..end].trim().to_string())
    };
    let mut new = format!("{HEAD}{}", crate::made::line());
    for name in SECTIONS {
        let content = if name == section { Some(text.trim().to_string()) } else { kept(name) };
        if let Some(content) = content {
            new += &format!("\n{}{content}\n", mark(name));
        }
    }
    std::fs::write(page, new).unwrap();
}

#[test]
fn sections_replace_themselves_and_keep_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("page.md");
    put(&page, "table2", "## second\n\nold");
    put(&page, "table1", "## first");
    put(&page, "table2", "## second\n\nnew");
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(text.starts_with(HEAD) && !text.contains("old") && text.matches("new").count() == 1, "{text}");
    assert!(text.find("first") < text.find("second"), "{text}");
}
