//! Why there is no path, for people and for report.json.

use super::Contact;
use crate::diag::{Describe, Diagnostic};
use crate::geom::Pose2;

/// Why there is no path.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SearchError {
    /// The start does not keep the clearance.
    #[error("the start is {}", blocked(.contact, *.clearance))]
    StartBlocked {
        /// With what.
        contact: Contact,
        /// Asked for, m.
        clearance: f64,
    },
    /// The goal does not keep the clearance.
    #[error("the goal is {}", blocked(.contact, *.clearance))]
    GoalBlocked {
        /// With what.
        contact: Contact,
        /// Asked for, m.
        clearance: f64,
    },
    /// Start or goal lie beyond the map where that counts as an obstacle.
    #[error(
        "the {which} ({x:.3}, {y:.3}) lies outside the map, which spans x {:.3} to {:.3}, y {:.3} to {:.3} m",
        bounds[0], bounds[1], bounds[2], bounds[3]
    )]
    OffMap {
        /// `start` or `goal`.
        which: &'static str,
        /// m.
        x: f64,
        /// m.
        y: f64,
        /// x from, to, y from, to, m.
        bounds: [f64; 4],
    },
    /// Every state that can be reached was looked at.
    #[error("no way to the goal: {}{}", how_absent(*.expanded, .narrowest, *.core), narrowest_way(.narrowest, *.core))]
    Exhausted {
        /// States expanded.
        expanded: usize,
        /// The reached pose nearest to the goal.
        closest: Pose2,
        /// The widest way in the plane: radius that fits at its narrowest place, and that place, m.
        narrowest: Option<(f64, [f64; 2])>,
        /// Radius of the base's core plus clearance: what would have to fit at least, m.
        core: f64,
    },
    /// The search's route does not pass the final check: it is free by less than the checks' tolerance.
    #[error("the way found keeps the clearance by less than the checks' own tolerance ({expanded} states searched)")]
    Marginal {
        /// States expanded.
        expanded: usize,
    },
    /// Out of memory that the search allows itself.
    #[error("gave up after {labels} partial paths: neither a way was found nor its absence proven")]
    Limit {
        /// Labels made.
        labels: usize,
    },
}

fn blocked(contact: &Contact, clearance: f64) -> String {
    let with = match contact.obstacle {
        Some(b) => format!(
            "the obstacle at x {:.2}..{:.2}, y {:.2}..{:.2}, z {:.2}..{:.2} m",
            b.min[0], b.max[0], b.min[1], b.max[1], b.min[2], b.max[2]
        ),
        None => "the map's edge".to_owned(),
    };
    let link = &contact.link;
    if contact.clearance <= 0.0 {
        format!("in collision: link `{link}` is {:.3} m deep in {with}", -contact.clearance)
    } else {
        format!("too close: link `{link}` has {:.3} m to {with}, {clearance} m are asked for", contact.clearance)
    }
}

fn how_absent(expanded: usize, narrowest: &Option<(f64, [f64; 2])>, core: f64) -> String {
    if expanded == 0 && narrowest.is_some_and(|(radius, _)| radius < core) {
        "not even a disc as wide as the base gets there".to_owned()
    } else if expanded == 0 {
        "the robot cannot leave its start by any move of the lattice (5 cm, 5 degrees)".to_owned()
    } else {
        format!(
            "all {expanded} states that can be reached on the lattice (5 cm, 5 degrees, 64 values of a joint) were searched"
        )
    }
}

fn narrowest_way(narrowest: &Option<(f64, [f64; 2])>, core: f64) -> String {
    match narrowest {
        Some((radius, [x, y])) if *radius > 1e-3 => {
            format!(
                "; the widest way there narrows to {:.2} m about ({x:.2}, {y:.2}), the base needs {:.2} m",
                2.0 * radius,
                2.0 * core
            )
        }
        Some(_) => "; the goal is closed off even for a point".to_owned(),
        None => String::new(),
    }
}

impl Describe for SearchError {
    fn diagnostic(&self) -> Diagnostic {
        let contact = |code, c: &Contact, clearance: f64| {
            Diagnostic::failure(code, self)
                .hint("move the pose, change the joints there, or lower `clearance_m`")
                .number("link", c.link.clone())
                .number("clearance_m", c.clearance)
                .number("clearance_required_m", clearance)
        };
        match self {
            Self::StartBlocked { contact: c, clearance } => contact("search/start-blocked", c, *clearance),
            Self::GoalBlocked { contact: c, clearance } => contact("search/goal-blocked", c, *clearance),
            Self::OffMap { which, x, y, .. } => Diagnostic::failure("search/off-map", self)
                .hint("poses are in the map's frame, metres; the search stays within the map's rectangle, also with `unknown: free`")
                .number("pose", *which)
                .number("x_m", *x)
                .number("y_m", *y),
            Self::Exhausted { expanded, closest, narrowest, core } => {
                let mut d = Diagnostic::failure("search/no-way", self)
                    .hint("lower `clearance_m`, allow `reverse: true`, free the goal's heading or joints, or look at the map there")
                    .number("expanded", *expanded)
                    .number("closest_x_m", closest.x)
                    .number("closest_y_m", closest.y)
                    .number("closest_yaw_rad", closest.yaw);
                if let Some((radius, [x, y])) = narrowest {
                    d = d
                        .number("narrowest_gap_m", 2.0 * radius.max(0.0))
                        .number("narrowest_gap_x_m", *x)
                        .number("narrowest_gap_y_m", *y)
                        .number("least_gap_needed_m", 2.0 * core);
                }
                d
            }
            Self::Marginal { expanded } => Diagnostic::failure("search/marginal", self)
                .hint("lower `clearance_m` by a millimetre")
                .number("expanded", *expanded),
            Self::Limit { labels } => Diagnostic::failure("search/limit", self)
                .hint("use a coarser map or split the mission")
                .number("labels", *labels),
        }
    }
}
