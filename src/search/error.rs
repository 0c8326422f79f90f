//! Why there is no path, for people and for report.json.

use super::{Contact, Query};
use crate::diag::{Describe, Diagnostic};
use crate::geom::{Pose2, wrap_angle};

/// Why there is no path.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SearchError {
    /// The start does not keep the clearance.
    #[error("the start is {0}")]
    StartBlocked(Box<Blocked>),
    /// The goal does not keep the clearance.
    #[error("the goal is {0}")]
    GoalBlocked(Box<Blocked>),
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
    #[error("no way to the goal: {0}")]
    Exhausted(Box<Absence>),
    /// The search's route does not pass the final check: it is free by less than the checks' tolerance.
    #[error("the way found keeps the clearance by less than the checks' own tolerance ({expanded} states searched)")]
    Marginal {
        /// States expanded.
        expanded: usize,
    },
    /// The base alone gets there; with what moves on it no way was found among the postures that were sampled.
    #[error(
        "no way to the goal was found with {postures} sampled postures of the joints, which does not prove that there is none{}",
        too_tight(tightest.as_deref())
    )]
    Sampled {
        /// Postures in the roadmap.
        postures: usize,
        /// Where the robot gets stuck on the way that a thinner one takes.
        tightest: Option<Box<Tightest>>,
    },
    /// The same of a goal that is a region.
    #[error("{error}; the goal is any place within {within} m of ({x:.3}, {y:.3})")]
    OfRegion {
        /// m.
        x: f64,
        /// m.
        y: f64,
        /// m.
        within: f64,
        /// What is wrong.
        error: Box<SearchError>,
    },
    /// Out of memory that the search allows itself.
    #[error("gave up after {labels} partial paths: neither a way was found nor its absence proven")]
    Limit {
        /// Labels made.
        labels: usize,
    },
}

/// What is in the way of a pose that is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Blocked {
    /// With what, in the heading and posture that are blocked least among those that would do.
    pub contact: Contact,
    /// Asked for, m.
    pub clearance: f64,
    /// Name and value of each joint that may be chosen, as in `contact`.
    pub posture: Vec<(String, f64)>,
    /// The nearest free pose within a metre.
    pub nearest: Option<Pose2>,
}

/// What is known of a way that does not exist.
#[derive(Debug, Clone, PartialEq)]
pub struct Absence {
    /// States expanded; none where already the base's disc does not get through, or nothing leaves the start.
    pub expanded: usize,
    /// The reached pose nearest to the goal; where no state was expanded, the position that the base's disc reaches.
    pub closest: Pose2,
    /// From there to the goal, m.
    pub to_goal: f64,
    /// `start` or `goal`, where it is the surroundings of one of them that are too narrow.
    pub at_fault: Option<&'static str>,
    /// The widest way in the plane: radius that fits at its narrowest place, and that place, m.
    pub narrowest: Option<(f64, [f64; 2])>,
    /// Radius of the base's core plus clearance: what would have to fit at least, m.
    pub core: f64,
    /// Where the robot gets stuck on the way that a thinner one takes.
    pub tightest: Option<Tightest>,
}

/// The tightest place of the best way that was found for a thinner robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Tightest {
    /// Of the base.
    pub pose: Pose2,
    /// Name and value of each joint.
    pub posture: Vec<(String, f64)>,
    /// The nearest obstacle of the real robot there.
    pub contact: Contact,
    /// Asked for, m.
    pub clearance: f64,
}

impl Tightest {
    /// How much more room is asked for than there is, m.
    pub fn missing(&self) -> f64 {
        self.clearance - self.contact.clearance
    }
}

impl std::fmt::Display for Blocked {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kind = if self.contact.clearance <= 0.0 { "in collision" } else { "too close" };
        let best = if self.posture.is_empty() { "" } else { "even " };
        let at = if self.posture.is_empty() { String::new() } else { format!("{best}with {}, ", list(&self.posture)) };
        write!(f, "{kind}: {at}{}", room(&self.contact, self.clearance))
    }
}

impl std::fmt::Display for Absence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let reached = self.narrowest.is_none_or(|(radius, _)| radius >= self.core);
        if self.expanded > 0 {
            write!(
                f,
                "all {} states that can be reached on the lattice (5 cm, 5 degrees, 64 values of a joint) were searched",
                self.expanded
            )?;
        } else if reached {
            f.write_str("the robot cannot leave its start by any move of the lattice (5 cm, 5 degrees)")?;
        } else {
            f.write_str("not even a disc as wide as the base gets there")?;
        }
        match self.narrowest {
            Some((radius, _)) if radius <= 1e-3 => f.write_str("; the goal is closed off even for a point")?,
            Some((radius, [x, y])) if !reached => write!(
                f,
                "; the widest way there narrows to {:.2} m about ({x:.2}, {y:.2}), the base needs {:.2} m",
                2.0 * radius,
                2.0 * self.core
            )?,
            _ => {}
        }
        if let Some(end) = self.at_fault {
            write!(f, "; it is the {end} that is shut in")?;
        }
        let Pose2 { x, y, .. } = self.closest;
        let who =
            if self.expanded > 0 || reached { "the closest pose reached is" } else { "the base gets no closer than" };
        write!(f, "; {who} ({x:.2}, {y:.2}), {:.2} m from the goal", self.to_goal)?;
        f.write_str(&too_tight(self.tightest.as_ref()))
    }
}

/// Where the best way is too tight, as the end of a sentence.
fn too_tight(tightest: Option<&Tightest>) -> String {
    let Some(tight) = tightest else { return String::new() };
    let Pose2 { x, y, yaw } = tight.pose;
    let posture = if tight.posture.is_empty() { String::new() } else { format!(", {}", list(&tight.posture)) };
    let heading = wrap_angle(yaw).to_degrees();
    let room = room(&tight.contact, tight.clearance);
    format!("; the best way is too tight at ({x:.2}, {y:.2}), heading {heading:.0} degrees{posture}: {room}")
}

/// Joints with their values, as in a mission file.
fn list(posture: &[(String, f64)]) -> String {
    posture.iter().map(|(name, value)| format!("`{name}` {value:.2}")).collect::<Vec<_>>().join(", ")
}

/// What room there is, and what is missing.
fn room(contact: &Contact, clearance: f64) -> String {
    let with = match contact.obstacle {
        Some(b) => format!(
            "the obstacle at x {:.2}..{:.2}, y {:.2}..{:.2}, z {:.2}..{:.2} m",
            b.min[0], b.max[0], b.min[1], b.max[1], b.min[2], b.max[2]
        ),
        None => "the map's edge".to_owned(),
    };
    let (link, missing) = (&contact.link, 100.0 * (clearance - contact.clearance));
    if contact.clearance <= 0.0 {
        format!("link `{link}` is {:.3} m deep in {with}, {missing:.1} cm are missing", -contact.clearance)
    } else {
        let own = contact.clearance;
        format!("link `{link}` has {own:.3} m to {with}, {clearance} m are asked for, {missing:.1} cm are missing")
    }
}

impl SearchError {
    /// Says of an error which region the goal is, where it is one.
    pub(super) fn of_goal(self, query: &Query) -> Self {
        let Query { goal, goal_within: within, .. } = *query;
        if within == 0.0 || matches!(self, Self::StartBlocked(_)) {
            return self;
        }
        Self::OfRegion { x: goal.x, y: goal.y, within, error: Box::new(self) }
    }

    /// Whether it is the start, not the goal or the way between, that a person should look at.
    pub fn is_about_start(&self) -> bool {
        match self {
            Self::StartBlocked(_) | Self::OffMap { which: "start", .. } => true,
            Self::Exhausted(absence) => absence.at_fault == Some("start"),
            Self::OfRegion { error, .. } => error.is_about_start(),
            _ => false,
        }
    }
}

impl Describe for SearchError {
    fn diagnostic(&self) -> Diagnostic {
        match self {
            Self::StartBlocked(blocked) => self.of_blocked("search/start-blocked", blocked),
            Self::GoalBlocked(blocked) => self.of_blocked("search/goal-blocked", blocked),
            Self::OffMap { which, x, y, .. } => Diagnostic::failure("search/off-map", self)
                .hint("poses are in the map's frame, metres; the search stays within the map's rectangle, also with `unknown: free`")
                .number("pose", *which)
                .number("x_m", *x)
                .number("y_m", *y),
            Self::Exhausted(absence) => self.of_absence(absence),
            Self::Marginal { expanded } => Diagnostic::failure("search/marginal", self)
                .hint("lower `clearance_m` by a millimetre")
                .number("expanded", *expanded),
            Self::Sampled { postures, tightest } => {
                let out = Diagnostic::failure("search/no-posture", self)
                    .hint("free the goal's joints or heading, give joint values that keep farther from obstacles, or lower `clearance_m`")
                    .number("postures", *postures);
                with_tightest(out, tightest.as_deref())
            }
            Self::OfRegion { error, within, .. } => {
                let mut out = error.diagnostic().number("goal_within_m", *within);
                out.message = self.to_string();
                out
            }
            Self::Limit { labels } => Diagnostic::failure("search/limit", self)
                .hint("use a coarser map or split the mission")
                .number("labels", *labels),
        }
    }
}

impl SearchError {
    fn of_blocked(&self, code: &'static str, blocked: &Blocked) -> Diagnostic {
        let Blocked { contact, clearance, posture, nearest } = blocked;
        let hint = match nearest {
            Some(pose) => format!(
                "the nearest free pose is x_m: {:.2}, y_m: {:.2}, yaw: {:.0}deg; or change the joints there, or lower `clearance_m`",
                pose.x,
                pose.y,
                wrap_angle(pose.yaw).to_degrees()
            ),
            None => "no pose within a metre is free: move it farther, change the joints there, or lower `clearance_m`"
                .into(),
        };
        let mut out = Diagnostic::failure(code, self)
            .hint(hint)
            .number("link", contact.link.clone())
            .number("clearance_m", contact.clearance)
            .number("clearance_required_m", *clearance)
            .number("missing_m", clearance - contact.clearance);
        if !posture.is_empty() {
            out = out.number("posture", values(posture));
        }
        if let Some(pose) = nearest {
            out = out
                .number("nearest_free_x_m", pose.x)
                .number("nearest_free_y_m", pose.y)
                .number("nearest_free_yaw_rad", pose.yaw);
        }
        out
    }

    fn of_absence(&self, absence: &Absence) -> Diagnostic {
        let Absence { expanded, closest, to_goal, at_fault, narrowest, core, tightest } = absence;
        let mut out = Diagnostic::failure("search/no-way", self)
            .hint("lower `clearance_m`, allow `reverse: true`, free the goal's heading or joints, or look at the map there")
            .number("expanded", *expanded)
            .number("closest_x_m", closest.x)
            .number("closest_y_m", closest.y)
            .number("closest_yaw_rad", closest.yaw)
            .number("closest_to_goal_m", *to_goal);
        if let Some(end) = at_fault {
            out = out.number("at_fault", *end);
        }
        if let Some((radius, [x, y])) = narrowest {
            out = out
                .number("narrowest_gap_m", 2.0 * radius.max(0.0))
                .number("narrowest_gap_x_m", *x)
                .number("narrowest_gap_y_m", *y)
                .number("least_gap_needed_m", 2.0 * core);
        }
        with_tightest(out, tightest.as_ref())
    }
}

fn with_tightest(out: Diagnostic, tightest: Option<&Tightest>) -> Diagnostic {
    let Some(tight) = tightest else { return out };
    out.number("tightest_x_m", tight.pose.x)
        .number("tightest_y_m", tight.pose.y)
        .number("tightest_yaw_rad", wrap_angle(tight.pose.yaw))
        .number("tightest_posture", values(&tight.posture))
        .number("tightest_link", tight.contact.link.clone())
        .number("tightest_clearance_m", tight.contact.clearance)
        .number("missing_m", tight.missing())
}

/// Joints with their values, for report.json.
fn values(posture: &[(String, f64)]) -> serde_json::Value {
    posture.iter().map(|(name, value)| (name.clone(), serde_json::Value::from(*value))).collect()
}
