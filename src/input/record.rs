//! The cells of one row: separators and quotes (RFC 4180), white space around cells taken off.

/// The cells of a row, one after another in one text.
#[derive(Clone, Debug, Default)]
pub(super) struct Record {
    text: String,
    ends: Vec<usize>,
    state: State,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    /// Before the first character of a cell that is not a space.
    #[default]
    Start,
    /// In a cell without quotes, or after the closing quote.
    Plain,
    /// Between quotes.
    Quoted,
    /// After a quote between quotes: the closing one, or the first half of `""`.
    AfterQuote,
}

impl Record {
    /// A row of one line.
    pub fn of(line: &str, separator: char) -> Self {
        let mut record = Self::default();
        record.push_line(line, separator);
        record.close();
        record
    }

    /// Begins another row.
    pub fn clear(&mut self) {
        self.text.clear();
        self.ends.clear();
        self.state = State::Start;
    }

    /// Takes a line in. True if the row is whole; false if a quote is still open, and the row goes
    /// on with the next line.
    pub fn push_line(&mut self, line: &str, separator: char) -> bool {
        if self.state == State::Quoted {
            self.text.push('\n');
        }
        for c in line.chars() {
            self.state = match (self.state, c) {
                (State::Quoted, '"') => State::AfterQuote,
                (State::Quoted, _) => {
                    self.text.push(c);
                    State::Quoted
                }
                (State::AfterQuote, '"') => {
                    self.text.push('"');
                    State::Quoted
                }
                (_, c) if c == separator => {
                    self.ends.push(self.text.len());
                    State::Start
                }
                (State::Start, '"') => State::Quoted,
                (State::Start, ' ' | '\t') => State::Start,
                (_, c) => {
                    self.text.push(c);
                    State::Plain
                }
            };
        }
        self.state != State::Quoted
    }

    /// Ends the last cell.
    pub fn close(&mut self) {
        self.ends.push(self.text.len());
        self.state = State::Start;
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Bytes of all cells.
    pub fn n_bytes(&self) -> usize {
        self.text.len()
    }

    /// A cell; empty where there is none.
    pub fn get(&self, ix: usize) -> &str {
        let Some(&end) = self.ends.get(ix) else {
            return "";
        };
        let start = ix.checked_sub(1).map_or(0, |before| self.ends[before]);
        self.text[start..end].trim()
    }

    /// The cells in order.
    pub fn iter(&self) -> impl Iterator<Item = &str> {
        (0..self.len()).map(|ix| self.get(ix))
    }
}
