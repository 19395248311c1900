//! The HTML page: its frame, style and contents. The text is well-formed XML except for its first line.

use super::color::{DARK, LIGHT};
use std::fmt::Write;

/// Layout. Colors are variables, so that figures follow a dark page.
const STYLE: &str = "\
*{box-sizing:border-box}\
body{font:16px/1.5 system-ui,sans-serif;margin:0 auto;max-width:1240px;padding:1rem;color:var(--ink);\
background:var(--ground);overflow-wrap:break-word}\
h1{font-size:1.5rem;line-height:1.25;margin:.5rem 0}h2{font-size:1.2rem;margin:2rem 0 .5rem;border-bottom:1px solid var(--line)}\
p{max-width:75ch}a{color:var(--c0)}code,pre{font:13px/1.45 ui-monospace,monospace}\
pre{white-space:pre-wrap;background:var(--soft);padding:.75rem;border-radius:6px;overflow-wrap:anywhere}\
.scroll{overflow-x:auto}table{border-collapse:collapse;margin:.5rem 0;font-size:.92rem}\
th{font-weight:600}td,th{padding:.3rem .8rem .3rem 0;border-bottom:1px solid var(--line);text-align:left;vertical-align:top}\
.numbers td:first-child{min-width:9em}.numbers td+td,.numbers th+th{text-align:right;font-variant-numeric:tabular-nums}.numbers td+td{white-space:nowrap}\
.lead{--mark:var(--faint);border-left:6px solid var(--mark);background:var(--soft);padding:.75rem 1rem;border-radius:0 6px 6px 0;margin:1rem 0}\
.lead p{margin:0 0 .5rem;font-size:1.1rem;font-weight:600}.lead ul{list-style:none;margin:0;padding:0}\
.lead li{margin:.35rem 0}.tag{display:inline-block;min-width:3.4em;padding:0 .45em;margin-right:.5em;border-radius:4px;\
font-size:.8rem;font-weight:700;text-align:center;color:#fff;background:var(--tag)}\
.good{--mark:#007a5a;--tag:#007a5a}.look{--mark:#b25c00;--tag:#b25c00}.bad{--mark:#b3002d;--tag:#b3002d}\
.figures{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,350px),1fr));gap:1rem;align-items:start}\
figure{margin:0;max-width:600px;break-inside:avoid}figcaption{font-size:.88rem;color:var(--faint)}\
svg{display:block;width:100%;height:auto}\
@media print{body{font-size:11pt;max-width:none;padding:0}.figures{grid-template-columns:1fr 1fr}h2{break-after:avoid}\
tr,.lead{break-inside:avoid}*{print-color-adjust:exact;-webkit-print-color-adjust:exact}}";

/// Style of what is drawn, in a page or in a file of its own.
const DRAWN: &str = "\
svg text{fill:var(--ink);font:13px system-ui,sans-serif}svg .title{font-weight:600}svg .frame{fill:none;stroke:var(--faint)}\
svg .grid{stroke:var(--line);fill:none}svg .shade{fill:var(--faint);opacity:.18}svg .ink{stroke:var(--ink)}";

/// The colors, light and, where the reader asks for it on a screen, dark.
fn variables() -> String {
    let set = |ink: [&str; 5], curves: [&str; LIGHT.len()]| {
        let [ink, faint, line, soft, ground] = ink;
        let mut out = format!("--ink:{ink};--faint:{faint};--line:{line};--soft:{soft};--ground:{ground}");
        for (i, color) in curves.iter().enumerate() {
            let _ = write!(out, ";--c{i}:{color}");
        }
        out
    };
    let light = set(["#1b1b1f", "#5a5a63", "#dcdce2", "#f4f4f7", "#ffffff"], LIGHT);
    let dark = set(["#ececf1", "#a9a9b4", "#3a3a42", "#212127", "#16161a"], DARK);
    format!(":root{{color-scheme:light dark;{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}")
}

/// What makes a drawing readable outside of a page.
pub(super) fn style_of_drawing() -> String {
    format!("<style>{}{DRAWN}svg{{background:var(--ground)}}</style>", variables())
}

/// A page under construction.
#[derive(Debug)]
pub struct Page {
    body: String,
    title: String,
}

impl Page {
    pub fn new(title: &str) -> Self {
        let title = escape(title);
        Self { body: format!("<h1>{title}</h1>\n"), title }
    }

    /// A section with a heading; `content` is HTML. Nothing where that is empty.
    pub fn section(&mut self, heading: &str, content: &str) {
        if !content.is_empty() {
            let _ = writeln!(self.body, "<section>\n<h2>{}</h2>\n{content}</section>", escape(heading));
        }
    }

    /// HTML without a heading.
    pub fn add(&mut self, content: &str) {
        self.body += content;
    }

    /// The whole document.
    pub fn finish(self) -> String {
        let Self { body, title } = self;
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"/>\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/><title>{title}</title>\
             <style>{}{STYLE}{DRAWN}</style></head>\n<body>\n{body}</body>\n</html>\n",
            variables()
        )
    }
}

/// Text as HTML. Characters that no document may hold are replaced.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\'' => out += "&#39;",
            '\n' | '\t' => out.push(c),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// Rows of text; the first are the headings, where it is not empty. `class` is `numbers` where all but the first column
/// are numbers.
pub fn table(class: &str, headings: &[&str], rows: &[Vec<String>]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let mut out = format!("<div class=\"scroll\"><table class=\"{class}\">\n");
    if !headings.is_empty() {
        out += "<tr>";
        headings.iter().for_each(|h| out += &format!("<th>{}</th>", escape(h)));
        out += "</tr>\n";
    }
    for row in rows {
        out += "<tr>";
        row.iter().for_each(|cell| out += &format!("<td>{}</td>", escape(cell)));
        out += "</tr>\n";
    }
    out + "</table></div>\n"
}

/// Lines of text as a list.
pub fn list(lines: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    let items: String = lines.into_iter().map(|l| format!("<li>{}</li>\n", escape(l.as_ref()))).collect();
    if items.is_empty() { items } else { format!("<ul>\n{items}</ul>\n") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_from_outside_is_no_markup() {
        assert_eq!(escape("<b>\"a\" & 'b'\u{0}\u{1b}"), "&lt;b&gt;&quot;a&quot; &amp; &#39;b&#39;\u{fffd}\u{fffd}");
        let mut page = Page::new("</title><script>");
        page.section("a", &table("", &["<i>"], &[vec!["<script>".into()]]));
        let html = page.finish();
        assert!(!html.contains("<script") && !html.contains("<i>"), "{html}");
    }
}
