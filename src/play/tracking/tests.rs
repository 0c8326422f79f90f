//! The whole step: closed loops with wheels, tracks and latencies that are not the file's, and what poses may not do.

use proptest::prelude::*;

use super::*;
use crate::command::CommandTable;
use crate::math::noise::Noise;
use crate::play::fixtures::{drive, smooth, table, tight_robot};

/// A robot's own wheels against the file's: a loop with a pose every `period` seconds.
struct World {
    pose: Pose2,
    radii: [f64; 2],
    noise: f64,
}

fn ready(table: CommandTable) -> (Motion, RobotModel, Limits, Tube) {
    let robot = tight_robot(&table);
    let motion = Motion::new(table);
    let limits = Limits::new(&robot, &motion);
    (motion, robot, limits, Tube::constant(0.1, 0.5, 0.3))
}

/// Closes the loop for so many steps; `alter` may change the world and what is seen of it.
fn run(
    tracker: &Tracker<'_>,
    world: &mut World,
    steps: usize,
    mut alter: impl FnMut(usize, &mut World, &mut Option<Sighting>),
) -> Vec<Command> {
    let (mut state, mut noise, period) = (tracker.begin(), Noise::new(3), 0.05);
    let mut commands: Vec<Command> = Vec::new();
    for k in 0..steps {
        if let Some(last) = commands.last() {
            let table = tracker.motion.table();
            let rim = |rate: f64, side: usize| table.wheel_radii.sides()[side] * (1.0 + world.radii[side]) * rate;
            let (left, right) = (rim(last.row.wheel_left, 0), rim(last.row.wheel_right, 1));
            world.pose = world.pose.after_twist(0.5 * (left + right), (right - left) / table.track_width, period);
        }
        let [a, b, c] = noise.normals().map(|n| world.noise * n);
        let pose = Pose2::new(world.pose.x + a, world.pose.y + b, world.pose.yaw + c);
        let mut seen = Some(Sighting { time: period * k as f64, pose, joints: Vec::new() });
        alter(k, world, &mut seen);
        let (next, command) = tracker.step(&state, period * k as f64, seen.as_ref()).expect("good poses");
        state = next;
        commands.push(command);
    }
    commands
}

/// Largest ratios of speed, acceleration and jerk of all actuators to their limits.
fn peaks(tracker: &Tracker<'_>, commands: &[Command], period: f64) -> [f64; 3] {
    let mut worst = [0.0f64; 3];
    for (actuator, bounds) in tracker.bounds.iter().enumerate() {
        let speeds = commands.iter().map(|c| crate::play::motion::speed(&c.row, actuator));
        // Not beyond the last: playing may be cut off anywhere here.
        let speeds: Vec<f64> = [0.0, 0.0].into_iter().chain(speeds).collect();
        for w in speeds.windows(3) {
            let (first, second) = ((w[2] - w[1]) / period, (w[2] - 2.0 * w[1] + w[0]) / (period * period));
            worst[0] = worst[0].max(w[2].abs() / bounds.speed);
            worst[1] = worst[1].max(first.abs() / bounds.acceleration);
            worst[2] = worst[2].max(second.abs() / bounds.jerk);
        }
    }
    worst
}

#[test]
fn a_perfect_robot_is_left_on_the_path_and_ends_at_rest_on_its_end() {
    let (motion, robot, limits, tube) = ready(drive(900));
    let tracker = Tracker::new(&motion, &robot, &limits, &tube, Options::default());
    let mut world = World { pose: motion.pose(0.0), radii: [0.0; 2], noise: 0.0 };
    let commands = run(&tracker, &mut world, 400, |_, _, _| {});
    let last = commands.last().expect("commands");
    assert_eq!(last.phase, Phase::Done);
    assert_eq!((last.row.wheel_left, last.row.wheel_right), (0.0, 0.0));
    // What the splines between rows differ from held rows by.
    assert!(commands.iter().all(|c| c.error.across.abs() < 1e-3 && c.error.heading.abs() < 1e-3));
    assert!(world.pose.distance(motion.pose(1e9)) < 2.0 * AT_REST.0);
}

#[test]
fn time_is_held_back_while_the_robot_is_held_and_never_goes_back() {
    let (motion, robot, limits, tube) = ready(drive(900));
    let tracker = Tracker::new(&motion, &robot, &limits, &tube, Options::default());
    let mut world = World { pose: motion.pose(0.0), radii: [0.0; 2], noise: 0.0 };
    let mut stuck = None;
    let commands = run(&tracker, &mut world, 900, |k, world, seen| {
        // Somebody holds the robot for four seconds.
        if (100..180).contains(&k) {
            world.pose = *stuck.get_or_insert(world.pose);
            *seen = seen.take().map(|s| Sighting { pose: world.pose, ..s });
        }
    });
    assert!(commands.windows(2).all(|w| w[1].path_time >= w[0].path_time));
    assert!(commands[160..180].iter().all(|c| c.phase == Phase::Waiting && c.pace < 0.1));
    assert!(commands[179].path_time - commands[120].path_time < 0.3, "the clock stands");
    assert_eq!(commands.last().map(|c| c.phase), Some(Phase::Done));
    let off = world.pose.distance(motion.pose(1e9));
    assert!(off < 0.005, "{off}");
}

#[test]
fn poses_that_stop_coming_stop_the_robot_by_a_ramp() {
    let (motion, robot, limits, tube) = ready(drive(900));
    let tracker = Tracker::new(&motion, &robot, &limits, &tube, Options::default());
    let mut world = World { pose: motion.pose(0.0), radii: [0.0; 2], noise: 0.0 };
    let commands = run(&tracker, &mut world, 400, |k, _, seen| {
        if k >= 100 {
            *seen = None;
        }
    });
    // Half a second without a pose, the last at step 99.
    assert!(matches!(commands[109].phase, Phase::Tracking));
    assert!(matches!(commands[110].phase, Phase::Stopping(Why::Lost(_))));
    let last = commands.last().expect("commands");
    assert!(matches!(last.phase, Phase::Stopped(Why::Lost(_))));
    assert!(last.twist.0 == 0.0 && last.twist.1 == 0.0);
    let [speed, acceleration, jerk] = peaks(&tracker, &commands, 0.05);
    assert!(speed <= 1.0 && acceleration <= 1.0 + 1e-9 && jerk <= 1.0 + 1e-6, "{speed} {acceleration} {jerk}");
}

#[test]
fn a_robot_that_is_pushed_off_its_path_or_begins_elsewhere_stops() {
    let (motion, robot, limits, tube) = ready(drive(900));
    let tracker = Tracker::new(&motion, &robot, &limits, &tube, Options::default());
    let mut world = World { pose: motion.pose(0.0), radii: [0.0; 2], noise: 0.0 };
    let pushed = run(&tracker, &mut world, 300, |k, world, _| {
        if k == 100 {
            world.pose.y += 0.3;
        }
    });
    let at = pushed.iter().position(|c| matches!(c.phase, Phase::Stopping(Why::Left(_)))).expect("it stops");
    assert!((101..110).contains(&at), "a jump is believed after some poses: {at}");
    assert!(matches!(pushed.last().map(|c| c.phase), Some(Phase::Stopped(Why::Left(_)))));
    let mut elsewhere = World { pose: Pose2::new(9.0, 9.0, 0.0), radii: [0.0; 2], noise: 0.0 };
    let commands = run(&tracker, &mut elsewhere, 20, |_, _, _| {});
    assert!(commands.iter().all(|c| c.row.wheel_left == 0.0 && c.row.wheel_right == 0.0));
    assert!(matches!(commands.last().map(|c| c.phase), Some(Phase::Stopped(Why::Left(_)))));
}

#[test]
fn what_is_no_pose_is_refused_and_changes_nothing() {
    let (motion, robot, limits, tube) = ready(drive(300));
    let tracker = Tracker::new(&motion, &robot, &limits, &tube, Options::default());
    let good = Sighting { time: 0.0, pose: motion.pose(0.0), joints: Vec::new() };
    let (state, _) = tracker.step(&tracker.begin(), 0.0, Some(&good)).expect("a pose");
    for wrong in [f64::NAN, f64::INFINITY, 1e9] {
        for pose in [Pose2::new(wrong, 0.0, 0.0), Pose2::new(0.0, wrong, 0.0), Pose2::new(0.0, 0.0, wrong)] {
            let seen = Sighting { time: 0.1, pose, joints: Vec::new() };
            assert_eq!(tracker.step(&state, 0.1, Some(&seen)), Err(Refused::NoNumber));
        }
        let joints = Sighting { time: 0.1, joints: vec![Some(wrong)], ..good.clone() };
        assert_eq!(tracker.step(&state, 0.1, Some(&joints)), Err(Refused::NoNumber));
    }
    for time in [0.0, -1.0, 0.2, f64::NAN] {
        let seen = Sighting { time, ..good.clone() };
        assert!(matches!(tracker.step(&state, 0.1, Some(&seen)), Err(Refused::Order { .. })), "{time}");
    }
    for now in [0.0, -1.0, f64::NAN] {
        assert!(matches!(tracker.step(&state, now, None), Err(Refused::Time { .. })), "{now}");
    }
}

#[test]
fn before_the_first_pose_nothing_moves() {
    let (motion, robot, limits, tube) = ready(drive(300));
    let tracker = Tracker::new(&motion, &robot, &limits, &tube, Options::default());
    let mut world = World { pose: motion.pose(0.0), radii: [0.0; 2], noise: 0.0 };
    let commands = run(&tracker, &mut world, 200, |k, _, seen| {
        if k < 40 {
            *seen = None;
        }
    });
    let waits = |c: &Command| c.phase == Phase::Waiting && c.path_time == 0.0 && c.twist == (0.0, 0.0);
    assert!(commands[..40].iter().all(waits));
    assert_eq!(commands[40].phase, Phase::Tracking);
}

#[test]
fn joints_follow_the_held_clock_and_their_own_lag_holds_it() {
    let wheels = smooth(&[3.0; 3], 300, [60, 25]);
    let mut arm = smooth(&[0.3, -0.2, 0.1], 300, [60, 25]);
    arm.resize(wheels.len(), 0.0);
    let (motion, robot, limits, tube) = ready(table(&[wheels.clone(), wheels, arm], 0.01));
    let tracker = Tracker::new(&motion, &robot, &limits, &tube, Options::default());
    let mut world = World { pose: motion.pose(0.0), radii: [0.0; 2], noise: 0.001 };
    let stuck = motion.joint(0, 200.0);
    let commands = run(&tracker, &mut world, 600, |k, _, seen| {
        let value = if (60..140).contains(&k) { Some(stuck) } else { None };
        seen.iter_mut().for_each(|s| s.joints = vec![value]);
    });
    assert!(commands[130].pace < 0.05, "the arm is stuck: {}", commands[130].pace);
    for c in &commands {
        let planned = motion.joint(0, c.path_time / 0.01);
        assert!((c.row.joint_positions[0] - planned).abs() < 0.02, "{} s", c.path_time);
    }
    assert_eq!(commands.last().map(|c| c.phase), Some(Phase::Done));
    let [speed, acceleration, jerk] = peaks(&tracker, &commands, 0.05);
    assert!(speed <= 1.0 && acceleration <= 1.0 + 1e-9 && jerk <= 1.0 + 1e-6, "{speed} {acceleration} {jerk}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn commands_keep_every_limit_whatever_poses_come_and_whenever(
        poses in proptest::collection::vec(
            (0.002..0.3f64, proptest::option::weighted(0.8, (-3.0..3.0f64, -3.0..3.0f64, -9.0..9.0f64, 0.0..1.0f64))), 1..200),
    ) {
        let (motion, robot, limits, tube) = ready(drive(300));
        let wide = Tube::constant(1e6, 1e6, 0.0);
        for tube in [&tube, &wide] {
            let tracker = Tracker::new(&motion, &robot, &limits, tube, Options::default());
            let (mut state, mut now, mut held) = (tracker.begin(), 0.0, vec![Held::default(); 2]);
            for (step, pose) in &poses {
                let passed = if now == 0.0 { 0.01 } else { *step };
                now += step;
                // Poses are near the path or anywhere.
                let seen = pose.map(|(x, y, yaw, share)| {
                    let near = motion.pose(state.path_time() / 0.01);
                    let scale = if share < 0.7 { 0.02 } else { 1.0 };
                    let pose = Pose2::new(near.x + scale * x, near.y + scale * y, near.yaw + scale * yaw);
                    Sighting { time: now, pose, joints: Vec::new() }
                });
                let (next, command) = tracker.step(&state, now, seen.as_ref()).expect("numbers");
                prop_assert!(next.path_time() >= state.path_time());
                state = next;
                let time = passed.min(LONGEST);
                for (k, speed) in [command.row.wheel_left, command.row.wheel_right].into_iter().enumerate() {
                    let bounds = tracker.bounds[k];
                    let acceleration = (speed - held[k].speed) / time;
                    let jerk = (acceleration - held[k].acceleration) / time;
                    prop_assert!(speed.abs() <= bounds.speed);
                    prop_assert!(acceleration.abs() <= bounds.acceleration * (1.0 + 1e-9));
                    prop_assert!(jerk.abs() <= bounds.jerk * (1.0 + 1e-6) + 1e-6, "{jerk} of {}", bounds.jerk);
                    held[k] = Held { speed, acceleration };
                }
            }
        }
    }
}
