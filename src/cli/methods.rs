//! The table of seeding methods, generated from their data sheets.

use crate::seeding::METHODS;

/// Some lines per method, the default first.
pub fn table() -> String {
    let mut out = format!("{:<29} {:<12} {}\n", "seeding", "dimensions", "targets");
    for m in METHODS {
        out += &format!(
            "{:<29} {:<12} {}\n  {}\n  limits: {}\n  {}\n",
            if m.short.is_empty() { m.name.to_string() } else { format!("{} ({})", m.name, m.short) },
            m.dimension_text(),
            m.targets.text(),
            m.summary,
            m.limits,
            m.reference
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_has_its_lines() {
        let table = table();
        assert!(METHODS.iter().all(|m| table.contains(m.name) && table.contains(m.limits)));
        assert_eq!(table.lines().count(), 1 + 4 * METHODS.len());
    }
}
