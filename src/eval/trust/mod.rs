//! `trajc eval --suite trust`: the certificate against adversaries.
//!
//! Cases are drawn from a seed ([`Case`]), each made to be hard for the proof in one way ([`Family`]). [`judge()`] decides by brute force
//! what is true of each, the certificate says what it says, and [`Tally`] counts. A case is found again by its seed and index alone.

mod case;
mod draw;
mod families;
mod judge;
mod tally;

pub use case::Case;
pub use judge::{Bracket, Finding, Truth, judge, least_clearance};
pub use tally::{Tally, Wrong, document, table};

use super::rng::Rng;
use crate::certify::Certificate;

/// Cases where `--count` is not given.
pub const DEFAULT_COUNT: u64 = 1400;
/// What the proof may give away, m: cases with more to spare should be certified.
pub const TO_SPARE: f64 = 1e-3;
/// What two figures of one distance may differ by rounding, m.
const ROUNDING: f64 = 1e-9;

/// What a case tries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    /// The clearance asked for is a little less than the true one.
    Above,
    /// A little more.
    Below,
    /// Too near only while a row is held, never when one begins.
    Between,
    /// Only joints move.
    Joints,
    /// An obstacle wholly inside a shape, or before the middle of a mesh's face.
    Interior,
    /// A wall of one cell, jumped through between two rows.
    ThinWall,
    /// Unseen space beyond the map.
    Edges,
    /// Speed, acceleration or jerk of a wheel or joint, over its limit by 1e-7 to 1e-2 of it, or under.
    Limits,
    /// The last row holds something.
    Rest,
    /// The goal is a little farther off than allowed, or nearer.
    Goal,
    /// Links that touch, or pass each other, by a little.
    OwnLinks,
    /// A speed zone whose corner reaches the way between two rows, or nearly.
    Zones,
    /// Stops on the way: where, and how long.
    Stands,
    /// Contradictions: first row, joint positions, ranges, driving backwards.
    Table,
}

impl Family {
    /// All, in the order in which cases are drawn.
    pub const ALL: [Self; 14] = [
        Self::Above,
        Self::Below,
        Self::Between,
        Self::Joints,
        Self::Interior,
        Self::ThinWall,
        Self::Edges,
        Self::Limits,
        Self::Rest,
        Self::Goal,
        Self::OwnLinks,
        Self::Zones,
        Self::Stands,
        Self::Table,
    ];

    /// As in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Above => "clearance just kept",
            Self::Below => "clearance just missed",
            Self::Between => "only between rows",
            Self::Joints => "only joints move",
            Self::Interior => "inside, before a face",
            Self::ThinWall => "thin wall",
            Self::Edges => "edge of the map",
            Self::Limits => "limits",
            Self::Rest => "not at rest",
            Self::Goal => "end pose",
            Self::OwnLinks => "own links",
            Self::Zones => "speed zones",
            Self::Stands => "stops on the way",
            Self::Table => "contradictions",
        }
    }
}

/// How verdict and truth agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Certified, and true.
    Certified,
    /// Refused, and something was broken.
    Refused,
    /// Certified though something was broken: must not be.
    WronglyCertified,
    /// More clearance claimed than there is: must not be either.
    Overstated,
    /// Refused though everything was kept with [`TO_SPARE`] to spare.
    WronglyRefused,
    /// Refused though everything was kept, with less to spare.
    Tight,
    /// The judge could not tell.
    Undecided,
}

impl Outcome {
    /// What never may be.
    pub fn is_wrong(self) -> bool {
        matches!(self, Self::WronglyCertified | Self::Overstated)
    }
}

/// Compares a verdict with the truth.
pub fn compare(finding: &Finding, certificate: &Certificate) -> Outcome {
    if certificate.clearance_proven.is_some_and(|proven| proven > finding.met + ROUNDING) {
        return Outcome::Overstated;
    }
    match (&finding.truth, certificate.holds()) {
        (Truth::Open(_), _) => Outcome::Undecided,
        (Truth::Broken(_), true) => Outcome::WronglyCertified,
        (Truth::Broken(_), false) => Outcome::Refused,
        (Truth::Holds { .. }, true) => Outcome::Certified,
        (Truth::Holds { spare }, false) if *spare >= TO_SPARE => Outcome::WronglyRefused,
        (Truth::Holds { .. }, false) => Outcome::Tight,
    }
}

/// The case of a seed and an index.
pub fn case(seed: u64, index: u64) -> Case {
    let family = Family::ALL[(index % Family::ALL.len() as u64) as usize];
    families::make(family, &mut Rng::new(&[seed, index]))
}

/// A case, what is true of it, what `certify` says, and how they agree.
pub struct Tried {
    /// The case.
    pub case: Case,
    /// What is true.
    pub finding: Finding,
    /// What is said.
    pub certificate: Certificate,
    /// How they agree.
    pub outcome: Outcome,
}

/// Tries one case.
pub fn attempt(seed: u64, index: u64, certify: &dyn Fn(&Case) -> Certificate) -> Tried {
    let case = case(seed, index);
    let finding = judge(&case);
    let certificate = certify(&case);
    let outcome = compare(&finding, &certificate);
    Tried { case, finding, certificate, outcome }
}

/// Tries `count` cases from `first` on; `each` is called after every one.
pub fn run(seed: u64, first: u64, count: u64, certify: &dyn Fn(&Case) -> Certificate, each: &mut dyn FnMut()) -> Tally {
    let mut tally = Tally::default();
    for index in first..first + count {
        tally.add(seed, index, &attempt(seed, index, certify));
        each();
    }
    tally
}
