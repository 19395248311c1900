//! Rust sources as tokens: names, `::` and punctuation; comments, texts and what only tests compile are left out.

/// A name, `::`, or one character of punctuation.
pub fn tokens(source: &str) -> Vec<String> {
    let text: Vec<char> = source.chars().collect();
    let (mut out, mut i) = (Vec::new(), 0);
    let begins = |i: usize, what: &str| what.chars().enumerate().all(|(k, c)| text.get(i + k) == Some(&c));
    while i < text.len() {
        let c = text[i];
        if c.is_whitespace() {
            i += 1;
        } else if begins(i, "//") {
            i += text[i..].iter().take_while(|c| **c != '\n').count();
        } else if begins(i, "/*") {
            i = after_comment(&text, i);
        } else if c.is_alphanumeric() || c == '_' {
            let length = text[i..].iter().take_while(|c| c.is_alphanumeric() || **c == '_').count();
            let word: String = text[i..i + length].iter().collect();
            i += length;
            // r"", b"", br#""# and their kin begin like names.
            let hashes = text[i..].iter().take_while(|c| **c == '#').count();
            let prefix = ["r", "b", "br", "c", "cr"].contains(&word.as_str());
            match text.get(i + hashes) {
                Some('"') if prefix && word.contains('r') => i = after_raw(&text, i + hashes + 1, hashes),
                Some('"') if prefix && hashes == 0 => i = after_text(&text, i + 1, '"'),
                Some('\'') if word == "b" && hashes == 0 => i = after_text(&text, i + 1, '\''),
                _ => out.push(word),
            }
        } else if c == '"' {
            i = after_text(&text, i + 1, '"');
        } else if c == '\'' {
            // A character, unless it is a lifetime: 'x' and '\n' are, 'a and 'static are not.
            let is_character = text.get(i + 1) == Some(&'\\') || text.get(i + 2) == Some(&'\'');
            i = if is_character { after_text(&text, i + 1, '\'') } else { i + 1 };
            if !is_character {
                i += text[i..].iter().take_while(|c| c.is_alphanumeric() || **c == '_').count();
            }
        } else if begins(i, "::") {
            out.push("::".into());
            i += 2;
        } else {
            out.push(c.into());
            i += 1;
        }
    }
    out
}

/// Comments nest.
fn after_comment(text: &[char], mut i: usize) -> usize {
    let mut depth = 0;
    while i < text.len() {
        match (text[i], text.get(i + 1)) {
            ('/', Some('*')) => (depth, i) = (depth + 1, i + 2),
            ('*', Some('/')) => (depth, i) = (depth - 1, i + 2),
            _ => i += 1,
        }
        if depth == 0 {
            break;
        }
    }
    i
}

fn after_text(text: &[char], mut i: usize, quote: char) -> usize {
    while i < text.len() && text[i] != quote {
        i += if text[i] == '\\' { 2 } else { 1 };
    }
    i + 1
}

fn after_raw(text: &[char], mut i: usize, hashes: usize) -> usize {
    let ends = |i: usize| text[i] == '"' && (1..=hashes).all(|k| text.get(i + k) == Some(&'#'));
    while i < text.len() && !ends(i) {
        i += 1;
    }
    i + 1 + hashes
}

/// Without the items that `#[cfg(test)]` and `#[cfg(all(test, ...))]` are on, and without other attributes.
pub fn without_tests(tokens: Vec<String>) -> Vec<String> {
    let (mut out, mut i) = (Vec::new(), 0);
    while i < tokens.len() {
        let is_attribute = tokens[i] == "#" && tokens[i + 1..].iter().find(|t| *t != "!").is_some_and(|t| t == "[");
        if !is_attribute {
            out.push(tokens[i].clone());
            i += 1;
            continue;
        }
        let end = after_group(&tokens, i, "[", "]");
        let attribute = &tokens[i..end];
        let for_tests = attribute.iter().any(|t| t == "cfg")
            && attribute.iter().any(|t| t == "test")
            && attribute.iter().all(|t| t != "not");
        i = if for_tests { after_item(&tokens, end) } else { end };
    }
    out
}

/// Past the group that opens first at or after `i`.
fn after_group(tokens: &[String], mut i: usize, open: &str, close: &str) -> usize {
    let mut depth = 0;
    while i < tokens.len() {
        if tokens[i] == open {
            depth += 1;
        } else if tokens[i] == close {
            depth -= 1;
            if depth == 0 {
                return i + 1;
            }
        }
        i += 1;
    }
    i
}

/// Past the item that begins at `i`: its `;`, or the braces of its body.
fn after_item(tokens: &[String], mut i: usize) -> usize {
    while i < tokens.len() {
        match tokens[i].as_str() {
            "#" | "[" => i = after_group(tokens, i, "[", "]"),
            "(" => i = after_group(tokens, i, "(", ")"),
            ";" => return i + 1,
            "{" => {
                let end = after_group(tokens, i, "{", "}");
                // The list of a `use` has its `;` still to come.
                return if tokens.get(end).is_some_and(|t| t == ";") { end + 1 } else { end };
            }
            _ => i += 1,
        }
    }
    i
}

#[test]
fn comments_texts_and_lifetimes_are_no_names() {
    let source = r###"
        // use super::a;
        /* use /* super::b */ super::c; */
        fn f<'a>(x: &'a str) -> char { let s = "use super::d; \" // "; let r = r#"super::"e"#; b'"'; '\''; 'x' }
    "###;
    let found = tokens(source);
    assert!(["a", "b", "c", "d", "e", "super", "x'"].iter().all(|name| !found.iter().any(|t| t == name)), "{found:?}");
    assert_eq!(found.iter().filter(|t| *t == "x").count(), 1, "{found:?}");
    assert!(found.ends_with(&["}".to_string()]), "{found:?}");
}

#[test]
fn what_only_tests_compile_is_left_out() {
    let source = "#[cfg(test)] use a::{b}; #[derive(X)] struct Y; #[cfg(test)] #[path = \"t\"] mod t; #[cfg(all(test, unix))] \
                  mod u { fn v() {} } #[cfg(not(test))] fn kept(x: [u8; 2]) {} #[cfg(test)] fn w(x: [u8; 2]) { { } } fn last() {}";
    let found = without_tests(tokens(source)).join(" ");
    assert_eq!(found, "struct Y ; fn kept ( x : [ u8 ; 2 ] ) { } fn last ( ) { }");
}
