//! A command table as something that can be driven at another pace: its rows at whole path times, smooth in between.
//!
//! *Path time* counts rows: at path time 3.5 half of row 3 has been driven. Commands at another pace are the differences of travels at
//! two path times. Travels are cubic splines through those of the held rows: they are the file's own at every row, and between rows they
//! bend as the motion does that was sampled. Straight lines (the held arcs to the letter) would show their corners at low pace: a
//! wheel's speed would go in the file's own steps, but several commands apart, which no limit of jerk has room for.

use crate::command::{CommandRow, CommandTable};
use crate::geom::Pose2;
use crate::math::spline::{SplineEnd, cubic_spline};

/// Rows at rest that are put before and behind the table, so that splines end in straight lines.
const PAD: usize = 6;

/// A table that can be driven at any pace.
#[derive(Debug, Clone)]
pub struct Motion {
    table: CommandTable,
    /// Travel of every actuator (left wheel, right wheel, joints) in units of its speed times a row; one polynomial a row, [`PAD`] first.
    travel: Vec<Vec<[f64; 4]>>,
}

impl Motion {
    /// Makes the table ready. Its numbers must be finite.
    pub fn new(table: CommandTable) -> Self {
        let rows = table.rows.len();
        let knots: Vec<f64> = (0..=rows + 2 * PAD).map(|k| k as f64).collect();
        let travel = (0..2 + table.joints.len())
            .map(|actuator| {
                let mut sum = 0.0;
                let mut sums = vec![0.0; PAD + 1];
                sums.extend(table.rows.iter().map(|row| {
                    sum += speed(row, actuator);
                    sum
                }));
                sums.resize(knots.len(), sum);
                cubic_spline(&knots, &sums, [SplineEnd::Natural; 2])
            })
            .collect();
        Self { table, travel }
    }

    /// The table.
    pub fn table(&self) -> &CommandTable {
        &self.table
    }

    /// Number of actuators: two wheels, then the joints.
    pub fn actuators(&self) -> usize {
        self.travel.len()
    }

    /// Speed of an actuator held in row k, rad/s or m/s; at rest outside of the table.
    pub fn speed(&self, actuator: usize, k: isize) -> f64 {
        usize::try_from(k).ok().and_then(|k| self.table.rows.get(k)).map_or(0.0, |row| speed(row, actuator))
    }

    /// Travel of an actuator from the start to a path time, in units of its speed times a row.
    pub fn travel(&self, actuator: usize, path_time: f64) -> f64 {
        let pieces = &self.travel[actuator];
        let at = (path_time + PAD as f64).clamp(0.0, pieces.len() as f64);
        let k = (at as usize).min(pieces.len() - 1);
        let [c0, c1, c2, c3] = pieces[k];
        let u = at - k as f64;
        c0 + u * (c1 + u * (c2 + u * c3))
    }

    /// The pose at a path time, on the arcs of the held rows.
    pub fn pose(&self, path_time: f64) -> Pose2 {
        let Some(last) = self.table.rows.len().checked_sub(1) else { return Pose2::default() };
        let k = (path_time.max(0.0) as usize).min(last);
        let (v, omega) = self.table.twist(k);
        self.table.rows[k].pose.after_twist(v, omega, (path_time.max(0.0) - k as f64) * self.table.sampling_time)
    }

    /// A joint's value at a path time.
    pub fn joint(&self, joint: usize, path_time: f64) -> f64 {
        let start = self.table.rows.first().map_or(0.0, |row| row.joint_positions[joint]);
        start + self.table.sampling_time * self.travel(2 + joint, path_time)
    }

    /// The command that drives from one path time to another within the time of a row.
    pub fn command(&self, from: f64, to: f64) -> CommandRow {
        let held: Vec<f64> = (0..self.actuators()).map(|a| self.travel(a, to) - self.travel(a, from)).collect();
        CommandRow {
            wheel_left: held[0],
            wheel_right: held[1],
            joint_positions: (0..self.table.joints.len()).map(|j| self.joint(j, from)).collect(),
            joint_velocities: held[2..].to_vec(),
            pose: self.pose(from),
        }
    }
}

/// Held speed of an actuator: left wheel, right wheel, joints.
pub(super) fn speed(row: &CommandRow, actuator: usize) -> f64 {
    match actuator {
        0 => row.wheel_left,
        1 => row.wheel_right,
        joint => row.joint_velocities[joint - 2],
    }
}

/// The table driven slower: every row is held for longer by 1/`rate` and its speeds are smaller by `rate`, so that the path is the same
/// to rounding. Accelerations fall by `rate` squared, jerks by its cube. `rate` in (0, 1].
pub fn slowed(mut table: CommandTable, rate: f64) -> CommandTable {
    debug_assert!(rate > 0.0 && rate <= 1.0);
    if rate == 1.0 {
        return table;
    }
    table.sampling_time /= rate;
    for row in &mut table.rows {
        row.wheel_left *= rate;
        row.wheel_right *= rate;
        row.joint_velocities.iter_mut().for_each(|speed| *speed *= rate);
    }
    table
}
