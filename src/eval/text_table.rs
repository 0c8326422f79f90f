//! Columns of figures as text.

/// A table: a head and rows; the first column stands left, the others right.
pub(super) struct TextTable {
    title: String,
    rows: Vec<Vec<String>>,
    /// Texts in place of cells, by the row they stand in.
    remarks: Vec<(usize, String)>,
}

impl TextTable {
    pub fn new(title: impl Into<String>, head: &[&str]) -> Self {
        let head = head.iter().map(|h| (*h).to_owned()).collect();
        Self { title: title.into(), rows: vec![head], remarks: Vec::new() }
    }

    pub fn row(&mut self, name: impl Into<String>, cells: impl IntoIterator<Item = String>) {
        self.rows.push(std::iter::once(name.into()).chain(cells).collect());
    }

    /// A row of one text, which no column has to be as wide as.
    pub fn remark(&mut self, name: impl Into<String>, text: impl Into<String>) {
        self.remarks.push((self.rows.len(), text.into()));
        self.row(name, []);
    }

    pub fn render(&self) -> String {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |c: usize| self.rows.iter().filter_map(|r| r.get(c)).map(|t| t.chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let mut text = format!("{}\n", self.title);
        for (r, row) in self.rows.iter().enumerate() {
            let mut line = String::from(" ");
            for (c, cell) in row.iter().enumerate() {
                let pad = " ".repeat(widths[c] - cell.chars().count());
                line += &if c == 0 { format!(" {cell}{pad}") } else { format!("  {pad}{cell}") };
            }
            if let Some((_, remark)) = self.remarks.iter().find(|(at, _)| *at == r) {
                line += &format!("  {remark}");
            }
            text += line.trim_end();
            text.push('\n');
        }
        text
    }
}

/// A number with that many decimals; `-` for NaN.
pub(super) fn fixed(value: f64, decimals: usize) -> String {
    if value.is_nan() { "-".into() } else { format!("{value:.decimals$}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_remark_widens_no_column() {
        let mut table = TextTable::new("T", &["", "a"]);
        table.remark("none", "a long reason");
        table.row("some", [fixed(1.0, 1)]);
        assert_eq!(table.render(), "T\n          a\n  none  a long reason\n  some  1.0\n");
    }

    #[test]
    fn columns_line_up() {
        let mut table = TextTable::new("T", &["", "M_α", "time s"]);
        table.row("paper", [fixed(0.5, 2), fixed(10.0, 1)]);
        table.row("ours, now", [fixed(f64::NAN, 2)]);
        assert_eq!(table.render(), "T\n              M_α  time s\n  paper      0.50    10.0\n  ours, now     -\n");
    }
}
