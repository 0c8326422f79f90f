//! The seven ROS 2 message types of a command file: definitions, RIHS01 hashes (the same from Humble to Jazzy) and how they
//! are offered. Facts of the interface; `std_msgs`, `geometry_msgs` and the rest define them.

use std::collections::BTreeMap;

/// A message type.
pub struct MessageType {
    /// `package/msg/Type`.
    pub name: &'static str,
    /// RIHS01, hexadecimal.
    hash: &'static str,
    /// Its own fields.
    fields: &'static str,
    /// The types that it uses, each once, in the order of first use.
    uses: &'static [(&'static str, &'static str)],
}

const TIME: (&str, &str) = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
const DURATION: (&str, &str) = ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n");
const HEADER: (&str, &str) = ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n");
const VECTOR: (&str, &str) = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");
const POINT: (&str, &str) = ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n");
const QUATERNION: (&str, &str) = ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n");

pub const TWIST_STAMPED: MessageType = MessageType {
    name: "geometry_msgs/msg/TwistStamped",
    hash: "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
    fields: "std_msgs/Header header\ngeometry_msgs/Twist twist\n",
    uses: &[
        HEADER,
        TIME,
        ("geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"),
        VECTOR,
    ],
};

pub const FLOAT64_MULTI_ARRAY: MessageType = MessageType {
    name: "std_msgs/msg/Float64MultiArray",
    hash: "1025ddc6b9552d191f89ef1a8d2f60f3d373e28b283d8891ddcc974e8c55397f",
    fields: "std_msgs/MultiArrayLayout layout\nfloat64[] data\n",
    uses: &[
        ("std_msgs/MultiArrayLayout", "std_msgs/MultiArrayDimension[] dim\nuint32 data_offset\n"),
        ("std_msgs/MultiArrayDimension", "string label\nuint32 size\nuint32 stride\n"),
    ],
};

pub const JOINT_TRAJECTORY: MessageType = MessageType {
    name: "trajectory_msgs/msg/JointTrajectory",
    hash: "179b33eba59d676f6d967ac71fe35e7ca2f64b2f3928f4a018cec115e213796e",
    fields: "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint[] points\n",
    uses: &[
        HEADER,
        TIME,
        (
            "trajectory_msgs/JointTrajectoryPoint",
            "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\n\
             builtin_interfaces/Duration time_from_start\n",
        ),
        DURATION,
    ],
};

pub const JOINT_STATE: MessageType = MessageType {
    name: "sensor_msgs/msg/JointState",
    hash: "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
    fields: "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
    uses: &[HEADER, TIME],
};

pub const TF_MESSAGE: MessageType = MessageType {
    name: "tf2_msgs/msg/TFMessage",
    hash: "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    fields: "geometry_msgs/TransformStamped[] transforms\n",
    uses: &[
        (
            "geometry_msgs/TransformStamped",
            "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
        ),
        HEADER,
        TIME,
        ("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"),
        VECTOR,
        QUATERNION,
    ],
};

pub const PATH: MessageType = MessageType {
    name: "nav_msgs/msg/Path",
    hash: "1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b",
    fields: "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n",
    uses: &[
        HEADER,
        TIME,
        ("geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"),
        ("geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"),
        POINT,
        QUATERNION,
    ],
};

pub const STRING: MessageType = MessageType {
    name: "std_msgs/msg/String",
    hash: "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    fields: "string data\n",
    uses: &[],
};

impl MessageType {
    /// As ROS 2 writes it: `RIHS01_` and the hash.
    pub fn type_hash(&self) -> String {
        format!("RIHS01_{}", self.hash)
    }

    /// Package and type, without `msg`.
    pub fn package_and_type(&self) -> (&'static str, &'static str) {
        self.name.split_once("/msg/").expect("every name here has it")
    }

    /// The definition followed by all that it uses, as `ros2msg` schemas have it.
    pub fn definition(&self) -> String {
        let mut text = self.fields.to_string();
        for (name, fields) in self.uses {
            text += &format!("{}\nMSG: {name}\n{fields}", "=".repeat(80));
        }
        text
    }
}

/// How a topic is offered. Both are reliable with a history of the last `depth` messages.
#[derive(Clone, Copy)]
pub enum Offer {
    /// For those who listen when it is sent.
    Volatile {
        /// Messages kept for a slow subscriber.
        depth: u32,
    },
    /// The last message also for those who come later (transient local).
    Latched,
}

/// A channel's metadata: quality of service and type hash.
pub fn channel_metadata(message: &MessageType, offer: Offer) -> BTreeMap<String, String> {
    // Numbers play from Humble to Rolling, words only from Jazzy on. history 1: keep last; reliability 1: reliable;
    // durability 1: transient local, 2: volatile; the longest duration there is: infinite.
    let (depth, durability) = match offer {
        Offer::Volatile { depth } => (depth, 2),
        Offer::Latched => (1, 1),
    };
    let infinite = "\n    sec: 9223372036\n    nsec: 854775807\n";
    let qos = format!(
        "- history: 1\n  depth: {depth}\n  reliability: 1\n  durability: {durability}\n  deadline:{infinite}  \
         lifespan:{infinite}  liveliness: 1\n  liveliness_lease_duration:{infinite}  \
         avoid_ros_namespace_conventions: false\n"
    );
    let hash = message.type_hash();
    [("offered_qos_profiles".to_string(), qos), ("topic_type_hash".to_string(), hash)].into()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [MessageType; 7] =
        [TWIST_STAMPED, FLOAT64_MULTI_ARRAY, JOINT_TRAJECTORY, JOINT_STATE, TF_MESSAGE, PATH, STRING];

    #[test]
    fn every_definition_brings_exactly_the_types_that_it_uses() {
        for message in ALL {
            let text = message.definition();
            let mut used: Vec<&str> = text
                .lines()
                .filter(|l| !l.starts_with("MSG:"))
                .filter_map(|l| l.split([' ', '[']).next())
                .filter(|kind| kind.contains('/'))
                .collect();
            used.sort_unstable();
            used.dedup();
            let mut brought: Vec<&str> = message.uses.iter().map(|(name, _)| *name).collect();
            brought.sort_unstable();
            assert_eq!(used, brought, "{}", message.name);
        }
    }

    #[test]
    fn hashes_are_sha256_in_lower_case_and_all_different() {
        let mut hashes = ALL.map(|m| m.hash);
        hashes.sort_unstable();
        assert!(hashes.windows(2).all(|w| w[0] != w[1]));
        assert!(hashes.iter().all(|h| h.len() == 64 && h.chars().all(|c| matches!(c, '0'..='9' | 'a'..='f'))));
    }

    #[test]
    fn the_offer_is_one_yaml_mapping_of_numbers() {
        let text = &channel_metadata(&STRING, Offer::Latched)["offered_qos_profiles"];
        insta::assert_snapshot!(text, @"
        - history: 1
          depth: 1
          reliability: 1
          durability: 1
          deadline:
            sec: 9223372036
            nsec: 854775807
          lifespan:
            sec: 9223372036
            nsec: 854775807
          liveliness: 1
          liveliness_lease_duration:
            sec: 9223372036
            nsec: 854775807
          avoid_ros_namespace_conventions: false
        ");
    }
}
