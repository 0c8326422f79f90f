//! Faults of the text before its elements are looked at: XML syntax, depth, what xacro has left.

use std::ops::Range;
use std::sync::Arc;

use roxmltree::{Document, Node};

use super::check::Check;
use crate::diag::{Diagnostic, Diagnostics, Source, Span};

/// Deepest nesting of elements that is read; real URDFs have about 6.
const MAX_DEPTH: usize = 64;

pub(super) fn syntax_error(source: &Arc<Source>, error: &roxmltree::Error) -> Diagnostic {
    let at = position(&source.text, error.pos().row as usize, error.pos().col as usize);
    let fault = |message: String, at: &Span, hint: String| Diagnostic::error("robot/xml", message).at(at).hint(hint);
    let there = character(source, at);
    if source.text.contains("xacro:") {
        return fault(format!("not valid XML: {error}"), &there, expand(&source.name));
    }
    match error {
        roxmltree::Error::DtdDetected => fault(
            "the URDF has a <!DOCTYPE>, which none needs".into(),
            &source.text.find("<!DOCTYPE").map_or(there, |at| Span::new(source, at..at + "<!DOCTYPE".len())),
            "a URDF needs no <!DOCTYPE> and no entities: remove them".into(),
        ),
        roxmltree::Error::NoRootNode => fault(
            "the URDF has no element, expected a <robot>".into(),
            &there,
            "a URDF begins with <robot name=\"…\"> and ends with </robot>".into(),
        ),
        roxmltree::Error::UnclosedRootNode => unclosed(source),
        roxmltree::Error::UnexpectedCloseTag(expected, actual, _) => fault(
            format!("not valid XML: found </{actual}>, expected </{expected}>"),
            &there,
            format!("close <{expected}> first, or remove the closing tag </{actual}>"),
        ),
        roxmltree::Error::DuplicatedAttribute(name, _) => fault(
            format!("not valid XML: the attribute '{name}' is there twice, expected once"),
            &there,
            format!("keep one `{name}=\"…\"`"),
        ),
        other => {
            // Its own words end in the place, which is shown.
            let words = other.to_string();
            let words = words.rsplit_once(" at ").map_or(words.as_str(), |(words, _)| words);
            let hint = "look at the tag there: values are in quotes, `name=\"value\"`, and every <tag> ends in /> or has its </tag>";
            fault(format!("not valid XML: {words}"), &there, hint.into())
        }
    }
}

/// A text that ends before its elements do: names the innermost one and points to its tag.
fn unclosed(source: &Arc<Source>) -> Diagnostic {
    let text = &source.text;
    let (mut open, mut at): (Vec<Range<usize>>, usize) = (Vec::new(), 0);
    while let Some(start) = text[at..].find('<').map(|i| at + i) {
        let rest = &text[start..];
        let ends = |with: &str| rest.find(with).map_or(text.len(), |i| start + i + with.len());
        at = match rest {
            _ if rest.starts_with("<!--") => ends("-->"),
            _ if rest.starts_with("<![CDATA[") => ends("]]>"),
            _ if rest.starts_with("<?") => ends("?>"),
            _ => ends(">"),
        };
        if rest.starts_with("</") {
            open.pop();
        } else if !rest.starts_with("<!") && !rest.starts_with("<?") && !text[..at].ends_with("/>") {
            let name =
                rest[1..].find(|c: char| c.is_whitespace() || c == '>' || c == '/').map_or(rest.len(), |i| i + 1);
            open.push(start..start + name);
        }
    }
    let tag = open.last().cloned().unwrap_or(0..0);
    let name = text[tag.clone()].trim_start_matches('<');
    let message = format!("not valid XML: the file ends within <{name}>, expected </{name}>");
    let hint = format!("add the closing tag </{name}>, or was the file cut off?");
    Diagnostic::error("robot/xml", message).at(&Span::new(source, tag)).hint(hint)
}

/// A fault where elements are left that xacro would have replaced.
pub(super) fn still_xacro(source: &Arc<Source>, document: &Document) -> Option<Diagnostic> {
    let foreign = |n: &Node| n.tag_name().namespace().is_some_and(|name| name.contains("xacro"));
    let left: Vec<Node> = document.descendants().filter(|n| n.is_element() && foreign(n)).collect();
    let first = left.first()?;
    let message = format!(
        "this is a xacro file, not yet a URDF: {} elements are for xacro, the first is <xacro:{}>",
        left.len(),
        first.tag_name().name()
    );
    let at = Check { source, faults: Vec::new() }.start(*first);
    Some(Diagnostic::error("robot/xacro", message).at(&at).hint(expand(&source.name)))
}

/// The command that makes a URDF of a xacro file.
pub(super) fn expand(name: &str) -> String {
    let stem = name.strip_suffix(".xacro").unwrap_or(name);
    let (stem, own) = stem.strip_suffix(".urdf").map_or((stem, false), |s| (s, stem == name));
    let out = if own { format!("{stem}.expanded.urdf") } else { format!("{stem}.urdf") };
    format!(
        "expand it first: `xacro {name} > {out}` (with ROS 2: `ros2 run xacro xacro …`; else `pip install xacro`), and name {out}"
    )
}

/// Byte offset of a row and column (both from 1, columns in characters).
fn position(text: &str, row: usize, column: usize) -> usize {
    let line_start: usize = text.split_inclusive('\n').take(row.saturating_sub(1)).map(str::len).sum();
    let rest = text.get(line_start..).unwrap_or("");
    line_start + rest.chars().take(column.saturating_sub(1)).map(char::len_utf8).sum::<usize>()
}

/// The character that begins at byte `at`.
fn character(source: &Arc<Source>, at: usize) -> Span {
    let length = source.text.get(at..).and_then(|rest| rest.chars().next()).map_or(0, char::len_utf8);
    Span::new(source, at..at + length)
}

pub(super) fn check_depth(source: &Arc<Source>, document: &Document) -> Result<(), Diagnostics> {
    // Parents come before their children, so one pass is enough, however deep the text is.
    let mut depths: Vec<usize> = Vec::new();
    for node in document.descendants() {
        let depth = node.parent().and_then(|p| depths.get(p.id().get_usize())).map_or(0, |d| d + 1);
        if depth > MAX_DEPTH {
            let message = format!("elements are nested more than {MAX_DEPTH} deep, a URDF's are about 6");
            let at = character(source, node.range().start);
            let hint = "look for a closing tag that is missing further up";
            return Err(Diagnostic::error("robot/xml-depth", message).at(&at).hint(hint).into());
        }
        depths.resize(node.id().get_usize(), 0);
        depths.push(depth);
    }
    Ok(())
}
