//! ROS 2 messages that say where the base is, as their CDR has them.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::Deserialize;

use crate::geom::Pose2;
use crate::robot::{BASE_FRAMES, RobotModel};

/// No chain of transforms is longer.
const LONGEST: usize = 64;
/// No more frames than these are remembered.
const MOST_FRAMES: usize = 4096;

/// `builtin_interfaces/msg/Time`.
#[derive(Debug, Clone, Deserialize)]
pub struct Time {
    /// s.
    pub sec: i32,
    /// ns.
    pub nanosec: u32,
}

/// `std_msgs/msg/Header`.
#[derive(Debug, Clone, Deserialize)]
pub struct Header {
    /// When.
    pub stamp: Time,
    /// In which frame.
    pub frame_id: String,
}

impl Header {
    fn seconds(&self) -> f64 {
        f64::from(self.stamp.sec) + 1e-9 * f64::from(self.stamp.nanosec)
    }
}

/// `nav_msgs/msg/Odometry`.
#[derive(Debug, Clone, Deserialize)]
pub struct Odometry {
    /// When, and in which frame the pose is.
    pub header: Header,
    /// What moves.
    pub child_frame_id: String,
    /// x, y, z (m) and quaternion x, y, z, w.
    pub pose: [f64; 7],
    /// Of the pose.
    pub pose_covariance: [[f64; 6]; 6],
    /// m/s and rad/s.
    pub twist: [f64; 6],
    /// Of the twist.
    pub twist_covariance: [[f64; 6]; 6],
}

/// `geometry_msgs/msg/TransformStamped`.
#[derive(Debug, Clone, Deserialize)]
pub struct TransformStamped {
    /// When, and the parent frame.
    pub header: Header,
    /// The frame that is placed.
    pub child_frame_id: String,
    /// x, y, z (m) and quaternion x, y, z, w.
    pub transform: [f64; 7],
}

/// `tf2_msgs/msg/TFMessage`.
#[derive(Debug, Clone, Deserialize)]
pub struct Transforms {
    /// Any number of them.
    pub transforms: Vec<TransformStamped>,
}

/// Position and quaternion; `None` where they are no pose.
fn isometry(v: &[f64; 7]) -> Option<Isometry3<f64>> {
    let turn = UnitQuaternion::try_new(Quaternion::new(v[6], v[3], v[4], v[5]), 1e-6)?;
    let place = Translation3::new(v[0], v[1], v[2]);
    v.iter().all(|value| value.is_finite()).then(|| Isometry3::from_parts(place, turn))
}

struct Edge {
    parent: String,
    pose: Isometry3<f64>,
    fixed: bool,
}

/// Turns messages into poses of the base. Of transforms it remembers the latest between any two frames.
pub struct Frames {
    world: String,
    robot: RobotModel,
    edges: BTreeMap<String, Edge>,
}

impl Frames {
    /// `world`: the frame in which the mission's poses are; heeded of transforms alone, odometry is taken to be in it.
    pub fn new(robot: &RobotModel, world: &str) -> Self {
        Self { world: world.to_owned(), robot: robot.clone(), edges: BTreeMap::new() }
    }

    /// Stamp (s) and pose of the base. A frame other than the URDF's root link is taken for the base.
    pub fn odometry(&self, message: &Odometry) -> Option<(f64, Pose2)> {
        Some((message.header.seconds(), self.robot.base_of(&message.child_frame_id, isometry(&message.pose)?)))
    }

    /// Stamp (s) and pose of the base, if these transforms move it and there is a chain of transforms from the world's frame to it.
    /// `fixed`: they are of `/tf_static`.
    pub fn transforms(&mut self, message: &Transforms, fixed: bool) -> Option<(f64, Pose2)> {
        for edge in &message.transforms {
            let known = self.edges.contains_key(&edge.child_frame_id);
            if let Some(pose) = isometry(&edge.transform).filter(|_| known || self.edges.len() < MOST_FRAMES) {
                let parent = edge.header.frame_id.clone();
                self.edges.insert(edge.child_frame_id.clone(), Edge { parent, pose, fixed });
            }
        }
        let base = std::iter::once(self.robot.root_link.as_str())
            .chain(BASE_FRAMES)
            .find(|frame| self.edges.contains_key(*frame))?;
        let (mut frame, mut pose, mut lowest) = (base, Isometry3::identity(), None);
        for _ in 0..LONGEST {
            if frame == self.world {
                break;
            }
            let edge = self.edges.get(frame)?;
            lowest = lowest.or((!edge.fixed).then_some(frame));
            (frame, pose) = (&edge.parent, edge.pose * pose);
        }
        // Where frames go round, the world's is never reached.
        let moved = lowest.filter(|_| frame == self.world)?;
        let told = message.transforms.iter().rfind(|edge| edge.child_frame_id == moved)?;
        Some((told.header.seconds(), self.robot.base_of(base, pose)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::real;
    use crate::trajectory::fixtures;

    fn at(sec: i32, frame: &str) -> Header {
        Header { stamp: Time { sec, nanosec: 500_000_000 }, frame_id: frame.to_owned() }
    }

    /// A pose in the plane, turned by an angle about z.
    fn flat(x: f64, y: f64, yaw: f64) -> [f64; 7] {
        [x, y, 0.0, 0.0, 0.0, real::sin(0.5 * yaw), real::cos(0.5 * yaw)]
    }

    fn edge(sec: i32, parent: &str, child: &str, transform: [f64; 7]) -> TransformStamped {
        TransformStamped { header: at(sec, parent), child_frame_id: child.to_owned(), transform }
    }

    fn frames() -> Frames {
        let mut robot = fixtures::robot(0.32, [0.5, 0.5, 2.0], Vec::new());
        robot.root_link = "chassis".to_owned();
        // The root link is 0.1 m ahead of the axle.
        robot.base_from_root = Isometry3::translation(0.1, 0.0, 0.05);
        Frames::new(&robot, "map")
    }

    fn near(found: Option<(f64, Pose2)>, time: f64, [x, y, yaw]: [f64; 3]) {
        let (stamp, pose) = found.expect("a pose");
        let off = pose.distance(Pose2::new(x, y, yaw)).max((pose.yaw - yaw).abs());
        assert!(stamp == time && off < 1e-12, "{stamp} {pose:?}");
    }

    #[test]
    fn odometry_of_the_root_link_becomes_that_of_the_base() {
        let message = |child: &str, pose| Odometry {
            header: at(3, "odom"),
            child_frame_id: child.to_owned(),
            pose,
            pose_covariance: [[0.0; 6]; 6],
            twist: [0.0; 6],
            twist_covariance: [[0.0; 6]; 6],
        };
        let quarter = std::f64::consts::FRAC_PI_2;
        near(frames().odometry(&message("base_link", flat(1.0, 2.0, quarter))), 3.5, [1.0, 2.0, quarter]);
        near(frames().odometry(&message("chassis", flat(1.0, 2.0, quarter))), 3.5, [1.0, 1.9, quarter]);
        assert_eq!(frames().odometry(&message("base_link", [0.0; 7])), None, "a quaternion of no length");
        assert_eq!(frames().odometry(&message("base_link", flat(f64::NAN, 0.0, 0.0))), None);
    }

    #[test]
    fn transforms_are_chained_from_the_map_and_poses_come_when_the_lowest_moves() {
        let mut frames = frames();
        let mut tell = |fixed, transforms: Vec<TransformStamped>| frames.transforms(&Transforms { transforms }, fixed);
        assert_eq!(tell(true, vec![edge(0, "base_link", "chassis", flat(0.1, 0.0, 0.0))]), None);
        assert_eq!(tell(false, vec![edge(1, "odom", "base_link", flat(1.0, 0.0, 0.0))]), None, "not yet in the map");
        assert_eq!(tell(false, vec![edge(2, "map", "odom", flat(0.0, 5.0, 0.0))]), None, "the base has not moved");
        near(tell(false, vec![edge(3, "odom", "base_link", flat(2.0, 0.0, 0.0))]), 3.5, [2.0, 5.0, 0.0]);
        let both = vec![edge(4, "map", "odom", flat(1.0, 5.0, 0.0)), edge(5, "odom", "base_link", flat(2.0, 1.0, 0.5))];
        near(tell(false, both), 5.5, [3.0, 6.0, 0.5]);
        assert_eq!(tell(false, vec![edge(6, "odom", "wheel", flat(2.0, 1.0, 0.5))]), None);
    }

    #[test]
    fn frames_that_go_round_are_no_pose() {
        let mut frames = frames();
        let round =
            vec![edge(1, "a", "base_link", flat(1.0, 0.0, 0.0)), edge(1, "base_link", "a", flat(1.0, 0.0, 0.0))];
        assert_eq!(frames.transforms(&Transforms { transforms: round }, false), None);
    }
}
