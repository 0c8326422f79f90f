//! How well a schedule was kept.

/// Collects by how much each row was late.
#[derive(Debug, Clone, Default)]
pub struct Jitter(Vec<f64>);

impl Jitter {
    /// A row that went out this much after its time, s.
    pub fn add(&mut self, late: f64) {
        self.0.push(late);
    }

    /// The figures.
    pub fn report(mut self) -> JitterReport {
        self.0.sort_by(f64::total_cmp);
        let share = |share: f64| match self.0.len() {
            0 => 0.0,
            n => self.0[((share * n as f64).ceil() as usize).clamp(1, n) - 1],
        };
        JitterReport { rows: self.0.len(), p50: share(0.5), p99: share(0.99), max: share(1.0) }
    }
}

/// Lateness of rows against the schedule, s. A row is never early.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JitterReport {
    /// Rows on the schedule.
    pub rows: usize,
    /// Half of the rows were no later.
    pub p50: f64,
    /// 99 of 100 rows were no later.
    pub p99: f64,
    /// The latest.
    pub max: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_the_least_values_that_so_many_rows_do_not_exceed() {
        let mut jitter = Jitter::default();
        (1..=200).rev().for_each(|k| jitter.add(f64::from(k)));
        assert_eq!(jitter.report(), JitterReport { rows: 200, p50: 100.0, p99: 198.0, max: 200.0 });
        let mut one = Jitter::default();
        one.add(3.0);
        assert_eq!(one.report(), JitterReport { rows: 1, p50: 3.0, p99: 3.0, max: 3.0 });
        assert_eq!(Jitter::default().report(), JitterReport { rows: 0, p50: 0.0, p99: 0.0, max: 0.0 });
    }
}
