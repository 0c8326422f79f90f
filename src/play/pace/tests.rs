//! Whatever is played and wherever it is cut: the stop keeps every limit, stays on the path and ends at rest.

use proptest::prelude::*;

use super::*;
use crate::command::CommandTable;
use crate::geom::Pose2;
use crate::math::real;
use crate::play::fixtures::{drive, ready, smooth, table, tight_robot};
use crate::play::motion::{slowed, speed};

/// The largest excess over a limit, as a ratio to it, of what is held: counted anew from the rows, as the certificate counts.
fn excess(table: &CommandTable, robot: &RobotModel) -> f64 {
    crate::command::limits::needed_slow_down(table, robot)
}

/// What is sent when a table is cut at a row: its rows up to there, then the stop.
fn cut(motion: &Motion, stop: &Stop, at: usize) -> CommandTable {
    let rows = motion.table().rows[..at].iter().chain(&stop.rows).cloned().collect();
    CommandTable { rows, ..motion.table().clone() }
}

/// How far the replay of rows leaves the planned path to the side, m, and how far its heading is off, rad, at their path times.
fn off_the_path(motion: &Motion, stop: &Stop) -> (f64, f64) {
    let table = CommandTable { rows: stop.rows.clone(), ..motion.table().clone() };
    let poses = table.replay(motion.pose(stop.path_times[0]));
    let off = poses.iter().zip(&stop.path_times).map(|(is, time)| {
        let planned = motion.pose(*time);
        let aside = (is.y - planned.y) * real::cos(planned.yaw) - (is.x - planned.x) * real::sin(planned.yaw);
        (aside.abs(), (is.yaw - planned.yaw).abs())
    });
    off.fold((0.0, 0.0), |(d, a): (f64, f64), (distance, angle)| (d.max(distance), a.max(angle)))
}

/// What a stop may leave the path by, m: the file's arcs are polygons in heading, a stop rounds them. A row that has a corner of turn rate
/// within it differs by a triangle of heading, whose area is at most the corner times the square of the row's time over 8: times the speed
/// it is what the robot is moved aside. A corner of speed does the same to a robot that turns.
fn bound(motion: &Motion, stop: &Stop) -> f64 {
    let (table, hold) = (motion.table(), motion.table().sampling_time);
    let first = stop.path_times[0] as usize;
    let last = (stop.path_times[stop.path_times.len() - 1].ceil() as usize + 6).min(table.rows.len() - 1);
    let rows = first.saturating_sub(6)..=last;
    let fastest = rows.clone().map(|k| table.twist(k).0.abs()).fold(0.0, f64::max);
    let sharpest = rows.clone().map(|k| table.twist(k).1.abs()).fold(0.0, f64::max);
    let before = |k: usize| if k > 0 { table.twist(k - 1) } else { (0.0, 0.0) };
    let sped: f64 = rows.clone().map(|k| (table.twist(k).0 - before(k).0).abs()).sum();
    let turned: f64 = rows.map(|k| (table.twist(k).1 - before(k).1).abs()).sum();
    (fastest * turned + sharpest * sped) * hold * hold / 8.0 + 1e-9
}

fn check(motion: &Motion, robot: &RobotModel, limits: &Limits, at: usize) -> Result<(), TestCaseError> {
    let stop = stop(motion, at, limits);
    let whole = cut(motion, &stop, at);
    let ratio = excess(&whole, robot);
    prop_assert!(ratio <= 1.0, "cut at row {at}: {ratio}");
    prop_assert_eq!(stop.rows.len(), stop.path_times.len());
    if let Some(last) = stop.rows.last() {
        prop_assert!((0..motion.actuators()).all(|a| speed(last, a) == 0.0), "not at rest: {last:?}");
        prop_assert!(stop.path_times.windows(2).all(|w| w[0] <= w[1]), "goes back");
        let (distance, _) = off_the_path(motion, &stop);
        let bound = bound(motion, &stop);
        prop_assert!(distance <= bound, "cut at row {at}: {distance} m off, {bound} allowed");
        // Positions and held speeds of joints agree, as a certificate asks.
        for (rows, j) in whole.rows.windows(2).flat_map(|w| (0..whole.joints.len()).map(move |j| (w, j))) {
            let next = rows[0].joint_positions[j] + whole.sampling_time * rows[0].joint_velocities[j];
            prop_assert!((rows[1].joint_positions[j] - next).abs() < 1e-9);
        }
    }
    Ok(())
}

/// Speeds of two wheels and a joint, with the limits that they need and no more.
fn motions() -> impl Strategy<Value = CommandTable> {
    let levels = |most: f64| prop::collection::vec(-most..most, 2..6);
    let widths = prop_oneof![Just([3, 2]), Just([6, 4]), Just([10, 1]), Just([12, 5])];
    (levels(4.0), levels(4.0), levels(1.0), widths, 5usize..20, prop_oneof![Just(0.1), Just(0.02)]).prop_map(
        |(left, right, joint, widths, rows, hold)| {
            let mut speeds = [left, right, joint].map(|levels| smooth(&levels, rows, widths));
            let longest = speeds.iter().map(Vec::len).max().unwrap_or(0);
            speeds.iter_mut().for_each(|s| s.resize(longest, 0.0));
            table(&speeds, hold)
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_stop_keeps_limits_stays_on_the_path_and_ends_at_rest(
        table in motions(), share in 0.0..1.0f64, rate in prop_oneof![Just(1.0), 0.1..1.0f64],
    ) {
        let robot = tight_robot(&table);
        let motion = Motion::new(slowed(table, rate));
        let limits = Limits::new(&robot, &motion);
        let rows = motion.table().rows.len();
        for at in [0, 1, (share * rows as f64) as usize, rows - 1] {
            check(&motion, &robot, &limits, at)?;
        }
    }

    #[test]
    fn whoever_sets_off_within_keeps_limits_and_joins_the_plan(table in motions(), share in 0.0..1.0f64) {
        let (robot, (motion, limits)) = (tight_robot(&table), ready(table));
        let from = (share * motion.table().rows.len() as f64) as usize;
        if let Some(begun) = set_off(&motion, from, &limits) {
            let rest = motion.table().rows[begun.joins..].iter().cloned();
            let whole = CommandTable { rows: begun.rows.iter().cloned().chain(rest).collect(), ..motion.table().clone() };
            let ratio = excess(&whole, &robot);
            prop_assert!(ratio <= 1.0, "from row {from}: {ratio}");
            // All that lies between is driven, no more: wheels have turned as far as planned where the plan is joined.
            for actuator in 0..motion.actuators() {
                let driven: f64 = begun.rows.iter().map(|row| speed(row, actuator)).sum();
                let planned: f64 = motion.table().rows[from..begun.joins].iter().map(|row| speed(row, actuator)).sum();
                prop_assert!((driven - planned).abs() < 1e-9, "{driven} of {planned}");
            }
        }
    }
}

#[test]
fn a_cruise_stops_as_soon_as_acceleration_and_jerk_allow() {
    // 3 rad/s, means over 60 and 25 rows of 10 ms: 5 rad/s^2 and 20 rad/s^3. Time from speed to rest: 3/5 + 5/20 s.
    let (motion, limits) = ready(table(&[smooth(&[3.0; 3], 100, [60, 25]), smooth(&[3.0; 3], 100, [60, 25])], 0.01));
    let stop = stop(&motion, 200, &limits);
    let time = 0.01 * stop.rows.len() as f64;
    assert!((0.84..1.0).contains(&time), "{time}");
    let (distance, angle) = off_the_path(&motion, &stop);
    assert!(distance < 1e-12 && angle < 1e-12, "straight: {distance} m, {angle} rad");
}

#[test]
fn a_stop_in_a_bend_follows_it_and_turns_as_far_as_planned() {
    let (motion, limits) = ready(drive(900));
    for at in (0..motion.table().rows.len()).step_by(37) {
        let stop = stop(&motion, at, &limits);
        let (distance, _) = off_the_path(&motion, &stop);
        assert!(distance < 1e-5, "cut at row {at}: {distance} m");
        let last = stop.path_times.last().expect("rows");
        let replayed = CommandTable { rows: stop.rows.clone(), ..motion.table().clone() };
        let yaw = replayed.replay(motion.pose(stop.path_times[0])).last().map_or(0.0, |pose: &Pose2| pose.yaw);
        // Heading: to what a row's corner of turn rate is worth.
        assert!((yaw - motion.pose(*last).yaw).abs() < 1e-4, "cut at row {at}");
    }
}

#[test]
fn what_is_at_rest_stops_at_once_and_sets_off_as_planned() {
    let (motion, limits) = ready(drive(900));
    let rows = motion.table().rows.len();
    assert_eq!(stop(&motion, rows - 1, &limits).rows, motion.table().rows[rows - 1..]);
    assert_eq!(stop(&motion, rows, &limits).rows, []);
    assert_eq!(set_off(&motion, 0, &limits), Some(SetOff { rows: Vec::new(), joins: 0 }));
}
