//! What came out of many cases, as a table and as JSON.

use serde_json::{Value, json};

use super::{Family, Outcome, TO_SPARE, Tried, Truth};
use crate::eval::text_table::TextTable;

/// A case that must be looked into.
#[derive(Debug, Clone, PartialEq)]
pub struct Wrong {
    /// With it and the index the case is made again.
    pub seed: u64,
    /// Of the case.
    pub index: u64,
    /// Of the case.
    pub family: Family,
    /// In which way.
    pub outcome: Outcome,
    /// What is true, and what was said.
    pub what: String,
}

/// Cases counted.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tally {
    rows: [Row; Family::ALL.len()],
    /// All that are wrong, and the first of those that were refused without need or not decided.
    pub wrong: Vec<Wrong>,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Row {
    cases: u64,
    certified: u64,
    refused: u64,
    wrongly_certified: u64,
    overstated: u64,
    wrongly_refused: u64,
    tight: u64,
    undecided: u64,
    /// Cases that hold with [`TO_SPARE`] to spare.
    ample: u64,
}

/// Cases of a kind that are listed but for those that are wrong.
const LISTED: usize = 20;

impl Tally {
    /// Counts a case.
    pub fn add(&mut self, seed: u64, index: u64, tried: &Tried) {
        let family = tried.case.family;
        let at = Family::ALL.iter().position(|other| *other == family).unwrap_or(0);
        let row = &mut self.rows[at];
        row.cases += 1;
        row.ample += u64::from(matches!(tried.finding.truth, Truth::Holds { spare } if spare >= TO_SPARE));
        let count = match tried.outcome {
            Outcome::Certified => &mut row.certified,
            Outcome::Refused => &mut row.refused,
            Outcome::WronglyCertified => &mut row.wrongly_certified,
            Outcome::Overstated => &mut row.overstated,
            Outcome::WronglyRefused => &mut row.wrongly_refused,
            Outcome::Tight => &mut row.tight,
            Outcome::Undecided => &mut row.undecided,
        };
        *count += 1;
        let listed = self.wrong.iter().filter(|wrong| wrong.outcome == tried.outcome).count();
        let told = matches!(tried.outcome, Outcome::WronglyRefused | Outcome::Undecided) && listed < LISTED;
        if told || tried.outcome.is_wrong() {
            let said = match tried.certificate.refusals.first() {
                Some(refusal) => refusal.message.clone(),
                None => format!("certified, clearance {:?}", tried.certificate.clearance_proven),
            };
            let what = format!("true: {:?}, least met {:.9}; said: {said}", tried.finding.truth, tried.finding.met);
            self.wrong.push(Wrong { seed, index, family, outcome: tried.outcome, what });
        }
    }

    /// Cases in all.
    pub fn cases(&self) -> u64 {
        self.total().cases
    }

    /// Cases that must not be: certified though something is broken, or more clearance claimed than there is.
    pub fn wrong_count(&self) -> u64 {
        let total = self.total();
        total.wrongly_certified + total.overstated
    }

    /// Cases refused with [`TO_SPARE`] to spare, and all that had as much.
    pub fn needless(&self) -> [u64; 2] {
        let total = self.total();
        [total.wrongly_refused, total.ample]
    }

    /// Cases that the judge left open.
    pub fn undecided(&self) -> u64 {
        self.total().undecided
    }

    /// Of a family: cases, and those rightly refused and rightly certified.
    pub fn of(&self, family: Family) -> [u64; 3] {
        let at = Family::ALL.iter().position(|other| *other == family).unwrap_or(0);
        let row = &self.rows[at];
        [row.cases, row.refused, row.certified]
    }

    fn total(&self) -> Row {
        self.rows.iter().fold(Row::default(), |sum, row| Row {
            cases: sum.cases + row.cases,
            certified: sum.certified + row.certified,
            refused: sum.refused + row.refused,
            wrongly_certified: sum.wrongly_certified + row.wrongly_certified,
            overstated: sum.overstated + row.overstated,
            wrongly_refused: sum.wrongly_refused + row.wrongly_refused,
            tight: sum.tight + row.tight,
            undecided: sum.undecided + row.undecided,
            ample: sum.ample + row.ample,
        })
    }

    fn named(&self) -> impl Iterator<Item = (&'static str, Row)> + '_ {
        Family::ALL.iter().zip(&self.rows).map(|(family, row)| (family.name(), *row)).chain([("all", self.total())])
    }
}

/// A table, and a line for each case to be looked into.
pub fn table(tally: &Tally, seed: u64) -> String {
    let head = [
        "",
        "cases",
        "certified",
        "refused",
        "wrong yes",
        "overstated",
        "needless no",
        "of ample",
        "tight",
        "undecided",
    ];
    let title = format!("The certificate against a judge by brute force, seed {seed}");
    let mut text = TextTable::new(title, &head);
    for (name, row) in tally.named() {
        let cells = [
            row.cases,
            row.certified,
            row.refused,
            row.wrongly_certified,
            row.overstated,
            row.wrongly_refused,
            row.ample,
            row.tight,
            row.undecided,
        ];
        text.row(name, cells.map(|n| n.to_string()));
    }
    let mut out = text.render();
    out += "  wrong yes: certified though something is broken; needless no: refused though all is kept with 1 mm to spare (of ample: all such)\n";
    out += "  tight: refused with less to spare; undecided: the judge's own bounds were not close enough\n";
    for wrong in &tally.wrong {
        out += &format!(
            "{:?}: {} (--seed {} --scene {}): {}\n",
            wrong.outcome,
            wrong.family.name(),
            wrong.seed,
            wrong.index,
            wrong.what
        );
    }
    out
}

/// The same as JSON.
pub fn document(tally: &Tally, seed: u64) -> String {
    let row = |(name, row): (&'static str, Row)| {
        json!({
            "family": name,
            "cases": row.cases,
            "certified": row.certified,
            "refused": row.refused,
            "wrongly_certified": row.wrongly_certified,
            "overstated": row.overstated,
            "wrongly_refused": row.wrongly_refused,
            "with_1mm_to_spare": row.ample,
            "refused_with_less_to_spare": row.tight,
            "undecided": row.undecided,
        })
    };
    let mut rows: Vec<Value> = tally.named().map(row).collect();
    let all = rows.pop();
    let listed = tally.wrong.iter().map(|wrong| {
        json!({
            "seed": wrong.seed,
            "scene": wrong.index,
            "family": wrong.family.name(),
            "outcome": format!("{:?}", wrong.outcome),
            "what": wrong.what,
        })
    });
    let listed: Vec<Value> = listed.collect();
    let document = json!({ "suite": "trust", "seed": seed, "families": rows, "all": all, "listed": listed });
    format!("{document:#}\n")
}
