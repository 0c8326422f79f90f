//! A log from a ROS 2 bag in MCAP: wheel angles from joint states, poses from odometry, stamped poses or transforms.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use super::Log;
use crate::emit::cdr::{CdrError, Reader};
use crate::emit::mcap_read::{McapReadError, Recording};
use crate::robot::{BASE_FRAMES, DriveJoint, RobotModel};

/// Topics with poses that are looked for, and the static transforms that belong to the second.
const POSES: [&str; 2] = ["/odom", "/tf"];
const STATIC: &str = "/tf_static";

/// Where a bag has what.
#[derive(Debug, Clone, Copy)]
pub struct Topics<'a> {
    /// `sensor_msgs/msg/JointState` with the driving wheels.
    pub wheels: &'a str,
    /// `nav_msgs/msg/Odometry`, `geometry_msgs/msg/PoseStamped`, `PoseWithCovarianceStamped` or `tf2_msgs/msg/TFMessage`; `None`:
    /// `/odom` or `/tf`, whichever is there.
    pub poses: Option<&'a str>,
    /// The base's frame in transforms; `None`: the root link, `base_footprint` or `base_link`.
    pub base_frame: Option<&'a str>,
}

/// Why a bag is no log.
#[derive(Debug, thiserror::Error)]
pub enum BagError {
    /// Not MCAP, or damaged.
    #[error(transparent)]
    Container(#[from] McapReadError),
    /// A message that is not of its type.
    #[error("{topic}, message {index}: {error}")]
    Message {
        /// Which topic.
        topic: String,
        /// Which message, from 0.
        index: usize,
        /// What is wrong.
        error: CdrError,
    },
    /// No topic, or none of the joints.
    #[error("no message of `{topic}` has positions of the driving wheels {joints}")]
    NoWheels {
        /// Which topic.
        topic: String,
        /// Their names.
        joints: String,
    },
    /// Neither default topic is there.
    #[error("neither `{}` nor `{}` is in this bag", POSES[0], POSES[1])]
    NoPoses,
    /// Both are.
    #[error("poses are in `{}` and in `{}`", POSES[0], POSES[1])]
    Ambiguous,
    /// A topic without messages.
    #[error("no messages of `{0}` are in this bag")]
    Missing(String),
    /// A topic of something else.
    #[error("`{topic}` has `{kind}`, no poses")]
    Kind {
        /// Which topic.
        topic: String,
        /// Its type.
        kind: String,
    },
    /// No transform leads to the base.
    #[error("no transform of `{topic}` leads to `{frame}`; there are {known}")]
    NoFrame {
        /// Which topic.
        topic: String,
        /// The frame.
        frame: String,
        /// Frames that transforms lead to.
        known: String,
    },
}

impl BagError {
    /// What to do about it.
    pub fn hint(&self) -> Option<&'static str> {
        match self {
            Self::Container(_) | Self::Message { .. } => None,
            Self::NoWheels { .. } => Some("name the topic: --wheels TOPIC"),
            Self::NoPoses | Self::Missing(_) | Self::Kind { .. } => {
                Some("name a topic with Odometry, PoseStamped, PoseWithCovarianceStamped or TFMessage: --poses TOPIC")
            }
            Self::Ambiguous => {
                Some("name one, --poses /tf for example: the one that is not made of the wheels' angles")
            }
            Self::NoFrame { .. } => Some("name the base's frame: --base-frame FRAME"),
        }
    }
}

/// Stamps in ns, and what was then.
type Stamped<T> = Vec<(i64, T)>;

/// A log from a bag's bytes; `drive`: the joints of the left and the right driving wheels, of which the mean angle counts. Times are those of
/// the messages' headers, from the first one on; where a header has none, that of the recording.
///
/// # Errors
/// No MCAP; topics, joints or frames that are not there; messages that are not of their type.
pub fn read_mcap(
    bytes: &[u8],
    model: &RobotModel,
    drive: &[Vec<DriveJoint>; 2],
    topics: Topics<'_>,
) -> Result<Log, BagError> {
    let bag = Recording::read(bytes)?;
    let wheels = wheel_angles(&bag, topics.wheels, drive)?;
    let kinds: BTreeMap<String, String> =
        bag.topics().into_iter().filter(|t| t.messages > 0).map(|t| (t.name, t.kind)).collect();
    let topic = match topics.poses {
        Some(topic) => topic,
        None => match POSES.map(|topic| kinds.contains_key(topic)) {
            [true, false] => POSES[0],
            [false, true] => POSES[1],
            [false, false] => return Err(BagError::NoPoses),
            [true, true] => return Err(BagError::Ambiguous),
        },
    };
    let kind = kinds.get(topic).ok_or_else(|| BagError::Missing(topic.to_owned()))?;
    let poses = match kind.as_str() {
        "nav_msgs/msg/Odometry" => decoded(&bag, topic, odometry)?,
        "geometry_msgs/msg/PoseStamped" => decoded(&bag, topic, |r| pose_stamped(r, 0))?,
        "geometry_msgs/msg/PoseWithCovarianceStamped" => decoded(&bag, topic, |r| pose_stamped(r, 36))?,
        "tf2_msgs/msg/TFMessage" => transformed(&bag, topic, model, topics.base_frame)?,
        _ => return Err(BagError::Kind { topic: topic.to_owned(), kind: kind.clone() }),
    };
    let poses = poses.into_iter().map(|(at, (frame, pose))| (at, model.base_of(&frame, pose)));
    let origin = wheels.iter().map(|(at, _)| *at).min().unwrap_or_default();
    Ok(Log { wheels: in_order(wheels, origin), poses: in_order(poses.collect(), origin) })
}

/// By time in s since an origin, each time once.
fn in_order<T>(mut values: Stamped<T>, origin: i64) -> Vec<(f64, T)> {
    values.sort_by_key(|(at, _)| *at);
    values.dedup_by_key(|(at, _)| *at);
    values.into_iter().map(|(at, value)| (at.saturating_sub(origin) as f64 * 1e-9, value)).collect()
}

/// All messages of a topic, each with its header's stamp, or the recording's where that is zero.
fn decoded<T>(
    bag: &Recording,
    topic: &str,
    decode: impl Fn(&mut Reader<'_>) -> Result<(i64, T), CdrError>,
) -> Result<Stamped<T>, BagError> {
    let one = |(index, (logged, bytes)): (usize, (u64, &[u8]))| {
        let read = || {
            let mut reader = Reader::new(bytes)?;
            let (stamp, value) = decode(&mut reader)?;
            reader.finish()?;
            Ok((if stamp == 0 { logged as i64 } else { stamp }, value))
        };
        read().map_err(|error| BagError::Message { topic: topic.to_owned(), index, error })
    };
    bag.messages(topic).enumerate().map(one).collect()
}

fn wheel_angles(bag: &Recording, topic: &str, drive: &[Vec<DriveJoint>; 2]) -> Result<Stamped<[f64; 2]>, BagError> {
    let states = decoded(bag, topic, |r| {
        let (stamp, _) = header(r)?;
        let names = r.sequence(|r| r.string().map(str::to_owned))?;
        let positions = r.f64s()?;
        r.f64s()?;
        r.f64s()?;
        Ok((stamp, (names, positions)))
    })?;
    let mut wheels = Vec::new();
    for (at, (names, positions)) in states {
        // Joints may be published by several nodes, each its own.
        let angle = |joint: &DriveJoint| {
            let place = names.iter().position(|name| *name == joint.name)?;
            positions.get(place).filter(|v| v.is_finite()).map(|v| joint.forward * v)
        };
        let side = |joints: &[DriveJoint]| {
            let angles: Option<Vec<f64>> = joints.iter().map(angle).collect();
            angles.map(|angles| angles.iter().sum::<f64>() / angles.len() as f64)
        };
        wheels.extend(side(&drive[0]).zip(side(&drive[1])).map(|(left, right)| (at, [left, right])));
    }
    if wheels.is_empty() {
        let names: Vec<String> = drive.iter().flatten().map(|joint| format!("`{}`", joint.name)).collect();
        return Err(BagError::NoWheels { topic: topic.to_owned(), joints: names.join(", ") });
    }
    Ok(wheels)
}

/// Stamp (ns) and frame of a `std_msgs/Header`.
fn header(r: &mut Reader<'_>) -> Result<(i64, String), CdrError> {
    let (seconds, nanoseconds) = (r.i32()?, r.u32()?);
    Ok((i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds), r.string()?.to_owned()))
}

/// Position and quaternion, of a pose and of a transform alike. One of no length is no turn.
fn isometry(r: &mut Reader<'_>) -> Result<Isometry3<f64>, CdrError> {
    let mut v = [0.0; 7];
    for value in &mut v {
        *value = r.f64()?;
    }
    let turn = UnitQuaternion::try_new(Quaternion::new(v[6], v[3], v[4], v[5]), 1e-6).unwrap_or_default();
    Ok(Isometry3::from_parts(Translation3::new(v[0], v[1], v[2]), turn))
}

fn skip(r: &mut Reader<'_>, count: usize) -> Result<(), CdrError> {
    (0..count).try_for_each(|_| r.f64().map(|_| ()))
}

/// The frame that moves, and its pose.
type Placed = (String, Isometry3<f64>);

fn odometry(r: &mut Reader<'_>) -> Result<(i64, Placed), CdrError> {
    let (stamp, _) = header(r)?;
    let child = r.string()?.to_owned();
    let pose = isometry(r)?;
    skip(r, 36 + 6 + 36)?;
    Ok((stamp, (child, pose)))
}

/// A stamped pose with so many numbers behind it. What moves has no name.
fn pose_stamped(r: &mut Reader<'_>, behind: usize) -> Result<(i64, Placed), CdrError> {
    let (stamp, _) = header(r)?;
    let pose = isometry(r)?;
    skip(r, behind)?;
    Ok((stamp, (String::new(), pose)))
}

/// A transform: stamp (ns), parent, child and pose.
type Edge = (i64, String, String, Isometry3<f64>);

fn edges(r: &mut Reader<'_>) -> Result<(i64, Vec<Edge>), CdrError> {
    let edges = r.sequence(|r| {
        let (stamp, parent) = header(r)?;
        let child = r.string()?.to_owned();
        Ok((stamp, parent, child, isometry(r)?))
    })?;
    Ok((edges.first().map_or(0, |edge| edge.0), edges))
}

/// Poses of the base in the frame that no transform leads to, whenever the lowest moving one of the transforms between them comes.
fn transformed(
    bag: &Recording,
    topic: &str,
    model: &RobotModel,
    base_frame: Option<&str>,
) -> Result<Stamped<Placed>, BagError> {
    let fixed = decoded(bag, STATIC, edges)?;
    let moving = decoded(bag, topic, edges)?;
    let all = || fixed.iter().chain(&moving).flat_map(|(_, edges)| edges);
    let parents: BTreeMap<&str, &str> = all().map(|(_, parent, child, _)| (child.as_str(), parent.as_str())).collect();
    let moved: BTreeSet<&str> =
        moving.iter().flat_map(|(_, edges)| edges).map(|(_, _, child, _)| child.as_str()).collect();
    let known = |frame: &&str| parents.contains_key(frame);
    let no_frame = |frame: &str| BagError::NoFrame {
        topic: topic.to_owned(),
        frame: frame.to_owned(),
        known: moved.iter().copied().collect::<Vec<_>>().join(", "),
    };
    let wanted = base_frame.unwrap_or(&model.root_link);
    let base = match base_frame {
        Some(frame) => Some(frame).filter(known),
        None => [wanted].into_iter().chain(BASE_FRAMES).find(known),
    };
    let base = base.ok_or_else(|| no_frame(wanted))?;
    // From the base up, no farther than there are transforms: they may go round.
    let mut chain = vec![base];
    while let Some(parent) = chain.last().and_then(|frame| parents.get(frame)).filter(|_| chain.len() < parents.len()) {
        if !parents.contains_key(parent) {
            break;
        }
        chain.push(parent);
    }
    let lowest = *chain.iter().find(|frame| moved.contains(*frame)).ok_or_else(|| no_frame(base))?;
    let mut latest: BTreeMap<&str, Isometry3<f64>> =
        fixed.iter().flat_map(|(_, edges)| edges).map(|(_, _, child, pose)| (child.as_str(), *pose)).collect();
    let mut poses = Vec::new();
    for (at, edges) in &moving {
        latest.extend(edges.iter().map(|(_, _, child, pose)| (child.as_str(), *pose)));
        let Some((stamp, ..)) = edges.iter().find(|(_, _, child, _)| child == lowest) else { continue };
        let up = chain.iter().try_fold(Isometry3::identity(), |pose, frame| Some(latest.get(frame)? * pose));
        poses.extend(up.map(|pose| (if *stamp == 0 { *at } else { *stamp }, (base.to_owned(), pose))));
    }
    Ok(poses)
}

#[cfg(test)]
mod tests;
