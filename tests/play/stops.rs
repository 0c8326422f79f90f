//! Shipped missions, cut anywhere: what was played and the stop are a command file that is certified like any other.

use trajc::certify::{Goal, Task, certify};
use trajc::command::CommandTable;
use trajc::inputs;
use trajc::pipeline;
use trajc::play::Motion;
use trajc::play::pace::{self, Limits};

use super::*;

/// What a stop may leave the planned path by to the side, m. The file's own arcs are polygons in heading; a stop rounds their corners.
const ASIDE: f64 = 0.5e-3;

#[test]
fn a_mission_that_is_cut_keeps_its_limits_and_its_clearance() {
    for (name, every) in [("first", 3), ("barn_29", 11), ("s_curve", 7)] {
        let path = sandbox::repository().join(format!("missions/{name}.yaml"));
        let (mut inputs, _) = inputs::read(&path).expect("shipped");
        let compiled = pipeline::compile(&mut inputs, &Default::default(), &mut |_| {}).compiled.expect("certified");
        let world = pipeline::world(&mut inputs).expect("shipped");
        let motion = Motion::new(compiled.commands);
        let limits = Limits::new(&compiled.robot, &motion);
        let table = motion.table();
        let start = table.rows[0].pose;
        for at in (0..table.rows.len()).step_by(every) {
            let stop = pace::stop(&motion, at, &limits);
            let rows = table.rows[..at].iter().chain(&stop.rows).cloned().collect();
            let cut = CommandTable { rows, ..table.clone() };
            let end = cut.replay(start).pop().expect("rows");
            let open = vec![None; compiled.robot.joints.len()];
            let task = Task {
                start,
                start_joints: table.rows[0].joint_positions.clone(),
                goal: Goal { x: end.x, y: end.y, within: 0.0, yaw: None, joints: open },
                clearance: inputs.mission.clearance - ASIDE,
                reverse: inputs.mission.reverse,
            };
            let certificate = certify(&cut, &compiled.robot, world.map.as_deref(), &task);
            assert!(certificate.holds(), "{name}, cut at row {at}: {:?}", certificate.refusals);
        }
    }
}
