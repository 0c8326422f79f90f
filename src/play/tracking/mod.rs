//! Playing with feedback: poses in, commands out that keep the robot on the file's path. [`Tracker::step`] is a pure function of what was
//! known before, the time and a pose; whoever closes the loop (a robot, a simulator) keeps the [`State`] between two calls.
//!
//! | file | what |
//! |---|---|
//! | `law.rs` | the tracking law, its proof and the delay it bears |
//! | `observer.rs` | where the robot is, from noisy poses and the commands in between |
//! | `limiter.rs` | held speeds within the limits of wheels and joints |
//! | `clock.rs` | the reference's clock: held back where the robot lags |
//! | `tube.rs` | how far from the path the robot may be |

mod clock;
pub mod law;
pub mod limiter;
pub mod observer;
pub mod tube;

use std::collections::VecDeque;

use crate::command::CommandRow;
use crate::command::limits::differences;
use crate::geom::Pose2;
use crate::math::real;
use crate::play::motion::Motion;
use crate::play::pace::Limits;
use crate::robot::RobotModel;
use law::{Error, Gains, Twist};
use limiter::{Bounds, Held};
use observer::{Drive, Executed, Observer, Shares};
use tube::Tube;

/// Longest time from command to command for which limits of acceleration give room, s; longer ones count as this.
const LONGEST: f64 = 0.1;
/// What is left at the end of the path is not taken away within these: m, rad.
const AT_REST: (f64, f64) = (0.002, 0.003);
/// For how long what is left must be that small, and how long after the end of the path it may take, s.
const CALM: (f64, f64) = (0.3, 4.0);
/// How fast joints take back what they lag, 1/s.
const JOINT_GAIN: f64 = 4.0;
/// Shares of the actuators' limits (speed, acceleration, jerk) that the reference leaves to corrections: where the file needs more, its time goes
/// slower.
const RESERVE: [f64; 3] = [0.05, 0.2, 0.4];
/// What joints are off at the end that is not taken away any more, rad or m.
const JOINT_AT_REST: f64 = 1e-5;
/// Speeds below this are none, rad/s or m/s.
const NONE: f64 = 1e-9;
/// Coordinates beyond this are no pose, m and rad.
const FARTHEST: f64 = 1e6;

/// What the robot at the other end is like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// From a command to its execution, s; predicted.
    pub latency: f64,
    /// Without a pose for so long the robot stops, s.
    pub lost_after: f64,
    /// Whether the base may drive backwards where the plan does not.
    pub reverse: bool,
    /// Standard deviation of the poses' coordinates, m.
    pub noise: f64,
    /// Standard deviation of their headings, rad.
    pub turn_noise: f64,
}

impl Default for Options {
    /// No latency, half a second, not backwards, 5 mm and half a degree.
    fn default() -> Self {
        Self { latency: 0.0, lost_after: 0.5, reverse: false, noise: 0.005, turn_noise: 0.5f64.to_radians() }
    }
}

/// A pose as it was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Sighting {
    /// When it was so, s, on the clock of the steps.
    pub time: f64,
    /// In the map frame.
    pub pose: Pose2,
    /// Values of the moving joints, where known; may be empty.
    pub joints: Vec<Option<f64>>,
}

/// What the robot is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Phase {
    /// Follows the path at its pace.
    Tracking,
    /// Follows it while the file's time is held back: the robot lags; or no pose has come yet.
    Waiting,
    /// Slows down to rest.
    Stopping(Why),
    /// At rest, before the end.
    Stopped(Why),
    /// At rest at the end.
    Done,
}

/// Why a motion was given up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Why {
    /// The robot left the room around its path, at this time of the motion, s.
    Left(f64),
    /// No pose that could be believed for so long, s.
    Lost(f64),
    /// It was asked for.
    Asked,
}

/// A pose that cannot be used; nothing has changed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Refused {
    /// NaN, infinite, or beyond all maps.
    #[error("the pose has a coordinate that is no number or beyond 1e6")]
    NoNumber,
    /// The time of a step is not after the one before.
    #[error("time does not go on: {now} s after {before} s")]
    Time {
        /// Of this step, s.
        now: f64,
        /// Of the one before, s.
        before: f64,
    },
    /// The pose is older than one that came before, or from the future.
    #[error("the pose of {at} s is not between {after} s and now")]
    Order {
        /// Its time, s.
        at: f64,
        /// Of the pose before, s.
        after: f64,
    },
}

/// All that is known between two steps.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Of the last step, s.
    time: Option<f64>,
    /// Where the reference is, s of the motion.
    path_time: f64,
    /// How fast its time goes; 1: as planned.
    pace: f64,
    /// How fast that changes, 1/s.
    pace_rate: f64,
    /// Of each actuator: left wheel, right wheel, joints.
    held: Vec<Held>,
    /// Speeds of the reference at the last step, as the wheels are believed to be.
    planned: [f64; 2],
    /// Of the joints, as commanded.
    joints: Vec<f64>,
    /// Commands that the observer may still need.
    history: VecDeque<Executed>,
    observer: Option<Observer>,
    /// Time of the last pose that was believed, s.
    seen: f64,
    phase: Phase,
    /// When the path ended, and since when what is left is small, s.
    ended: Option<f64>,
    calm: Option<f64>,
}

/// What to do now, and what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// What the robot is doing.
    pub phase: Phase,
    /// To be held until the next: wheels, joints; its pose is the reference's.
    pub row: CommandRow,
    /// That the wheels make, as the file has them: m/s, rad/s.
    pub twist: (f64, f64),
    /// Where the reference is, s of the motion.
    pub path_time: f64,
    /// How fast its time goes.
    pub pace: f64,
    /// Where the reference is from the robot, when this command begins to be executed.
    pub error: Error,
    /// Where the robot is then, as far as known.
    pub estimate: Option<Pose2>,
    /// How its drive differs from the file's, as far as known.
    pub shares: Shares,
}

/// A motion to be followed.
#[derive(Debug, Clone)]
pub struct Tracker<'a> {
    motion: &'a Motion,
    drive: Drive,
    bounds: Vec<Bounds>,
    /// Least and greatest value of each joint.
    ranges: Vec<[f64; 2]>,
    /// Of the base: speed, turn rate.
    base: [f64; 2],
    gains: Gains,
    /// The pace that leaves the reserve.
    fastest: f64,
    tube: &'a Tube,
    options: Options,
}

impl<'a> Tracker<'a> {
    /// A tracker of a motion by a robot with these limits, within a room.
    pub fn new(motion: &'a Motion, robot: &RobotModel, limits: &Limits, tube: &'a Tube, options: Options) -> Self {
        let table = motion.table();
        let twists = (0..table.rows.len()).map(|k| table.twist(k));
        let peak = twists.fold([robot.base.speed, robot.base.angular_speed], |[v, w], (speed, rate)| {
            [v.max(speed.abs()), w.max(rate.abs())]
        });
        let hold = table.sampling_time;
        let bounds = limits.per_second(hold);
        let rows = table.rows.len() as isize;
        let fastest = bounds.iter().enumerate().map(|(actuator, limits)| {
            let peaks = differences((0..rows).map(|k| motion.speed(actuator, k)), hold);
            let pace = |order: usize| {
                real::powf((1.0 - RESERVE[order]) * limits[order] / peaks[order], 1.0 / (order + 1) as f64)
            };
            pace(0).min(pace(1)).min(pace(2))
        });
        let fastest = fastest.fold(1.0, f64::min);
        let radii = table.wheel_radii.sides();
        let reserve = |order: usize| RESERVE[order] * (radii[0] * bounds[0][order]).min(radii[1] * bounds[1][order]);
        Self {
            gains: Gains::within(reserve(1), reserve(2)),
            fastest,
            motion,
            drive: Drive {
                wheel_radii: radii,
                track_width: table.track_width,
                noise: options.noise,
                turn_noise: options.turn_noise,
            },
            bounds: bounds
                .into_iter()
                .map(|[speed, acceleration, jerk]| Bounds { speed, acceleration, jerk })
                .collect(),
            ranges: robot.joints.iter().map(|joint| [joint.lower, joint.upper]).collect(),
            base: peak,
            tube,
            options,
        }
    }

    /// At rest at the beginning, before any pose.
    pub fn begin(&self) -> State {
        let first = self.motion.table().rows.first();
        State {
            time: None,
            path_time: 0.0,
            pace: 0.0,
            pace_rate: 0.0,
            held: vec![Held::default(); self.motion.actuators()],
            planned: [0.0; 2],
            joints: first.map_or(Vec::new(), |row| row.joint_positions.clone()),
            history: VecDeque::new(),
            observer: None,
            seen: f64::NEG_INFINITY,
            phase: Phase::Waiting,
            ended: None,
            calm: None,
        }
    }

    /// The same state, asked to slow down to rest.
    pub fn asked_to_stop(&self, state: &State) -> State {
        let mut next = state.clone();
        next.give_up(Why::Asked);
        next
    }

    /// The command of time `now` (s, on any clock that goes on), and the state behind it. `seen`: a pose that has come since the last step.
    ///
    /// # Errors
    /// Time or pose cannot be used. The state stays as it was: go on without the pose.
    pub fn step(&self, state: &State, now: f64, seen: Option<&Sighting>) -> Result<(State, Command), Refused> {
        let before = state.time.unwrap_or(f64::NEG_INFINITY);
        if !(now.is_finite() && now > before) {
            return Err(Refused::Time { now, before });
        }
        if let Some(seen) = seen {
            check(seen, now, state)?;
        }
        let mut next = state.clone();
        next.time = Some(now);
        let hold = self.motion.table().sampling_time;
        let passed = state.time.map_or(hold, |before| now - before);
        let time = passed.min(LONGEST.max(hold));
        if state.time.is_some() {
            next.path_time = (next.path_time + next.pace * passed).min(self.duration());
            next.joints.iter_mut().zip(&next.held[2..]).for_each(|(value, held)| *value += held.speed * passed);
        }
        self.look(&mut next, now, seen);

        let reference = self.motion.pose(next.path_time / hold);
        let executed = now + self.options.latency;
        let estimate = next.observer.as_ref().map(|o| o.driven(&self.drive, &next.history, executed));
        let (error, shares) = match &estimate {
            Some(estimate) => (law::error(reference, estimate.pose()), estimate.shares()),
            None => Default::default(),
        };
        if let (Some(estimate), true) = (&estimate, next.moves()) {
            let filled = self.tube.filled(self.motion, next.path_time, estimate.pose());
            if filled.is_nan() || filled > 1.0 {
                next.give_up(Why::Left(next.path_time));
            }
        }
        self.set_pace(&mut next, error, seen, time);
        let wheels = self.wheels(&mut next, error, shares, time);
        self.hold(&mut next, wheels, time);
        self.judge_rest(&mut next, error, now);
        next.history.push_back(Executed { from: executed, wheels: [next.held[0].speed, next.held[1].speed] });

        let row = CommandRow {
            wheel_left: next.held[0].speed,
            wheel_right: next.held[1].speed,
            joint_positions: next.joints.clone(),
            joint_velocities: next.held[2..].iter().map(|held| held.speed).collect(),
            pose: reference,
        };
        let ([left, right], track) = (self.drive.wheel_radii, self.drive.track_width);
        let (left, right) = (left * row.wheel_left, right * row.wheel_right);
        let twist = (0.5 * (left + right), (right - left) / track);
        let command = Command {
            phase: next.phase,
            row,
            twist,
            path_time: next.path_time,
            pace: next.pace,
            error,
            estimate: estimate.map(|o| o.pose()),
            shares,
        };
        Ok((next, command))
    }

    fn duration(&self) -> f64 {
        self.motion.table().duration()
    }

    /// Takes a pose into account, or that none has come.
    fn look(&self, next: &mut State, now: f64, seen: Option<&Sighting>) {
        if let Some(seen) = seen {
            let observer = match &next.observer {
                None => Some(Observer::new(&self.drive, seen.time, seen.pose)),
                Some(observer) => {
                    let mut driven = observer.driven(&self.drive, &next.history, seen.time);
                    driven.see(&self.drive, &next.history, seen.pose).then_some(driven)
                }
            };
            let gap = seen.time - next.seen;
            if gap.is_finite() && gap > self.options.lost_after {
                next.give_up(Why::Lost(gap));
            }
            match observer {
                Some(observer) => {
                    next.seen = seen.time;
                    if next.observer.is_none() && next.phase == Phase::Waiting {
                        // At rest at the beginning: the file's own pace is within limits from here.
                        (next.phase, next.pace) = (Phase::Tracking, self.fastest);
                    }
                    let needed = observer.time() - observer::MEMORY;
                    while next.history.get(1).is_some_and(|command| command.from <= needed) {
                        next.history.pop_front();
                    }
                    next.observer = Some(observer);
                }
                None => next.observer.iter_mut().for_each(Observer::missed),
            }
        }
        let gap = now - next.seen;
        if gap.is_finite() && gap > self.options.lost_after {
            next.give_up(Why::Lost(gap));
        }
    }

    /// Speeds wanted of the wheels, and how fast they change by themselves.
    fn wheels(&self, next: &mut State, error: Error, shares: Shares, time: f64) -> [[f64; 2]; 2] {
        let hold = self.motion.table().sampling_time;
        let at_end = next.path_time >= self.duration();
        let to = if at_end { next.path_time } else { next.path_time + next.pace * time };
        let mean = |wheel: usize| {
            (self.motion.travel(wheel, to / hold) - self.motion.travel(wheel, next.path_time / hold)) * hold / time
        };
        let rims = [0, 1].map(|wheel| self.drive.wheel_radii[wheel] * mean(wheel));
        let reference =
            Twist { speed: 0.5 * (rims[0] + rims[1]), turn_rate: (rims[1] - rims[0]) / self.drive.track_width };
        let planned = self.rates(reference, shares);
        let rate = [0, 1].map(|wheel| (planned[wheel] - next.planned[wheel]) / time);
        next.planned = planned;
        if !next.moves() {
            next.planned = [0.0; 2];
            return [[0.0; 2]; 2];
        }
        let mut left = error;
        if at_end {
            // A differential drive at rest has no way to the side, and trembling does not help.
            left.across = 0.0;
            left.along = if left.along.abs() < AT_REST.0 { 0.0 } else { left.along };
            left.heading = if left.heading.abs() < AT_REST.1 { 0.0 } else { left.heading };
        }
        let mut wanted = law::twist(self.gains, left, reference);
        if !self.options.reverse && reference.speed > -NONE {
            wanted.speed = wanted.speed.max(0.0);
        }
        let share = (self.base[0] / wanted.speed.abs()).min(self.base[1] / wanted.turn_rate.abs()).min(1.0);
        let wanted = Twist { speed: share * wanted.speed, turn_rate: share * wanted.turn_rate };
        [self.rates(wanted, shares), rate]
    }

    /// Rates of the wheels that make a twist, with wheels as they are believed to be.
    fn rates(&self, twist: Twist, shares: Shares) -> [f64; 2] {
        let half = 0.5 * self.drive.track_width * (1.0 + shares.track) * twist.turn_rate;
        let radius = |wheel: usize| self.drive.wheel_radii[wheel] * (1.0 + shares.radii[wheel]);
        [(twist.speed - half) / radius(0), (twist.speed + half) / radius(1)]
    }

    /// Holds what is wanted, within all limits.
    fn hold(&self, next: &mut State, [wanted, rate]: [[f64; 2]; 2], time: f64) {
        let near = [0, 1].map(|k| self.bounds[k].approach(next.held[k], wanted[k], rate[k], RESERVE[2], time));
        let boxes = [0, 1].map(|k| self.bounds[k].admissible(next.held[k], time));
        let mut speeds = limiter::together(near, boxes).to_vec();
        let hold = self.motion.table().sampling_time;
        for joint in 0..next.joints.len() {
            let k = 2 + joint;
            let planned = |at: f64| self.motion.joint(joint, at / hold);
            let value = next.joints[joint];
            // Behind the end of the path nothing moves by itself.
            let ahead = if next.path_time >= self.duration() { 0.0 } else { next.pace * time };
            let (here, there) = (planned(next.path_time), planned(next.path_time + ahead));
            let here = if ahead == 0.0 && (here - value).abs() < JOINT_AT_REST { value } else { here };
            let there = if ahead == 0.0 { here } else { there };
            let [low, high] = self.ranges[joint];
            let rate = (planned(next.path_time + 2.0 * ahead) - 2.0 * planned(next.path_time + ahead)
                + planned(next.path_time))
                / (time * time);
            let wanted = ((there - here) / time + JOINT_GAIN * (here - value))
                .clamp((low - value).min(0.0) / time, (high - value).max(0.0) / time);
            let [low, high] = self.bounds[k].admissible(next.held[k], time);
            speeds.push(self.bounds[k].approach(next.held[k], wanted, rate, RESERVE[2], time).clamp(low, high));
        }
        for (held, mut speed) in next.held.iter_mut().zip(speeds) {
            speed = if speed.abs() < NONE && held.speed.abs() < NONE { 0.0 } else { speed };
            *held = Held { speed, acceleration: (speed - held.speed) / time };
        }
    }

    /// Whether the motion is over.
    fn judge_rest(&self, next: &mut State, error: Error, now: f64) {
        let still = next.held.iter().all(|held| held.speed.abs() < NONE);
        match next.phase {
            Phase::Stopping(why) if still && next.pace < NONE => next.phase = Phase::Stopped(why),
            Phase::Tracking | Phase::Waiting if next.observer.is_some() && next.path_time >= self.duration() => {
                let since = *next.ended.get_or_insert(now);
                // Overshoot of a base that may not drive backwards remains.
                let along = if self.options.reverse { error.along.abs() } else { error.along };
                let small = along < 2.0 * AT_REST.0 && error.heading.abs() < 2.0 * AT_REST.1;
                next.calm = if small { next.calm.or(Some(now)) } else { None };
                let calm = next.calm.is_some_and(|since| now - since >= CALM.0);
                if still && (calm || now - since > CALM.1) {
                    next.phase = Phase::Done;
                }
            }
            _ => {}
        }
    }
}

impl State {
    /// What the robot is doing.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Where the reference is, s of the motion.
    pub fn path_time(&self) -> f64 {
        self.path_time
    }

    /// Whether it follows the path.
    fn moves(&self) -> bool {
        matches!(self.phase, Phase::Tracking | Phase::Waiting) && self.observer.is_some()
    }

    fn give_up(&mut self, why: Why) {
        if matches!(self.phase, Phase::Tracking | Phase::Waiting) {
            self.phase = Phase::Stopping(why);
        }
    }
}

/// Refuses a pose that cannot be used.
fn check(seen: &Sighting, now: f64, state: &State) -> Result<(), Refused> {
    let Pose2 { x, y, yaw } = seen.pose;
    let values = [x, y, yaw].into_iter().chain(seen.joints.iter().flatten().copied());
    if !values.into_iter().all(|v| v.abs() <= FARTHEST) {
        return Err(Refused::NoNumber);
    }
    let after = state.observer.as_ref().map_or(f64::NEG_INFINITY, Observer::time);
    if !(seen.time.is_finite() && seen.time > after && seen.time <= now) {
        return Err(Refused::Order { at: seen.time, after });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
