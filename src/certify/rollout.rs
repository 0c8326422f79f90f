//! The commands replayed: exact arcs of the base, joints integrated from their held speeds.

use super::motion::Held;
use crate::command::CommandTable;
use crate::geom::Pose2;

/// Where the robot is when each row begins, from the commands alone.
#[derive(Debug)]
pub(super) struct Rollout<'a> {
    table: &'a CommandTable,
    /// At each row's time.
    poses: Vec<Pose2>,
    /// At each row's time, row after row.
    joints: Vec<f64>,
    /// Held in each row: (m/s, rad/s).
    twists: Vec<(f64, f64)>,
}

impl<'a> Rollout<'a> {
    /// Replays a table whose rows all have one speed per joint.
    pub(super) fn new(table: &'a CommandTable, start: Pose2, start_joints: &[f64]) -> Self {
        let twists: Vec<_> = (0..table.rows.len()).map(|k| table.twist(k)).collect();
        let mut poses = Vec::with_capacity(table.rows.len());
        let mut joints = Vec::with_capacity(table.rows.len() * start_joints.len());
        let (mut pose, mut values) = (start, start_joints.to_vec());
        for (row, &(speed, turn_rate)) in table.rows.iter().zip(&twists) {
            poses.push(pose);
            joints.extend_from_slice(&values);
            pose = pose.after_twist(speed, turn_rate, table.sampling_time);
            for (value, rate) in values.iter_mut().zip(&row.joint_velocities) {
                *value += rate * table.sampling_time;
            }
        }
        Self { table, poses, joints, twists }
    }

    /// Number of rows.
    pub(super) fn rows(&self) -> usize {
        self.poses.len()
    }

    /// Seconds a row is held.
    pub(super) fn step(&self) -> f64 {
        self.table.sampling_time
    }

    /// Time `tau` seconds into a row, s.
    pub(super) fn time(&self, row: usize, tau: f64) -> f64 {
        self.table.time(row) + tau
    }

    /// What row `row` holds.
    pub(super) fn held(&self, row: usize) -> Held<'_> {
        let (speed, turn_rate) = self.twists[row];
        Held { speed, turn_rate, rates: &self.table.rows[row].joint_velocities }
    }

    /// The base's pose `tau` seconds into a row.
    pub(super) fn pose(&self, row: usize, tau: f64) -> Pose2 {
        let (speed, turn_rate) = self.twists[row];
        self.poses[row].after_twist(speed, turn_rate, tau)
    }

    /// Joint values when a row begins.
    pub(super) fn joints(&self, row: usize) -> &[f64] {
        let count = self.joints.len() / self.poses.len();
        &self.joints[row * count..(row + 1) * count]
    }

    /// Joint values `tau` seconds into a row; `out` is cleared first.
    pub(super) fn joints_at(&self, row: usize, tau: f64, out: &mut Vec<f64>) {
        out.clear();
        let rates = &self.table.rows[row].joint_velocities;
        out.extend(self.joints(row).iter().zip(rates).map(|(value, rate)| value + rate * tau));
    }

    /// Greatest magnitude of each joint's value while a row is held; `out` is cleared first.
    pub(super) fn extreme_joints(&self, row: usize, out: &mut Vec<f64>) {
        self.joints_at(row, self.step(), out);
        for (end, begin) in out.iter_mut().zip(self.joints(row)) {
            *end = end.abs().max(begin.abs());
        }
    }

    /// A bound on the rounding error of any point of the replayed robot, m. `size`: of the robot, over all postures.
    ///
    /// Each row adds a few units in the last place of heading, which later metres turn into position, and of position.
    pub(super) fn rounding(&self, size: f64, coordinates: f64) -> f64 {
        let rows = self.rows() as f64 + 16.0;
        let far = self.poses.iter().fold(coordinates, |m, p| m.max(p.x.abs()).max(p.y.abs()));
        let yaw = self.poses.iter().fold(1.0f64, |m, p| m.max(p.yaw.abs()));
        let joint = self.joints.iter().fold(1.0f64, |m, q| m.max(q.abs()));
        let length: f64 = self.twists.iter().map(|(speed, _)| speed.abs() * self.step()).sum();
        8.0 * f64::EPSILON * rows * (far + (length + size) * (1.0 + yaw) + size * joint)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certify::tests::robots::{bare_robot, commands};
    use crate::command::CommandRow;
    use crate::math::real;
    use crate::mission::Sampling;

    #[test]
    fn a_held_twist_is_an_exact_arc_and_joints_follow_their_held_speeds() {
        let row = |left, right, velocity| CommandRow {
            wheel_left: left,
            wheel_right: right,
            joint_positions: vec![0.0],
            joint_velocities: vec![velocity],
            pose: Pose2::default(),
        };
        let table = CommandTable {
            sampling_time: 0.5,
            sampling: Sampling::Mean,
            wheel_radii: 0.1.into(),
            track_width: 0.4,
            joints: vec![("arm".into(), false)],
            rows: vec![row(1.0, 3.0, 0.2), row(-1.0, 1.0, -0.6), row(0.0, 0.0, 0.0)],
        };
        let rollout = Rollout::new(&table, Pose2::default(), &[0.1]);
        // 0.2 m/s at 0.5 rad/s: a circle of radius 0.4 m.
        let pose = rollout.pose(0, 0.3);
        assert!(
            (pose.x - 0.4 * real::sin(0.15)).abs() < 1e-15 && (pose.y - 0.4 * (1.0 - real::cos(0.15))).abs() < 1e-15
        );
        assert_eq!(rollout.pose(0, 0.5), rollout.pose(1, 0.0));
        assert!((rollout.pose(2, 0.0).yaw - 0.5).abs() < 1e-15);
        assert!((rollout.joints(2)[0] + 0.1).abs() < 1e-15);
        let mut extreme = Vec::new();
        rollout.extreme_joints(1, &mut extreme);
        assert!((extreme[0] - 0.2).abs() < 1e-15);
    }

    /// A bound for a robot of a size that drives at a speed, turned by `yaw` and with a slide out by `joint`, `far` from the origin.
    fn bound(size: f64, speed: f64, yaw: f64, joint: f64, far: f64) -> f64 {
        let robot = crate::certify::tests::robots::with_joint(bare_robot(), true);
        let held = vec![(speed, 0.0, vec![0.0]); 5];
        let table = commands(&robot, Pose2::new(0.0, 0.0, yaw), &[joint], 0.1, &held).0;
        Rollout::new(&table, Pose2::new(0.0, 0.0, yaw), &[joint]).rounding(size, far)
    }

    #[test]
    fn the_bound_on_rounding_grows_with_all_that_is_added_up_and_in_proportion_to_lengths() {
        let usual = [0.3, 0.7, 2.0, 3.0, 0.9];
        let of = |[size, speed, yaw, joint, far]: [f64; 5]| bound(size, speed, yaw, joint, far);
        for which in 0..5 {
            let mut more = usual;
            more[which] *= 2.0;
            assert!(of(more) > of(usual) * 1.01, "{which}");
        }
        // A robot, a way and a map that are a thousand times as large; a joint's value may be an angle, so it stays.
        let mut large = usual;
        [0, 1, 4].into_iter().for_each(|which| large[which] *= 1e3);
        assert!((of(large) / of(usual) - 1e3).abs() < 1e-6);
    }

    #[test]
    fn rounding_far_away_is_no_more_than_its_bound_and_the_bound_is_small() {
        let robot = bare_robot();
        let held: Vec<_> = (0..2000).map(|k| (0.5, real::sin(0.37 * f64::from(k)), Vec::new())).collect();
        let far = 8e5;
        let near = commands(&robot, Pose2::new(0.0, 0.0, 0.3), &[], 0.1, &held).0;
        let (origin, away) = (Pose2::new(0.0, 0.0, 0.3), Pose2::new(far, -far, 0.3));
        let (here, there) = (Rollout::new(&near, origin, &[]), Rollout::new(&near, away, &[]));
        let (small, bound) = (here.rounding(0.5, 0.0), there.rounding(0.5, 0.0));
        assert!(bound < 1e-5 && small < 1e-8 && small > 100.0 * f64::EPSILON, "{small} {bound}");
        let off = (0..there.rows()).map(|row| {
            let (a, b) = (here.pose(row, 0.0), there.pose(row, 0.0));
            real::hypot(b.x - far - a.x, b.y + far - a.y)
        });
        let worst = off.fold(0.0, f64::max);
        assert!(worst > 0.0 && worst <= bound, "{worst} {bound}");
    }
}
