//! The words that files use for the choices of a mission. One place, so that readers and writers agree.

use crate::mission::Sampling;
use crate::trajectory::{Ending, TrajectorySource};

/// Every sampling and its word.
pub const SAMPLINGS: [(Sampling, &str); 3] =
    [(Sampling::Mean, "mean"), (Sampling::Instant, "instant"), (Sampling::Tracked, "tracked")];

/// The word for a sampling.
pub fn sampling(sampling: Sampling) -> &'static str {
    match sampling {
        Sampling::Mean => "mean",
        Sampling::Instant => "instant",
        Sampling::Tracked => "tracked",
    }
}

/// The sampling a word stands for.
pub fn parse_sampling(word: &str) -> Option<Sampling> {
    SAMPLINGS.iter().find(|(_, name)| *name == word).map(|(value, _)| *value)
}

/// The word for where a trajectory comes from.
pub fn source(source: TrajectorySource) -> &'static str {
    match source {
        TrajectorySource::Optimised => "optimised",
        TrajectorySource::Search => "search",
        TrajectorySource::Given => "given",
    }
}

/// The word for how the optimiser ended.
pub fn ending(ending: Ending) -> &'static str {
    match ending {
        Ending::Converged => "converged",
        Ending::IterationLimit => "iteration_limit",
        Ending::LineSearchStalled => "line_search_stalled",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sampling_is_read_back_from_its_word() {
        for (value, word) in SAMPLINGS {
            assert_eq!(sampling(value), word);
            assert_eq!(parse_sampling(word), Some(value));
        }
        assert_eq!(parse_sampling("Mean"), None);
    }
}
