//! How each family of cases is made. What is true of them the judge decides, not what was meant here.

use nalgebra::{Isometry3, Vector3};

use super::Family;
use super::case::{Case, Twist};
use super::draw::{self, FREE, add_joints, add_shape, chance, decades, one_of};
use super::judge::{clearance_at_rows, least_between_links, least_clearance};
use crate::certify::{Goal, Via};
use crate::eval::rng::Rng;
use crate::geom::Pose2;
use crate::map::VoxelMap;
use crate::math::real;
use crate::mission::{SpeedZone, Unknown};
use crate::robot::Convex;

/// Draws tried for a case that shows what its family is about; the last is taken as it is.
const TRIES: usize = 12;
/// How near to a requirement cases are pushed, m.
const PUSH: [f64; 2] = [1e-6, 1e-2];

/// Makes a case.
pub(super) fn make(family: Family, rng: &mut Rng) -> Case {
    match family {
        Family::Above => pushed(rng, family, 1.0, draw::scene),
        Family::Below => pushed(rng, family, -1.0, draw::scene),
        Family::Between => between(rng),
        Family::Joints => joints(rng),
        Family::Interior => interior(rng),
        Family::ThinWall => thin_wall(rng),
        Family::Edges => edges(rng),
        Family::Limits => limits(rng),
        Family::Rest => rest(rng),
        Family::Goal => goal(rng),
        Family::OwnLinks => own_links(rng),
        Family::Zones => zones(rng),
        Family::Stands => stands(rng),
        Family::Table => table(rng),
    }
}

/// Asks for the true clearance less (`side` 1) or more (-1) than a small amount.
fn push(rng: &mut Rng, case: &mut Case, side: f64) -> bool {
    let delta = if chance(rng, 0.2) { rng.uniform(1.1e-3, PUSH[1]) } else { decades(rng, PUSH[0], PUSH[1]) };
    let found = least_clearance(case, 0.2 * delta);
    if !found.upper.is_finite() {
        case.task.clearance = rng.uniform(0.0, 0.3);
        return false;
    }
    case.task.clearance = if side > 0.0 { found.lower - delta } else { found.upper + delta }.max(0.0);
    found.lower > delta
}

fn pushed(rng: &mut Rng, family: Family, side: f64, scene: impl Fn(&mut Rng, Family) -> Case) -> Case {
    let mut case = scene(rng, family);
    for _ in 0..TRIES {
        if push(rng, &mut case, side) {
            break;
        }
        case = scene(rng, family);
    }
    if case.task.clearance == 0.0 {
        push(rng, &mut case, side);
    }
    case
}

/// Too near only while a row is held, never when one begins.
fn between(rng: &mut Rng) -> Case {
    let scene = |rng: &mut Rng, family| {
        let robot = draw::robot(rng);
        let (values, _, held) = draw::motion(rng, robot.joints.len());
        let (start, step, room) = (draw::start(rng), rng.uniform(0.1, 0.6), draw::room(rng));
        let mut case = Case::new(family, robot, start, &values, step, &held);
        draw::furnish(rng, &mut case, room);
        case
    };
    seen_only_between(rng, Family::Between, scene)
}

fn seen_only_between(rng: &mut Rng, family: Family, scene: impl Fn(&mut Rng, Family) -> Case) -> Case {
    for _ in 0..TRIES {
        let mut case = scene(rng, family);
        let sampled = clearance_at_rows(&case);
        let found = least_clearance(&case, 1e-6);
        if sampled.is_finite() && sampled - found.upper > 1e-5 {
            case.task.clearance = found.upper + (sampled - found.upper) * rng.uniform(0.01, 0.99);
            return case;
        }
    }
    pushed(rng, family, -1.0, scene)
}

/// Only joints move.
fn joints(rng: &mut Rng) -> Case {
    let scene = |rng: &mut Rng, family| {
        let mut robot = draw::bare(rng);
        let count = rng.integer(1, 3) as usize;
        add_joints(rng, &mut robot, count);
        for body in 0..robot.bodies.len() {
            let shape = draw::convex(rng, 0.15);
            let at = Isometry3::translation(rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), rng.uniform(-0.1, 0.1));
            add_shape(&mut robot, body, at, shape);
        }
        draw::ignore_itself(&mut robot);
        let (values, step, mut held) = draw::motion(rng, count);
        held.iter_mut().for_each(|twist| (twist.0, twist.1) = (0.0, 0.0));
        let (start, room) = (draw::start(rng), draw::room(rng));
        let mut case = Case::new(family, robot, start, &values, step, &held);
        draw::furnish(rng, &mut case, room);
        case
    };
    if chance(rng, 0.5) {
        seen_only_between(rng, Family::Joints, scene)
    } else {
        let side = if chance(rng, 0.5) { 1.0 } else { -1.0 };
        pushed(rng, Family::Joints, side, scene)
    }
}

/// A cell wholly inside a shape, or before the middle of a face, away from all corners.
fn interior(rng: &mut Rng) -> Case {
    let inside = chance(rng, 0.5);
    let scene = |rng: &mut Rng, family| {
        let mut robot = draw::bare(rng);
        let convex = if chance(rng, 0.7) { draw::hull(rng, 0.4) } else { draw::convex(rng, 0.4) };
        // A point of the shape, nearer to its middle than to its corners; or the middle of some face.
        let mut shares: Vec<f64> = (0..3).map(|_| rng.uniform(0.1, 1.0)).collect();
        let sum: f64 = shares.iter().sum();
        shares.iter_mut().for_each(|share| *share /= sum);
        let turned = Vector3::from_fn(|_, _| rng.uniform(-1.0, 1.0));
        let around = [0.0, 2.0, 4.0].map(|angle: f64| {
            let about = nalgebra::Rotation3::new(turned.normalize() * angle);
            let away = about * Vector3::new(turned.y, -turned.x, 0.3) + turned * 0.5;
            convex.support(&away)
        });
        let point: Vector3<f64> = around.iter().zip(&shares).map(|(corner, share)| corner * *share).sum();
        let point = if inside { point * 0.3 } else { point + turned.normalize() * rng.uniform(0.01, 0.1) };
        add_shape(&mut robot, 0, Isometry3::identity(), convex);
        let held: Vec<Twist> =
            (0..rng.integer(1, 3)).map(|_| (rng.uniform(-0.2, 0.2), rng.uniform(-0.5, 0.5), Vec::new())).collect();
        let (start, step) = (draw::start(rng), decades(rng, 0.02, 0.2));
        let mut case = Case::new(family, robot, start, &[], step, &held);
        let resolution = if inside { rng.uniform(0.005, 0.02) } else { rng.uniform(0.01, 0.05) };
        let place = start.isometry() * nalgebra::Point3::new(point.x, point.y, point.z + 0.3);
        // A map of one cell about the point, or of a few.
        let cells = [1 + one_of(rng, 3), 1 + one_of(rng, 3), 1 + one_of(rng, 3)];
        let origin = std::array::from_fn(|axis| place[axis] - 0.5 * resolution * cells[axis] as f64);
        let mut map = VoxelMap::new(resolution, origin, cells, Unknown::Free);
        map.occupy(std::array::from_fn(|axis| cells[axis] / 2));
        case.map = Some(map);
        case
    };
    if inside {
        let mut case = scene(rng, Family::Interior);
        case.task.clearance = if chance(rng, 0.5) { 0.0 } else { decades(rng, 1e-6, 0.1) };
        case
    } else {
        let side = if chance(rng, 0.5) { 1.0 } else { -1.0 };
        pushed(rng, Family::Interior, side, scene)
    }
}

/// A wall of one cell, through which the robot jumps from row to row, or before which it turns back.
fn thin_wall(rng: &mut Rng) -> Case {
    let through = chance(rng, 0.5);
    let scene = |rng: &mut Rng, family| {
        let mut robot = draw::bare(rng);
        let shape = draw::convex(rng, 0.06);
        add_shape(&mut robot, 0, Isometry3::identity(), shape);
        let resolution = rng.uniform(0.008, 0.03);
        let (step, speed) = (rng.uniform(0.15, 0.4), rng.uniform(0.7, 1.5));
        let way = speed * step;
        let x = if through { rng.uniform(0.4, 0.6) * way } else { way + rng.uniform(0.01, 0.1) };
        let high = [1, (0.5 / resolution) as usize, (0.5 / resolution) as usize];
        let origin = [x, -0.5 * resolution * high[1] as f64, 0.05];
        let mut map = VoxelMap::new(resolution, origin, high, Unknown::Free);
        for j in 0..high[1] {
            (0..high[2]).for_each(|k| map.occupy([0, j, k]));
        }
        let curve = rng.uniform(-0.3, 0.3);
        let mut held = vec![(speed, curve, Vec::new())];
        if !through {
            held.push((-speed, curve, Vec::new()));
        }
        let mut case = Case::new(family, robot, Pose2::new(0.0, rng.uniform(-0.1, 0.1), 0.0), &[], step, &held);
        case.map = Some(map);
        case
    };
    let mut case = scene(rng, Family::ThinWall);
    if !through {
        let side = if chance(rng, 0.5) { 1.0 } else { -1.0 };
        return pushed(rng, Family::ThinWall, side, scene);
    }
    case.task.clearance = if chance(rng, 0.5) { 0.0 } else { decades(rng, 1e-6, 0.02) };
    case
}

/// What lies beyond the map is an obstacle.
fn edges(rng: &mut Rng) -> Case {
    let scene = |rng: &mut Rng, family| {
        let robot = draw::robot(rng);
        let (values, step, held) = draw::motion(rng, robot.joints.len());
        let start = draw::start(rng);
        let mut case = Case::new(family, robot, start, &values, step, &held);
        let cells = [rng.integer(8, 24) as usize, rng.integer(8, 24) as usize, 4];
        let origin = [-0.05 * cells[0] as f64, -0.05 * cells[1] as f64, 0.0];
        case.map = Some(VoxelMap::new(0.1, origin, cells, Unknown::Occupied));
        case
    };
    let side = if chance(rng, 0.5) { 1.0 } else { -1.0 };
    pushed(rng, Family::Edges, side, scene)
}

/// A drive without a map.
fn drive(rng: &mut Rng, family: Family) -> Case {
    let robot = draw::robot(rng);
    let (values, step, held) = draw::motion(rng, robot.joints.len());
    let start = draw::start(rng);
    Case::new(family, robot, start, &values, step, &held)
}

/// A limit that is exceeded, or kept, by a millionth or more.
fn limits(rng: &mut Rng) -> Case {
    let mut case = drive(rng, Family::Limits);
    let actuator = one_of(rng, 2 + case.robot.joints.len());
    let radii = case.table.wheel_radii.sides();
    let speeds: Vec<f64> = case
        .table
        .rows
        .iter()
        .map(|row| match actuator {
            0 => row.wheel_left * radii[0],
            1 => row.wheel_right * radii[1],
            joint => row.joint_velocities[joint - 2],
        })
        .collect();
    let step = case.table.sampling_time;
    let at = |k: usize, back: usize| if k >= back { speeds.get(k - back).copied().unwrap_or(0.0) } else { 0.0 };
    let order = one_of(rng, 3);
    let peak = (0..speeds.len() + 2)
        .map(|k| match order {
            0 => at(k, 0),
            1 => (at(k, 0) - at(k, 1)) / step,
            _ => (at(k, 0) - 2.0 * at(k, 1) + at(k, 2)) / (step * step),
        })
        .fold(0.0f64, |most, value| most.max(value.abs()));
    if peak == 0.0 {
        return case;
    }
    let excess = if chance(rng, 0.5) { 1e-6 } else { decades(rng, 1e-7, 1e-2) };
    let factor = if chance(rng, 0.6) { 1.0 - excess } else { 1.0 + excess };
    let mut limit = FREE;
    *[&mut limit.speed, &mut limit.acceleration, &mut limit.jerk][order] = Some(peak * factor);
    match actuator {
        0 | 1 => case.robot.wheel = limit,
        joint => case.robot.joints[joint - 2].limits = limit,
    }
    case
}

/// The last row holds something.
fn rest(rng: &mut Rng) -> Case {
    let mut case = drive(rng, Family::Rest);
    if chance(rng, 0.2) {
        return case;
    }
    let last = case.table.rows.last_mut().expect("a row at rest ends every table");
    let speed = decades(rng, 1e-12, 1.0) * if chance(rng, 0.5) { 1.0 } else { -1.0 };
    match one_of(rng, 3) {
        0 => last.wheel_left = speed,
        1 => (last.wheel_left, last.wheel_right) = (speed, speed),
        _ => match last.joint_velocities.last_mut() {
            Some(rate) => *rate = speed,
            None => last.wheel_right = speed,
        },
    }
    case
}

/// The goal is a little more, or a little less, off than it may be.
fn goal(rng: &mut Rng) -> Case {
    let mut case = drive(rng, Family::Goal);
    let (point, angle) = (1e-3, 0.1f64.to_radians());
    let excess = decades(rng, 1e-6, 1e-1) * if chance(rng, 0.6) { 1.0 } else { -1.0 };
    let goal = &mut case.task.goal;
    match one_of(rng, 4) {
        0 => {
            let (sin, cos) = real::sin_cos(rng.uniform(-3.0, 3.0));
            goal.within = if chance(rng, 0.5) { 0.0 } else { rng.uniform(0.0, 0.1) };
            let off = goal.within.max(point) * (1.0 + excess);
            (goal.x, goal.y) = (goal.x + off * cos, goal.y + off * sin);
        }
        1 => {
            let turns = std::f64::consts::TAU * f64::from(rng.integer(-1, 1));
            goal.yaw = goal.yaw.map(|yaw| yaw + angle * (1.0 + excess) + turns);
        }
        2 => goal.yaw = None,
        _ => {
            let joint = one_of(rng, case.robot.joints.len().max(1));
            if let Some(model) = case.robot.joints.get(joint) {
                let allowed = if model.prismatic { point } else { angle };
                goal.joints[joint] = goal.joints[joint].map(|q| q + allowed * (1.0 + excess));
            }
        }
    }
    case
}

/// Links that pass each other, or touch, by a little.
fn own_links(rng: &mut Rng) -> Case {
    let mut last = drive(rng, Family::OwnLinks);
    for _ in 0..TRIES {
        let mut robot = draw::bare(rng);
        let count = rng.integer(1, 3) as usize;
        add_joints(rng, &mut robot, count);
        for body in 0..robot.bodies.len() {
            let shape = draw::convex(rng, 0.1);
            let at = Isometry3::translation(rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2));
            add_shape(&mut robot, body, at, shape);
        }
        // A ball whose size then decides.
        let body = one_of(rng, robot.bodies.len());
        let at = Isometry3::translation(rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3));
        add_shape(&mut robot, body, at, Convex::Sphere { radius: 0.005 });
        let ball = robot.shapes.len() - 1;
        let mut others = robot.clone();
        others.shapes.truncate(ball);
        let (values, step, held) = draw::motion(rng, count);
        let start = draw::start(rng);
        last = Case::new(Family::OwnLinks, robot, start, &values, step, &held);
        let alone = Case { robot: others, ..last.clone() };
        let rest = least_between_links(&alone, 1e-4);
        let found = least_between_links(&last, 1e-7);
        // Of worth where the ball is nearest.
        if found.lower > 0.0 && found.upper.is_finite() && rest.lower > found.upper {
            let room = 0.5 * (rest.lower - found.upper);
            let delta = decades(rng, PUSH[0], PUSH[1]).min(room);
            let grown = if chance(rng, 0.5) { found.lower - delta } else { found.upper + delta };
            last.robot.shapes[ball].convex = Convex::Sphere { radius: (0.005 + grown).max(1e-4) };
            return last;
        }
    }
    last
}

/// A zone whose corner may reach into the way between two rows.
fn zones(rng: &mut Rng) -> Case {
    let mut case = drive(rng, Family::Zones);
    let row = one_of(rng, case.table.rows.len().saturating_sub(1).max(1));
    let (speed, turn) = case.table.twist(row);
    let tau = rng.uniform(0.0, case.table.sampling_time);
    let at = case.table.rows[row].pose.after_twist(speed, turn, tau);
    // A triangle with its tip to the path, from one side, a little short of it or a little over it.
    let (side, off) = (if chance(rng, 0.5) { 1.0 } else { -1.0 }, decades(rng, 1e-6, 3e-2));
    let off = if chance(rng, 0.5) { off } else { -off };
    let ahead = rng.uniform(-0.5, 0.5);
    let corner = |along: f64, aside: f64| {
        let (sin, cos) = real::sin_cos(at.yaw + ahead);
        [at.x + along * cos - side * aside * sin, at.y + along * sin + side * aside * cos]
    };
    let wide = decades(rng, 0.005, 0.3);
    let polygon = vec![corner(0.0, off), corner(wide, off + 0.3), corner(-wide, off + 0.3)];
    let factor = 1.0 + decades(rng, 1e-6, 0.3) * if chance(rng, 0.7) { -1.0 } else { 1.0 };
    case.zones = vec![SpeedZone { polygon, speed: (speed.abs() * factor).max(1e-3) }];
    case
}

/// A stop on the way: where, for how long, whether at all.
fn stands(rng: &mut Rng) -> Case {
    let robot = draw::robot(rng);
    let count = robot.joints.len();
    let (values, step, mut held) = draw::motion(rng, count);
    let at = one_of(rng, held.len());
    let rows = rng.integer(0, 4) as usize;
    for _ in 0..rows {
        held.insert(at, (0.0, 0.0, vec![0.0; count]));
    }
    let start = draw::start(rng);
    let mut case = Case::new(Family::Stands, robot, start, &values, step, &held);
    let stood = &case.table.rows[at];
    let mut place = Goal {
        x: stood.pose.x,
        y: stood.pose.y,
        within: 0.0,
        yaw: chance(rng, 0.5).then_some(stood.pose.yaw),
        joints: stood.joint_positions.iter().map(|q| Some(*q)).collect(),
    };
    if chance(rng, 0.5) {
        let excess = decades(rng, 1e-6, 1e-1) * if chance(rng, 0.5) { 1.0 } else { -1.0 };
        place.x += 1e-3 * (1.0 + excess);
    }
    let dwell = rows as f64 * step + if chance(rng, 0.5) { decades(rng, 1e-6, 0.1) } else { -decades(rng, 1e-6, 0.1) };
    case.vias = vec![Via { place, dwell: dwell.max(0.0) }];
    if chance(rng, 0.2) {
        case.vias.push(case.vias[0].clone());
    }
    case
}

/// A table that contradicts itself, its robot's ranges, or its task.
fn table(rng: &mut Rng) -> Case {
    let mut case = drive(rng, Family::Table);
    let excess = decades(rng, 1e-6, 1e-1) * if chance(rng, 0.6) { 1.0 } else { -1.0 };
    let off = 1e-6 * (1.0 + excess) * if chance(rng, 0.5) { 1.0 } else { -1.0 };
    let joints = case.robot.joints.len();
    match one_of(rng, 5) {
        0 => case.table.rows[0].pose.x += off,
        1 => case.table.rows[0].pose.yaw += off,
        2 if joints > 0 => {
            let row = one_of(rng, case.table.rows.len());
            case.table.rows[row].joint_positions[one_of(rng, joints)] += off;
        }
        3 if joints > 0 => {
            let joint = one_of(rng, joints);
            let highest = case.table.rows.iter().map(|r| r.joint_positions[joint]).fold(f64::NEG_INFINITY, f64::max);
            case.robot.joints[joint].upper = highest - excess * 1e-5;
        }
        _ => {
            case.task.reverse = false;
            // Turns on the spot, all but: backwards by about as much as rounding may be.
            let back = rng.uniform(0.5e-6, 1.5e-6);
            let radii = case.table.wheel_radii.sides();
            let rows = case.table.rows.len() - 1;
            for row in &mut case.table.rows[..rows] {
                let turn = 0.5 * (radii[1] * row.wheel_right - radii[0] * row.wheel_left);
                (row.wheel_left, row.wheel_right) = ((-turn - back) / radii[0], (turn - back) / radii[1]);
            }
            let replay = case.table.replay(case.task.start);
            let end = replay[replay.len() - 1];
            (case.task.goal.x, case.task.goal.y, case.task.goal.yaw) = (end.x, end.y, Some(end.yaw));
        }
    }
    case
}
