//! Text into HTML: nothing that a user wrote can leave its place.

use std::fmt::Write;

/// Text as text of an element or value of a quoted attribute; control characters are replaced.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\'' => out += "&#39;",
            '\n' | '\t' => out.push(' '),
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// JSON as text of a `<script>` element: no tag or comment can begin in it, and it stays the same JSON.
pub(super) fn in_script(json: &str) -> String {
    json.replace('<', "\\u003c").replace('>', "\\u003e").replace('\u{2028}', "\\u2028").replace('\u{2029}', "\\u2029")
}

/// Puts parts into a template, each at its `{{name}}`; what is put in is not looked at again. Names without a part leave nothing.
pub(super) fn fill(template: &str, parts: &[(&str, &str)]) -> String {
    let mut out = String::with_capacity(template.len() + parts.iter().map(|(_, part)| part.len()).sum::<usize>());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        out += before;
        let Some((name, behind)) = after.split_once("}}") else {
            out += "{{";
            rest = after;
            continue;
        };
        out += parts.iter().find(|(known, _)| *known == name).map_or("", |(_, part)| part);
        rest = behind;
    }
    out + rest
}

/// A cell of a table: HTML, and whether it is a number (set flush right).
pub(super) struct Cell {
    pub(super) html: String,
    pub(super) number: bool,
}

/// A cell with text.
pub(super) fn text(text: &str) -> Cell {
    Cell { html: escape(text), number: false }
}

/// A cell with a number.
pub(super) fn number(text: impl AsRef<str>) -> Cell {
    Cell { html: escape(text.as_ref()), number: true }
}

/// A table that scrolls sideways where the screen is narrow. The first cell of a row names it.
pub(super) fn table(caption: &str, head: &[(&str, bool)], rows: &[Vec<Cell>]) -> String {
    let mut out = format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{0}\"><table><caption>{0}</caption>\n<thead><tr>",
        escape(caption)
    );
    for (name, number) in head {
        let class = if *number { " class=\"number\"" } else { "" };
        let _ = write!(out, "<th scope=\"col\"{class}>{}</th>", escape(name));
    }
    out += "</tr></thead>\n<tbody>\n";
    for row in rows {
        out += "<tr>";
        for (k, cell) in row.iter().enumerate() {
            let class = if cell.number { " class=\"number\"" } else { "" };
            let _ = match k {
                0 => write!(out, "<th scope=\"row\"{class}>{}</th>", cell.html),
                _ => write!(out, "<td{class}>{}</td>", cell.html),
            };
        }
        out += "</tr>\n";
    }
    out + "</tbody></table></div>\n"
}

/// Names and what they stand for (HTML).
pub(super) fn definitions(class: &str, pairs: &[(String, String)]) -> String {
    let mut out = format!("<dl class=\"{class}\">\n");
    for (name, html) in pairs {
        let _ = writeln!(out, "<div><dt>{}</dt><dd>{html}</dd></div>", escape(name));
    }
    out + "</dl>\n"
}

/// A section with a heading.
pub(super) fn section(id: &str, heading: &str, body: &str) -> String {
    format!(
        "<section id=\"{id}\" aria-labelledby=\"{id}-h\">\n<h2 id=\"{id}-h\">{}</h2>\n{body}</section>\n",
        escape(heading)
    )
}

/// A link that sets the view to an instant.
pub(super) fn instant(time: f64) -> String {
    format!("<a href=\"#t={0}\">{0} s</a>", super::figure(time))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_becomes_markup() {
        assert_eq!(escape("<b a='1' b=\"2\">&\u{0}\n"), "&lt;b a=&#39;1&#39; b=&quot;2&quot;&gt;&amp;\u{fffd} ");
        let json = in_script("{\"a\":\"</script><!--<script>\u{2028}\"}");
        assert!(!json.contains(['<', '>', '\u{2028}']));
        let back: serde_json::Value = serde_json::from_str(&json).expect("still JSON");
        assert_eq!(back["a"], "</script><!--<script>\u{2028}");
    }

    #[test]
    fn a_template_takes_each_part_once_and_reads_none_of_them() {
        let parts = [("a", "{{b}}"), ("b", "2")];
        assert_eq!(fill("x{{a}}y{{b}}z{{c}}{{", &parts), "x{{b}}y2z{{");
    }

    #[test]
    fn tables_and_lists_are_well_formed_whatever_they_say() {
        let rows = [vec![text("a<b"), number("1")], vec![text("c"), number("2")]];
        let page = table("t & u", &[("name", false), ("value", true)], &rows)
            + &definitions("d", &[("k\"".into(), escape("<v>"))])
            + &section("s", "S", &instant(1.5));
        let page = format!("<div>{page}</div>");
        let tree = roxmltree::Document::parse(&page).expect("well-formed");
        let said: Vec<&str> = tree.descendants().filter_map(|n| n.text()).collect();
        for expected in ["a<b", "t & u", "k\"", "<v>", "1.5 s"] {
            assert!(said.contains(&expected), "{expected} in {said:?}");
        }
    }
}
