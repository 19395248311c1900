//! The words that lines begin with.

pub const NAME: &str = "obj";

/// What says nothing of the shape.
pub const LEFT_OUT: [&str; 14] =
    ["vt", "vn", "vp", "o", "g", "s", "mg", "mtllib", "usemtl", "usemap", "maplib", "lod", "shadow_obj", "trace_obj"];

/// Whether all lines but the last, which may be cut, begin as they should, with a point among them.
pub fn is_obj(head: &str) -> bool {
    let mut lines: Vec<&str> = head.lines().collect();
    if !head.ends_with('\n') {
        lines.pop();
    }
    // What a line goes on with begins with no word.
    let is_new = |i: &usize| *i == 0 || !lines.get(i - 1).is_some_and(|before| before.trim_end().ends_with('\\'));
    let lines = || (0..lines.len()).filter(is_new).filter_map(|i| lines.get(i));
    let words = || lines().filter_map(|l| l.split_whitespace().next()).filter(|w| !w.starts_with('#'));
    words().any(|w| w == "v") && words().all(|w| ["v", "f", "l", "p"].contains(&w) || LEFT_OUT.contains(&w))
}
