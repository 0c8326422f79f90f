//! A log of wheel angles and poses, and its CSV form.

use crate::geom::Pose2;

/// The columns, in any order; more are ignored.
const COLUMNS: [&str; 6] = ["time_s", "wheel_left_rad", "wheel_right_rad", "x_m", "y_m", "yaw_rad"];

/// Wheel angles and poses over one clock.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Log {
    /// Time (s) and angles (rad) of the left and the right wheel, not wrapped, in order of time.
    pub wheels: Vec<(f64, [f64; 2])>,
    /// Time (s) and pose, in order of time.
    pub poses: Vec<(f64, Pose2)>,
}

/// What is wrong with a log's text.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LogError {
    /// A column is missing.
    #[error("no column `{0}`")]
    Column(&'static str),
    /// A cell that is no number; an empty one is none.
    #[error("line {line}: `{text}` is no finite number")]
    Number {
        /// Counts from 1.
        line: usize,
        /// What stands there.
        text: String,
    },
    /// Time goes back.
    #[error("line {line}: time does not increase")]
    Time {
        /// Counts from 1.
        line: usize,
    },
    /// The row has neither both wheels nor a whole pose.
    #[error("line {line}: neither both wheel angles nor x, y and yaw")]
    Empty {
        /// Counts from 1.
        line: usize,
    },
    /// Not CSV.
    #[error("not CSV: {0}")]
    Syntax(String),
}

/// A log from CSV with the columns `time_s`, `wheel_left_rad`, `wheel_right_rad`, `x_m`, `y_m`, `yaw_rad`. A row may leave its pose or its wheels
/// empty; lines that begin with `#` are comments.
///
/// # Errors
/// A missing column, cells that are no numbers, time that goes back.
pub fn read_csv(text: &str) -> Result<Log, LogError> {
    let syntax = |error: ::csv::Error| LogError::Syntax(error.to_string());
    let mut reader =
        ::csv::ReaderBuilder::new().comment(Some(b'#')).trim(::csv::Trim::All).from_reader(text.as_bytes());
    let heads = reader.headers().map_err(syntax)?.clone();
    let mut places = [0; COLUMNS.len()];
    for (place, name) in places.iter_mut().zip(COLUMNS) {
        *place = heads.iter().position(|head| head == name).ok_or(LogError::Column(name))?;
    }
    let mut log = Log::default();
    let mut before = f64::NEG_INFINITY;
    for record in reader.records() {
        let record = record.map_err(syntax)?;
        let line = record.position().map_or(0, |at| at.line() as usize);
        let mut cells = [None; COLUMNS.len()];
        for (cell, place) in cells.iter_mut().zip(places) {
            let text = record.get(place).unwrap_or_default();
            if !text.is_empty() {
                let value = text.parse().ok().filter(|v: &f64| v.is_finite());
                *cell = Some(value.ok_or_else(|| LogError::Number { line, text: text.to_owned() })?);
            }
        }
        let [time, left, right, x, y, yaw] = cells;
        let time = time.filter(|time| *time > before).ok_or(LogError::Time { line })?;
        before = time;
        let wheels = left.zip(right);
        let pose = x.zip(y).zip(yaw);
        if wheels.is_none() && pose.is_none() {
            return Err(LogError::Empty { line });
        }
        log.wheels.extend(wheels.map(|(left, right)| (time, [left, right])));
        log.poses.extend(pose.map(|((x, y), yaw)| (time, Pose2::new(x, y, yaw))));
    }
    Ok(log)
}

impl Log {
    /// Whether wheel angles are known then.
    pub(super) fn covers(&self, time: f64) -> bool {
        let ends = self.wheels.first().zip(self.wheels.last());
        ends.is_some_and(|(first, last)| first.0 <= time && time <= last.0)
    }

    /// Angles at a time that is covered: linear between two rows.
    fn angles(&self, time: f64) -> [f64; 2] {
        let next = self.wheels.partition_point(|(at, _)| *at < time).clamp(1, self.wheels.len().max(2) - 1);
        let ((from, a), (to, b)) = (self.wheels[next - 1], self.wheels[next]);
        let share = ((time - from) / (to - from)).clamp(0.0, 1.0);
        [0, 1].map(|k| a[k] + share * (b[k] - a[k]))
    }

    /// Increments of the angles between two times that are covered.
    pub(super) fn turns(&self, from: f64, to: f64) -> Vec<[f64; 2]> {
        if self.wheels.len() < 2 {
            return Vec::new();
        }
        let inside = self.wheels.iter().skip_while(|(at, _)| *at <= from).take_while(|(at, _)| *at < to);
        let angles: Vec<[f64; 2]> = std::iter::once(self.angles(from))
            .chain(inside.map(|(_, angles)| *angles))
            .chain([self.angles(to)])
            .collect();
        angles.windows(2).map(|w| [w[1][0] - w[0][0], w[1][1] - w[0][1]]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_may_have_wheels_or_a_pose_or_both() {
        let text = "# robot 7\nyaw_rad,time_s,wheel_left_rad,wheel_right_rad,x_m,y_m,note\n\
                    ,0,1,2,,,a\n0.5,0.1,,,3,4,b\n0.6,0.2,2,4,5,6,c\n";
        let log = read_csv(text).expect("a log");
        assert_eq!(log.wheels, [(0.0, [1.0, 2.0]), (0.2, [2.0, 4.0])]);
        assert_eq!(log.poses, [(0.1, Pose2::new(3.0, 4.0, 0.5)), (0.2, Pose2::new(5.0, 6.0, 0.6))]);
        assert_eq!(log.turns(0.05, 0.15), [[0.5, 1.0]]);
        assert!(log.covers(0.2) && !log.covers(0.21));
    }

    #[test]
    fn faults_are_told_with_their_line() {
        let head = "time_s,wheel_left_rad,wheel_right_rad,x_m,y_m,yaw_rad\n";
        let fault = |rows: &str| read_csv(&format!("{head}{rows}")).expect_err("a fault");
        assert_eq!(read_csv("time_s,x_m\n"), Err(LogError::Column("wheel_left_rad")));
        assert_eq!(fault("0,1,NaN,0,0,0\n"), LogError::Number { line: 2, text: "NaN".into() });
        assert_eq!(fault("0,1,1,0,0,0\n0,1,1,0,0,0\n"), LogError::Time { line: 3 });
        assert_eq!(fault("0,1,,0,,0\n"), LogError::Empty { line: 2 });
    }
}
