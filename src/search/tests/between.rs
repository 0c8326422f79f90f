//! Obstacles between two postures that are free both.

use super::*;
use crate::math::halton;
use crate::search::collide::Collider;
use crate::search::joint_space::between;
use crate::search::posture::Postures;

const CLEARANCE: f64 = 0.02;

/// Quick enough to jump over a post between two looks at the joints.
fn quick_arm() -> RobotModel {
    let mut robot = arm(4);
    robot.joints.iter_mut().for_each(|joint| joint.limits.speed = Some(8.0));
    robot
}

fn room(posts: &[[usize; 3]]) -> VoxelMap {
    let mut map = VoxelMap::new(0.05, [0.0; 3], [60, 40, 24], Unknown::Free);
    for [i, j, height] in posts {
        // From under a ceiling: the base passes.
        (6 + height..24).for_each(|k| map.occupy([*i, *j, k]));
    }
    map
}

fn asked(joints: &[f64]) -> Vec<Option<f64>> {
    joints.iter().copied().map(Some).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn a_way_between_two_postures_clears_where_every_posture_on_it_does(
        posts in prop::collection::vec((4usize..28, 8usize..32, 0usize..10).prop_map(|(i, j, k)| [i, j, k]), 1..12),
        from in prop::array::uniform4(-1.5f64..1.5), by in prop::array::uniform4(-0.8f64..0.8), yaw in -3.0f64..3.0,
    ) {
        let (robot, map) = (quick_arm(), room(&posts));
        let to: Vec<f64> = from.iter().zip(by).map(|(q, by)| q + by).collect();
        let pose = Pose2::new(0.8, 1.0, yaw);
        let query = Query {
            start: pose, start_joints: asked(&from), goal: pose, goal_within: 0.0, goal_yaw: None, goal_joints: vec![None; 4],
        };
        let field = crate::esdf::build(&map);
        let collider = Collider::<4>::new(&robot, &field, &map, CLEARANCE, Postures::new(&robot, &query, 0));
        let base = distance(&map, &robot_without_arm(&robot), pose, &[0.0; 4]);
        prop_assume!(base > 0.1);
        let looks = 1..=400;
        let least = looks.map(|k| distance(&map, &robot, pose, &between(&from, &to, f64::from(k) / 400.0)));
        let least = least.fold(f64::INFINITY, f64::min).min(base);
        let clears = collider.clears(pose)(&from, &to);
        // Between two looks nothing moves farther than 2 cm.
        if clears {
            prop_assert!(least > CLEARANCE - 0.011, "{least}");
        } else {
            prop_assert!(least < CLEARANCE + 1e-3, "{least}");
        }
    }
}

fn robot_without_arm(robot: &RobotModel) -> RobotModel {
    let mut base = robot.clone();
    base.shapes.retain(|shape| shape.body == 0);
    base
}

#[test]
fn joints_take_ways_that_are_free_between_the_postures_that_were_sampled() {
    let robot = quick_arm();
    let mut found = 0;
    for index in 1..=100 {
        let v = |axis: usize| halton::value(axis, index);
        let up_to = |many: f64, axis: usize| (many * v(axis)) as usize;
        let posts: Vec<[usize; 3]> =
            (0..6).map(|k| [4 + up_to(24.0, k), 8 + up_to(24.0, k + 6), up_to(10.0, k + 3)]).collect();
        let map = room(&posts);
        let joints: Vec<f64> = (0..4).map(|k| -1.5 + 3.0 * v(k + 2)).collect();
        let query = Query { start_joints: asked(&joints), goal_joints: vec![None; 4], ..across(None) };
        // Where nothing else is found the certificate judges: in none of these rooms.
        if let Ok(path) = find(&map, &robot, &query, CLEARANCE) {
            found += 1;
            let least = distance_along(&map, &robot, &path, 60);
            assert!(least > CLEARANCE - 0.011, "room {index}: {least}");
        }
    }
    assert!(found > 50, "{found}");
}
