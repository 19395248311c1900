//! The last line of a run: the file that was written, its size, and the worst grade of the verdict.

use crate::output::parameters;
use crate::run::destination::intended_format;
use crate::run::verdict::Grade;
use crate::scene::Scene;
use sph_formats::{FormatSpec, registry};
use std::path::{Path, PathBuf};

/// Files that are named one by one.
const NAMED: usize = 4;

/// The line for a scene that was run; empty where nothing is there.
pub fn line(scene: &Scene, formats: &[FormatSpec], grade: Grade) -> String {
    match listed(&files(scene, formats)) {
        text if text.is_empty() => text,
        text => format!("wrote {text}: {}\n", grade.summary()),
    }
}

/// Files with their sizes, in words.
pub fn listed(files: &[PathBuf]) -> String {
    let sizes: Vec<(&PathBuf, u64)> =
        files.iter().filter_map(|f| Some((f, std::fs::metadata(f).ok()?.len()))).collect();
    let named: Vec<String> = sizes.iter().map(|(f, bytes)| format!("{} ({})", f.display(), size(*bytes))).collect();
    match named.as_slice() {
        [] => String::new(),
        [one] => one.clone(),
        [first, .., _] if named.len() > NAMED => {
            let all = size(sizes.iter().map(|s| s.1).sum());
            format!("{first} and {} more, {all} in all", named.len() - 1)
        }
        [others @ .., last] => format!("{} and {last}", others.join(", ")),
    }
}

/// The output, the page, and what stands beside them.
fn files(scene: &Scene, formats: &[FormatSpec]) -> Vec<PathBuf> {
    let mut all = Vec::new();
    if let Some(path) = scene.output.file.as_deref() {
        let format = intended_format(scene, formats).ok().flatten();
        let several = format.and_then(|format| registry::output_files(format, path, scene.output.files).ok());
        all.extend(several.unwrap_or_else(|| vec![path.to_owned()]));
    }
    all.extend(scene.output.report.clone());
    let code = scene.code().filter(|_| scene.output.parameters);
    all.extend(
        code.zip(scene.output.file.as_deref())
            .into_iter()
            .flat_map(|(c, path): (_, &Path)| parameters::places(c, path)),
    );
    all
}

/// In three digits.
fn size(bytes: u64) -> String {
    let mut value = bytes as f64;
    let mut unit = "B";
    for next in ["kB", "MB", "GB", "TB"] {
        if value < 999.5 {
            break;
        }
        (value, unit) = (value / 1000.0, next);
    }
    match (unit, value) {
        ("B", _) => format!("{bytes} B"),
        (_, v) if v < 9.995 => format!("{v:.2} {unit}"),
        (_, v) if v < 99.95 => format!("{v:.1} {unit}"),
        (_, v) => format!("{v:.0} {unit}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_three_digits() {
        let cases = [
            (0, "0 B"),
            (999, "999 B"),
            (1000, "1.00 kB"),
            (12_345, "12.3 kB"),
            (999_400, "999 kB"),
            (999_600, "1.00 MB"),
            (3_210_000_000, "3.21 GB"),
        ];
        for (bytes, text) in cases {
            assert_eq!(size(bytes), text);
        }
    }

    #[test]
    fn what_is_not_there_is_not_said_to_be_written() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a"), [0; 1500]).unwrap();
        assert_eq!(listed(&[at("a"), at("b")]), format!("{} (1.50 kB)", at("a").display()));
        assert_eq!(listed(&[at("b")]), "");
        let many: Vec<PathBuf> = (0..6).map(|k| at(&k.to_string())).collect();
        many.iter().for_each(|f| std::fs::write(f, [0; 500]).unwrap());
        assert_eq!(listed(&many), format!("{} (500 B) and 5 more, 3.00 kB in all", many[0].display()));
    }
}
