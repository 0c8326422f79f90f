//! Lines on a stream: CSV with the columns of `commands.csv`, or JSON objects with the same keys and `seq`.

use std::io::Write;

use crate::command::CommandTable;
use crate::emit::{csv, number};
use crate::play::sink::{Command, Sink, SinkError};

/// How a line is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lines {
    /// A line of column names, then one line a command.
    Csv,
    /// One object a line.
    Json,
}

/// Writes each command when it is due.
pub struct StreamSink<W: Write> {
    out: W,
    lines: Lines,
    columns: Vec<String>,
    begun: bool,
}

impl<W: Write> StreamSink<W> {
    /// A sink that writes to `out`.
    pub fn new(out: W, lines: Lines) -> Self {
        Self { out, lines, columns: Vec::new(), begun: false }
    }

    fn line(&mut self, text: &str) -> Result<(), SinkError> {
        let written = self.out.write_all(text.as_bytes()).and_then(|()| self.out.flush());
        written.map_err(|error| SinkError::Lost(format!("stdout is closed: {error}")))
    }
}

impl<W: Write> Sink for StreamSink<W> {
    fn announce(&mut self, plan: &CommandTable) -> Result<(), SinkError> {
        self.columns = csv::columns(plan);
        if self.lines == Lines::Csv && !self.begun {
            self.begun = true;
            return self.line(&csv::line(&self.columns.clone()));
        }
        Ok(())
    }

    fn send(&mut self, command: &Command<'_>, _at: f64) -> Result<(), SinkError> {
        match self.lines {
            Lines::Csv => self.line(&csv::line(&cells(command).into_iter().map(number).collect::<Vec<_>>())),
            Lines::Json => {
                let text = json(&self.columns, command);
                self.line(&(text + "\n"))
            }
        }
    }
}

/// The values of a command in the order of the columns.
fn cells(command: &Command<'_>) -> Vec<f64> {
    csv::cells(command.time, command.row, command.twist)
}

/// A command as a JSON object: `seq`, then the columns.
pub(super) fn json(columns: &[String], command: &Command<'_>) -> String {
    let mut object = serde_json::Map::new();
    object.insert("seq".to_owned(), command.sequence.into());
    for (column, value) in columns.iter().zip(cells(command)) {
        object.insert(column.clone(), value.into());
    }
    serde_json::Value::Object(object).to_string()
}
