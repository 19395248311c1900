//! A small image of the result, for terminals that can show images.
//!
//! Two protocols are spoken, by terminals that say in the environment that they know them: kitty's
//! (sw.kovidgoyal.net/kitty/graphics-protocol) and iTerm2's (iterm2.com/documentation-images.html). Sixels are not: whether a terminal
//! knows them is told only by asking it on its own line, whose answer could end up among what the user types.

use super::files::particles;
use super::terminal::is_colored;
use crate::page::{Portrait, picture};
use crate::run::drawings::is_picture;
use crate::scene::Scene;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use sph_formats::FORMATS;
use std::io::IsTerminal;

/// Drawing more particles takes too long for what is not asked for.
const MOST_PARTICLES: usize = 1_000_000;
/// Letters of a command of kitty's.
const CHUNK: usize = 4096;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Protocol {
    Kitty,
    ITerm,
}

/// The output of a scene as what makes the terminal draw it; `None` where it draws nothing, and for what cannot be drawn, of which the report
/// has said more.
pub fn of_output(scene: &Scene) -> Option<String> {
    if !std::io::stdout().is_terminal() || !is_colored() {
        return None;
    }
    let protocol = protocol(&|name| std::env::var(name).ok())?;
    let path = scene.output.file.as_deref()?;
    let png = if is_picture(scene) {
        std::fs::read(path).ok()?
    } else {
        let file = particles(FORMATS, path, None).ok()?;
        let count: usize = file.species.iter().map(|s| s.table.count).sum();
        if count > MOST_PARTICLES {
            return None;
        }
        picture(&Portrait::new(&file, None).ok()?).ok()?
    };
    Some(drawn(&png, protocol))
}

/// What the terminal speaks, by the variables that it sets. Within tmux and screen, which pass on neither, nothing.
fn protocol(variable: &dyn Fn(&str) -> Option<String>) -> Option<Protocol> {
    let of = |name: &str| variable(name).filter(|v| !v.is_empty());
    let (term, program) = (of("TERM").unwrap_or_default(), of("TERM_PROGRAM").unwrap_or_default());
    if of("TMUX").is_some() || term.starts_with("screen") || term.starts_with("tmux") {
        return None;
    }
    if of("KITTY_WINDOW_ID").is_some() || ["xterm-kitty", "xterm-ghostty"].contains(&term.as_str()) {
        return Some(Protocol::Kitty);
    }
    let is_iterm = ["iTerm.app", "WezTerm"].contains(&program.as_str());
    (is_iterm || of("LC_TERMINAL").is_some_and(|v| v == "iTerm2")).then_some(Protocol::ITerm)
}

fn drawn(png: &[u8], protocol: Protocol) -> String {
    let data = STANDARD.encode(png);
    if protocol == Protocol::ITerm {
        let bytes = png.len();
        return format!("\u{1b}]1337;File=inline=1;size={bytes};preserveAspectRatio=1:{data}\u{7}\n");
    }
    let mut out = String::new();
    let mut rest = data.as_str();
    while !rest.is_empty() {
        let (chunk, after) = rest.split_at(rest.len().min(CHUNK));
        let head = if out.is_empty() { "f=100,a=T,q=2," } else { "" };
        out += &format!("\u{1b}_G{head}m={};{chunk}\u{1b}\\", u8::from(!after.is_empty()));
        rest = after;
    }
    out + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spoken(variables: &[(&str, &str)]) -> Option<Protocol> {
        protocol(&|name| variables.iter().find(|v| v.0 == name).map(|v| v.1.to_owned()))
    }

    #[test]
    fn only_terminals_that_say_so_are_sent_pictures() {
        assert_eq!(spoken(&[("TERM", "xterm-256color")]), None);
        assert_eq!(spoken(&[("TERM", "xterm-kitty")]), Some(Protocol::Kitty));
        assert_eq!(spoken(&[("TERM", "xterm-256color"), ("KITTY_WINDOW_ID", "1")]), Some(Protocol::Kitty));
        assert_eq!(spoken(&[("TERM", "xterm-256color"), ("TERM_PROGRAM", "iTerm.app")]), Some(Protocol::ITerm));
        assert_eq!(spoken(&[("LC_TERMINAL", "iTerm2")]), Some(Protocol::ITerm));
        assert_eq!(spoken(&[("TERM", "tmux-256color"), ("KITTY_WINDOW_ID", "1")]), None);
        assert_eq!(spoken(&[("TERM", "xterm-kitty"), ("TMUX", "/tmp/tmux")]), None);
        assert_eq!(spoken(&[("TERM_PROGRAM", "vscode")]), None);
    }

    #[test]
    fn chunks_add_up_to_the_picture() {
        let png: Vec<u8> = (0..10_000_u32).map(|i| (i * i % 251) as u8).collect();
        let sent = drawn(&png, Protocol::Kitty);
        let parts: Vec<&str> = sent.trim_end().split("\u{1b}\\").filter(|p| !p.is_empty()).collect();
        assert_eq!(parts.len(), (png.len() * 4).div_ceil(3).div_ceil(CHUNK));
        let bodies: String = parts.iter().map(|p| p.split_once(';').unwrap().1).collect();
        assert_eq!(STANDARD.decode(bodies).unwrap(), png);
        let more = parts.iter().filter(|p| p.contains("m=1;")).count();
        assert!(
            more == parts.len() - 1 && parts[0].contains("a=T") && parts.last().unwrap().contains("m=0;"),
            "{parts:?}"
        );
        let inline = drawn(&png, Protocol::ITerm);
        let body = inline.trim_end().trim_end_matches('\u{7}').split_once(':').unwrap().1;
        assert_eq!(STANDARD.decode(body).unwrap(), png);
    }
}
