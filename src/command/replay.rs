//! What a robot that follows the table exactly does: every row's twist held, arcs joined.

use crate::geom::Pose2;

use super::CommandTable;

impl CommandTable {
    /// Poses at every row's time, from `start`.
    pub fn replay(&self, start: Pose2) -> Vec<Pose2> {
        let mut poses = Vec::with_capacity(self.rows.len());
        let mut pose = start;
        for k in 0..self.rows.len() {
            poses.push(pose);
            let (v, omega) = self.twist(k);
            pose = pose.after_twist(v, omega, self.sampling_time);
        }
        poses
    }
}
