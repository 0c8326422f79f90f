//! The keys of a mission file.

use super::{Parameterisation, Sampling, TimeLaw};
use crate::diag::shape::{Bounds, Choice, Field, LARGE, Shape};

pub(super) const METRES: Shape = Shape::Number(Bounds::any("m"));
pub(super) const POINT_IN_SPACE: Shape =
    Shape::List { item: &METRES, count: (3, 3), form: "[x, y, z] in metres: 3 numbers" };
/// Shorter than 0.1 ms no controller holds a command, and the table would not fit in memory.
const SAMPLING_TIME: Shape = Shape::Number(Bounds::between(1e-4, 10.0, "s"));

/// The keys of a mission file.
pub(super) static MISSION: [Field; 15] = [
    Field::required(
        "robot",
        Shape::Text,
        "../robots/scr_db/robot.yaml",
        "the robot: a robot.yaml, or a .urdf alone; relative to the mission",
    ),
    Field::optional(
        "map",
        Shape::Table(&MAP),
        "{file: ../maps/arch_bridges.pcd}",
        "where the obstacles are; may be left out only with a given `path`",
    ),
    Field::optional(
        "start",
        Shape::Table(&START),
        "{x_m: 0.5, y_m: 0.5, yaw: 0deg}",
        "where the robot stands; a joint left out is the compiler's choice",
    ),
    Field::optional(
        "goal",
        Shape::Table(&GOAL),
        "{x_m: 9.0, y_m: 8.0, yaw: 90deg}",
        "where it must come to rest; yaw or joints left out are the compiler's choice",
    ),
    Field::optional(
        "via",
        Shape::List { item: &VIA, count: (1, 1000), form: "a list of places `{x_m: ..., y_m: ...}`, at least one" },
        "[{x_m: 4.0, y_m: 4.0}]",
        "places to stop at on the way, in order; yaw or joints left out are the compiler's choice",
    ),
    Field::optional(
        "clearance_m",
        Shape::Number(Bounds::between(0.0, LARGE, "m")),
        "0.05",
        "distance to every obstacle that the certificate must prove, metres; default 0.05",
    ),
    Field::optional(
        "sampling_time_s",
        SAMPLING_TIME,
        "0.1",
        "seconds for which the robot holds each command; default 0.1",
    ),
    Field::optional(
        "sampling",
        Shape::Choice(&SAMPLING),
        "tracked",
        "how wheel speeds become held commands; default tracked: their replay passes the planned positions",
    ),
    Field::optional(
        "time_law",
        Shape::Choice(&TIME_LAW),
        "auto",
        "how the path is timed; default auto: the fastest that keeps every limit",
    ),
    Field::optional("reverse", Shape::Flag, "true", "whether the robot may drive backwards; default false"),
    Field::optional(
        "parameterisation",
        Shape::Choice(&PARAMETERISATION),
        "arc_length",
        match Parameterisation::DEFAULT {
            Parameterisation::Flat => {
                "what is planned as polynomials in time: positions (flat, default), or heading and arc length"
            }
            Parameterisation::ArcLength => {
                "what is planned as polynomials in time: positions (flat), or heading and arc length (arc_length, default)"
            }
        },
    ),
    Field::optional(
        "path_error",
        Shape::Table(&PATH_ERROR),
        "{sampling_times_s: [0.01, 0.1]}",
        "the report of path error against sampling time",
    ),
    Field::optional(
        "limits",
        Shape::Table(&super::limits::FIELDS),
        "{wheel: {acceleration_mps2: 0.2}}",
        "limits that win over the robot's, key by key",
    ),
    Field::optional(
        "tolerance",
        Shape::Table(&super::tolerance::FIELDS),
        "{wheel_radius: 0.2%, wheel_difference: 0.1%, track: 1%, latency_s: 0.02, start_m: 0.01, start_rad: 0.01}",
        "how far the real robot may be off: clearance is then proven for every such robot; wins over the robot's, key by key",
    ),
    Field::optional("path", Shape::Table(&PATH), "{file: path.csv}", "a given path instead of `map` and `goal`"),
];

static MAP: [Field; 8] = [
    Field::required(
        "file",
        Shape::Text,
        "../maps/arch_bridges.pcd",
        "the map: .pcd, .ply, .las, .xyz, .csv, .npy, .bt, .ot, or a map_server .yaml; relative to the mission",
    ),
    Field::optional(
        "resolution_m",
        Shape::Number(Bounds::positive("m")),
        "0.05",
        "cell size of point clouds, metres; default 0.05; grids bring their own, octrees may be covered by others",
    ),
    Field::optional(
        "height_m",
        Shape::List { item: &METRES, count: (2, 2), form: "[floor, ceiling] in metres: 2 numbers" },
        "[0.02, 1.0]",
        "slab that holds obstacles, metres; default: 0.02 to the top of the robot",
    ),
    Field::optional(
        "unknown",
        Shape::Choice(&UNKNOWN),
        "occupied",
        "what space counts as that was never seen; default occupied",
    ),
    Field::optional("origin_m", POINT_IN_SPACE, "[0, 0, 0]", "lower corner of a .npy grid, metres"),
    Field::optional(
        "keep_out",
        Shape::List { item: &super::solids::KEEP_OUT, count: (0, 1000), form: "a list of areas `{polygon_m: [...]}`" },
        "[{polygon_m: [[2, 1], [3, 1], [3, 2]]}]",
        "areas that count as obstacles, the whole height or `height_m` of it",
    ),
    Field::optional(
        "boxes",
        Shape::List {
            item: &super::solids::BOX,
            count: (0, 10_000),
            form: "a list of boxes `{min_m: ..., max_m: ...}`",
        },
        "[{min_m: [2, 1, 0], max_m: [3, 2, 0.5]}]",
        "boxes that count as obstacles beside those of the file; `height_m` does not cut them",
    ),
    Field::optional(
        "speed_zones",
        Shape::List {
            item: &super::zones::ZONE,
            count: (0, 1000),
            form: "a list of areas `{polygon_m: ..., speed_mps: ...}`",
        },
        "[{polygon_m: [[2, 1], [3, 1], [3, 2]], speed_mps: 0.3}]",
        "areas in which the base drives no faster than their speed",
    ),
];

/// How far from a place will do: less than this is what every end may miss its place by.
const WITHIN: Field = Field::optional(
    "within_m",
    Shape::Number(Bounds::between(0.001, 1000.0, "m")),
    "0.3",
    "anywhere so near to that point will do, metres; left out: at the point, but for 1 mm",
);
const ANY_YAW: Shape = Shape::AngleOr(Bounds::any("rad"), "any");

/// How far a link may be from its place where the mission does not say, m.
pub(super) const LINK_WITHIN: f64 = 0.01;
static ANGLE: Shape = Shape::Angle(Bounds::any("rad"));

/// Where a link must be.
pub(super) static LINK: [Field; 4] = [
    Field::required("name", Shape::Text, "tool0", "the link's name in the URDF"),
    Field::required(
        "position_m",
        POINT_IN_SPACE,
        "[3.0, 2.0, 0.8]",
        "where the origin of its frame must be, map frame, z over the ground; metres",
    ),
    Field::optional(
        "rpy",
        Shape::List { item: &ANGLE, count: (3, 3), form: "[roll, pitch, yaw]: 3 angles" },
        "[0, 90deg, 0]",
        "how its frame must be turned, roll, pitch, yaw against the map's axes, to 1 degree; left out: any way",
    ),
    Field::optional(
        "within_m",
        Shape::Number(Bounds::between(0.002, 1.0, "m")),
        "0.01",
        "how far from there will do, metres; default 0.01",
    ),
];

pub(super) static GOAL: [Field; 6] = [
    Field::optional("x_m", METRES, "9.0", "metres, map frame"),
    Field::optional("y_m", METRES, "8.0", "metres, map frame"),
    WITHIN,
    Field::optional(
        "yaw",
        ANY_YAW,
        "90deg",
        "heading, radians or degrees, counter-clockwise from x; `any` or left out: any heading",
    ),
    Field::optional(
        "joints",
        Shape::Named(&Shape::Angle(Bounds::any("rad or m"))),
        "{blade: 90deg}",
        "joint positions by name: radians, metres or degrees; left out: any",
    ),
    Field::optional(
        "link",
        Shape::Table(&LINK),
        "{name: tool0, position_m: [3.0, 2.0, 0.8]}",
        "where a link must be, instead of x_m and y_m: base and joints are the compiler's choice, but for what yaw and joints say",
    ),
];

pub(super) static START: [Field; 5] = [
    Field::optional("x_m", METRES, "0.5", "metres, map frame"),
    Field::optional("y_m", METRES, "0.5", "metres, map frame"),
    Field::optional(
        "yaw",
        Shape::Angle(Bounds::any("rad")),
        "90deg",
        "heading, radians or degrees, counter-clockwise from x",
    ),
    Field::optional(
        "joints",
        Shape::Named(&Shape::Angle(Bounds::any("rad or m"))),
        "{blade: 90deg}",
        "joint positions by name: radians, metres or degrees",
    ),
    Field::optional(
        "file",
        Shape::Text,
        "../out/first/commands.csv",
        "begin where the motion of this commands.csv or .mcap ends, instead of a pose and joints; relative to the mission",
    ),
];

static VIA: Shape = Shape::Table(&STOP);
static STOP: [Field; 6] = [
    Field::required("x_m", METRES, "4.0", "metres, map frame"),
    Field::required("y_m", METRES, "4.0", "metres, map frame"),
    WITHIN,
    Field::optional(
        "yaw",
        ANY_YAW,
        "90deg",
        "heading, radians or degrees, counter-clockwise from x; `any` or left out: as it comes",
    ),
    Field::optional(
        "joints",
        Shape::Named(&Shape::Angle(Bounds::any("rad or m"))),
        "{blade: 90deg}",
        "joint positions by name: radians, metres or degrees; left out: as they come",
    ),
    Field::optional(
        "dwell_s",
        Shape::Number(Bounds::between(0.0, 86_400.0, "s")),
        "2.0",
        "how long to stand there at least, seconds; default 0",
    ),
];

static UNKNOWN: [Choice; 2] = [Choice::now("occupied"), Choice::now("free")];

static SAMPLING: [Choice; 3] = [Choice::now("tracked"), Choice::now("mean"), Choice::now("instant")];

static TIME_LAW: [Choice; 7] = [
    Choice::now("auto"),
    Choice::now("optimal"),
    Choice::now("wheel"),
    Choice::now("fixed_point"),
    Choice::now("eq5"),
    Choice::now("printed"),
    Choice::now("minco"),
];

static PARAMETERISATION: [Choice; 2] = [Choice::now("flat"), Choice::now("arc_length")];

static PATH_ERROR: [Field; 1] = [Field::required(
    "sampling_times_s",
    Shape::List { item: &SAMPLING_TIME, count: (1, 100), form: "a list of 1 to 100 sampling times in seconds" },
    "[0.01, 0.1]",
    "sampling times to report the path error for, seconds; default 0.01 to 0.5",
)];

pub(super) static POINT: Shape =
    Shape::List { item: &METRES, count: (2, 2), form: "a point [x, y] in metres: 2 numbers" };
static SEGMENT: Shape = Shape::List { item: &POINT, count: (4, 4), form: "a cubic segment of 4 control points [x, y]" };

pub(super) static PATH: [Field; 2] = [
    Field::optional(
        "bezier",
        Shape::List { item: &SEGMENT, count: (1, usize::MAX), form: "a list of cubic segments, at least one" },
        "[[[0, 0], [2, 0], [4, 2], [4, 4]]]",
        "cubic segments of four control points [x, y] in metres, each beginning where the last one ends",
    ),
    Field::optional(
        "file",
        Shape::Text,
        "path.csv",
        "a CSV with columns x_m, y_m[, joint.NAME.pos_rad|_m]; relative to the mission",
    ),
];

/// What the words of `sampling` stand for.
pub(super) static SAMPLING_LAWS: [(&str, Sampling); 3] =
    [("tracked", Sampling::Tracked), ("mean", Sampling::Mean), ("instant", Sampling::Instant)];

/// What the words of `time_law` stand for.
pub(super) static TIME_LAWS: [(&str, TimeLaw); 7] = [
    ("auto", TimeLaw::Auto),
    ("optimal", TimeLaw::Optimal),
    ("wheel", TimeLaw::Wheel),
    ("fixed_point", TimeLaw::FixedPoint),
    ("eq5", TimeLaw::Eq5),
    ("printed", TimeLaw::Printed),
    ("minco", TimeLaw::Minco),
];

/// What the words of `parameterisation` stand for.
pub(super) static PARAMETERISATIONS: [(&str, Parameterisation); 2] =
    [("flat", Parameterisation::Flat), ("arc_length", Parameterisation::ArcLength)];
