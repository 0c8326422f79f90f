//! A robot whose wheels, track and latency are not the file's, and poses with noise: what closes the loop in tests and in
//! `examples/closed_loop.rs`.

#[path = "../../src/math/noise.rs"]
mod noise;

use std::collections::VecDeque;
use std::path::Path;

pub use noise::Noise;
use trajc::geom::{Pose2, wrap_angle};
use trajc::inputs::commands::{self, Places};
use trajc::math::real;
use trajc::play::Motion;
use trajc::play::pace::Limits;
use trajc::play::tracking::tube::Tube;
use trajc::play::tracking::{Command, Options, Phase, Sighting, Tracker};
use trajc::robot::RobotModel;

/// By how much a robot differs from the model that a file was compiled for.
#[derive(Debug, Clone, Copy, Default)]
pub struct Fault {
    /// Share by which the left and the right wheel are larger.
    pub radii: [f64; 2],
    /// Share by which the track is wider.
    pub track: f64,
    /// From command to execution, s.
    pub latency: f64,
    /// Standard deviation of measured coordinates, m.
    pub noise: f64,
    /// And of headings, rad.
    pub turn_noise: f64,
    /// Where it stands at the beginning, in the frame of the planned pose: m, m, rad.
    pub start: [f64; 3],
}

/// How a run went.
#[derive(Debug, Clone)]
pub struct Run {
    /// At the end: m, rad.
    pub end: (f64, f64),
    /// Largest distance to the reference across the path, m; largest difference of heading, rad.
    pub most: (f64, f64),
    /// How it ended.
    pub phase: Phase,
    /// When, s.
    pub time: f64,
    /// Largest filling of the tube by the true robot.
    pub filled: f64,
    /// All commands.
    pub commands: Vec<(f64, Command)>,
}

/// A motion of a compiled file, ready to be followed.
pub struct Prepared {
    pub robot: RobotModel,
    pub motion: Motion,
    pub limits: Limits,
    pub tube: Tube,
    pub reverse: bool,
}

/// Reads a compiled file; the room is the clearance that is proven.
pub fn prepare(path: &Path) -> Prepared {
    let loaded =
        commands::load(path, Places::default()).unwrap_or_else(|f| panic!("{}", trajc::diag::render(&f, false)));
    let clearance = loaded.certify().expect("a certificate").clearance_proven.unwrap_or(0.1);
    let reverse = loaded.inputs.mission.reverse;
    let (robot, motion) = (loaded.world.robot, Motion::new(loaded.file.table));
    let limits = Limits::new(&robot, &motion);
    let reach = motion.table().rows.iter().map(|row| robot.radius(&row.joint_positions)).fold(0.0, f64::max);
    Prepared { tube: Tube::constant(clearance, 0.5, reach), robot, motion, limits, reverse }
}

/// A simulated base.
pub struct Base {
    pub pose: Pose2,
    fault: Fault,
    radius: f64,
    track: f64,
    time: f64,
    held: [f64; 2],
    waiting: VecDeque<(f64, [f64; 2])>,
}

impl Base {
    pub fn new(motion: &Motion, fault: Fault) -> Self {
        let (start, table) = (motion.pose(0.0), motion.table());
        let (sin, cos) = real::sin_cos(start.yaw);
        let [dx, dy, turn] = fault.start;
        let pose = Pose2::new(start.x + cos * dx - sin * dy, start.y + sin * dx + cos * dy, start.yaw + turn);
        let (radius, track) = (table.wheel_radii.mean, table.track_width);
        Self { pose, fault, radius, track, time: 0.0, held: [0.0; 2], waiting: VecDeque::new() }
    }

    /// A command that is given now.
    pub fn command(&mut self, wheels: [f64; 2]) {
        self.waiting.push_back((self.time + self.fault.latency, wheels));
    }

    /// Drives until then.
    pub fn drive(&mut self, until: f64) {
        loop {
            let change = self.waiting.front().map_or(f64::INFINITY, |(at, _)| *at);
            let end = until.min(change).max(self.time);
            let rims = [0, 1].map(|k| self.radius * (1.0 + self.fault.radii[k]) * self.held[k]);
            let track = self.track * (1.0 + self.fault.track);
            self.pose = self.pose.after_twist(0.5 * (rims[0] + rims[1]), (rims[1] - rims[0]) / track, end - self.time);
            self.time = end;
            if change > until {
                return;
            }
            self.held = self.waiting.pop_front().expect("one waits").1;
        }
    }

    pub fn measured(&self, noise: &mut Noise) -> Pose2 {
        let (d, a) = (self.fault.noise, self.fault.turn_noise);
        let Pose2 { x, y, yaw } = self.pose;
        Pose2::new(x + d * noise.normal(), y + d * noise.normal(), wrap_angle(yaw + a * noise.normal()))
    }
}

/// Drives with feedback, a pose every `period` seconds. What is not told of the robot: `fault`; what is: `options`.
pub fn closed(prepared: &Prepared, fault: Fault, options: Options, period: f64, seed: u64) -> Run {
    let Prepared { robot, motion, limits, tube, reverse } = prepared;
    let tracker = Tracker::new(motion, robot, limits, tube, Options { reverse: *reverse, ..options });
    let (mut state, mut base, mut noise) = (tracker.begin(), Base::new(motion, fault), Noise::new(seed));
    let most_steps = ((3.0 * motion.table().duration() + 20.0) / period) as usize;
    let (mut commands, mut most, mut filled) = (Vec::new(), (0.0f64, 0.0f64), 0.0f64);
    for k in 0..most_steps {
        let time = k as f64 * period;
        base.drive(time);
        let seen = Sighting { time, pose: base.measured(&mut noise), joints: Vec::new() };
        let (next, command) = tracker.step(&state, time, Some(&seen)).expect("good poses");
        state = next;
        base.command([command.row.wheel_left, command.row.wheel_right]);
        let off = trajc::play::tracking::law::error(command.row.pose, base.pose);
        most = (most.0.max(off.across.abs()), most.1.max(off.heading.abs()));
        filled = filled.max(tube.filled(motion, command.path_time, base.pose));
        let phase = command.phase;
        commands.push((time, command));
        if matches!(phase, Phase::Done | Phase::Stopped(_)) {
            break;
        }
    }
    let last = motion.pose(motion.table().rows.len() as f64 - 1.0);
    base.drive(commands.len() as f64 * period + fault.latency);
    let end = (base.pose.distance(last), wrap_angle(base.pose.yaw - last.yaw).abs());
    let phase = state.phase();
    Run { end, most, phase, time: commands.len() as f64 * period, filled, commands }
}

/// Plays the file as it is.
pub fn open(prepared: &Prepared, fault: Fault) -> Run {
    let (motion, mut base) = (&prepared.motion, Base::new(&prepared.motion, fault));
    let table = motion.table();
    let (mut most, mut filled) = ((0.0f64, 0.0f64), 0.0f64);
    for (k, row) in table.rows.iter().enumerate() {
        base.drive(table.time(k));
        let off = trajc::play::tracking::law::error(row.pose, base.pose);
        most = (most.0.max(off.across.abs()), most.1.max(off.heading.abs()));
        filled = filled.max(prepared.tube.filled(motion, table.time(k), base.pose));
        base.command([row.wheel_left, row.wheel_right]);
    }
    base.drive(table.duration() + fault.latency + 0.1);
    let last = motion.pose(table.rows.len() as f64 - 1.0);
    let end = (base.pose.distance(last), wrap_angle(base.pose.yaw - last.yaw).abs());
    Run { end, most, phase: Phase::Done, time: table.duration(), filled, commands: Vec::new() }
}

/// The disturbances of the table in docs/playback.md, all with poses of 5 mm and half a degree of noise.
pub fn disturbances() -> Vec<(&'static str, Fault)> {
    let noise = Fault { noise: 0.005, turn_noise: 0.5f64.to_radians(), ..Fault::default() };
    vec![
        ("none but noise", noise),
        ("wheels 1 % larger", Fault { radii: [0.01; 2], ..noise }),
        ("wheels 1 % smaller", Fault { radii: [-0.01; 2], ..noise }),
        ("right wheel 0.2 % larger", Fault { radii: [-0.001, 0.001], ..noise }),
        ("track 1 % wider", Fault { track: 0.01, ..noise }),
        ("track 1 % narrower", Fault { track: -0.01, ..noise }),
        ("latency 20 ms", Fault { latency: 0.02, ..noise }),
        ("latency 100 ms", Fault { latency: 0.1, ..noise }),
        ("start 1 cm, 0.6 degrees off", Fault { start: [0.0, 0.01, 0.01], ..noise }),
    ]
}
