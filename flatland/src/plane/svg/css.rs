//! The part of CSS that usvg reads. Its parser skips the rest without a word.

/// Text without `/* … */`; `None` if one stays open.
pub(super) fn without_comments(text: &str) -> Option<String> {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("/*") {
        out.push_str(before);
        out.push(' ');
        rest = after.split_once("*/")?.1;
    }
    out.push_str(rest);
    Some(out)
}

/// Element names, classes and ids, and their descendants: `g.a .b, #c`.
pub(super) fn is_selector(text: &str) -> bool {
    let is_compound = |word: &str| {
        let mut parts = word.split(['.', '#']);
        let element = parts.next().unwrap_or("");
        (element.is_empty() || element == "*" || is_identifier(element)) && parts.all(is_identifier)
    };
    !text.trim().is_empty() && text.split_whitespace().all(is_compound)
}

fn is_identifier(text: &str) -> bool {
    let text = text.strip_prefix('-').unwrap_or(text);
    text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && text.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_'))
}

/// The declarations of a style, `name: value; …`, if all are such that usvg's parser reads them.
pub(super) fn declarations(text: &str) -> Option<Vec<(String, String)>> {
    let text = without_comments(text)?;
    let mut out = vec![];
    for piece in text.split(';').map(str::trim).filter(|piece| !piece.is_empty()) {
        let (name, value) = piece.split_once(':')?;
        let (name, value) = (name.trim(), value.trim());
        let value = value
            .strip_suffix("important")
            .map_or(value, |v| v.trim_end().strip_suffix('!').map_or(value, str::trim_end));
        let is_plain = |c: char| c.is_alphanumeric() || " \t\n\r#.,-+%_()'\"".contains(c);
        let quotes = value.matches(['"', '\'']).count();
        let is_known = is_identifier(name) && name.chars().all(|c| !c.is_ascii_uppercase());
        let is_readable = !value.is_empty() && value.chars().all(is_plain) && quotes % 2 == 0;
        if !(is_known && is_readable) || value.contains("var(") {
            return None;
        }
        out.push((name.to_owned(), value.to_owned()));
    }
    Some(out)
}
