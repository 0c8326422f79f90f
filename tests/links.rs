//! Goals of a link, from the mission to the commands: where the hand really ends, by the URDF's numbers alone.

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use trajc::command::CommandTable;
use trajc::inputs;
use trajc::mission::LinkSpec;
use trajc::pipeline::{self, CompileOptions, Inputs, Outcome};

const FOLDER: &str = env!("CARGO_MANIFEST_DIR");

fn reach() -> Inputs {
    let path = std::path::Path::new(FOLDER).join("missions/arm7_reach.yaml");
    inputs::read(&path).expect("shipped").0
}

fn compile(inputs: &mut Inputs) -> Outcome {
    pipeline::compile(inputs, &CompileOptions::default(), &mut |_| {})
}

/// map <- hand after the last row, joint after joint as the URDF has them.
fn hand(table: &CommandTable) -> Isometry3<f64> {
    let robot = urdf_rs::read_file(format!("{FOLDER}/robots/arm7/arm7.urdf")).expect("shipped");
    let base = *table.replay(table.rows[0].pose).last().expect("rows");
    let values = &table.rows[table.rows.len() - 1].joint_positions;
    let mut frame = base.isometry();
    let mut link = "base_link".to_owned();
    while link != "hand" {
        let moving = |joint: &&urdf_rs::Joint| joint.parent.link == link && joint.name.starts_with("joint_");
        let joint = robot.joints.iter().find(moving).expect("a chain");
        let ([x, y, z], [roll, pitch, yaw]) = (*joint.origin.xyz, *joint.origin.rpy);
        let origin =
            Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw));
        let index = table.joints.iter().position(|(name, _)| *name == joint.name).expect("it moves");
        let axis = Unit::new_normalize(Vector3::from(*joint.axis.xyz));
        frame = frame * origin * UnitQuaternion::from_axis_angle(&axis, values[index]);
        link.clone_from(&joint.child.link);
    }
    frame
}

/// The hand is at its place, level, towards the wall; certified, and by the URDF.
fn assert_there(outcome: &Outcome, asked: &LinkSpec) {
    let Some(compiled) = &outcome.compiled else { panic!("{:?}", outcome.diagnostics) };
    let end = compiled.certificate.link_end.as_ref().expect("asked for");
    let frame = hand(&compiled.commands);
    let off = (frame.translation.vector - Vector3::from(asked.position)).norm();
    assert!(off <= asked.within && (off - end.point_error).abs() < 1e-9, "{off} {end:?}");
    if asked.rpy.is_some() {
        let ahead = frame.rotation * Vector3::z();
        assert!((ahead - Vector3::y()).norm() < 1f64.to_radians(), "{ahead}");
    }
}

#[test]
fn the_hand_comes_to_its_place_and_a_base_that_stands_elsewhere_is_refused() {
    let mut inputs = reach();
    let asked = inputs.mission.goal.clone().expect("written").link.expect("a link's");
    let outcome = compile(&mut inputs);
    assert_there(&outcome, &asked);
    let table = &outcome.compiled.as_ref().expect("certified").commands;
    let world = pipeline::world(&mut inputs).expect("shipped");
    let judged = |inputs: &Inputs| pipeline::check(inputs, &world, table).expect("its own robot");
    assert!(judged(&inputs).holds());
    let goal = inputs.mission.goal.as_mut().and_then(|goal| goal.link.as_mut()).expect("a link's");
    goal.position[2] += 0.011;
    let refusals = judged(&inputs).refusals;
    assert!(refusals.len() == 1 && refusals[0].message.contains("link `hand` ends 11"), "{refusals:?}");
}

#[test]
fn a_stop_on_the_way_and_joints_and_a_heading_that_are_asked_for_are_kept() {
    let mut inputs = reach();
    let stop = trajc::mission::PoseSpec { x: Some(2.7), y: Some(3.0), ..Default::default() };
    inputs.mission.via = vec![trajc::mission::ViaSpec { place: stop, dwell: 0.0 }];
    let goal = inputs.mission.goal.as_mut().expect("written");
    (goal.yaw, goal.joints) = (Some(1.2), [("joint_7".to_owned(), 0.3)].into());
    let asked = goal.link.as_mut().expect("a link's");
    asked.rpy = None;
    let asked = asked.clone();
    let outcome = compile(&mut inputs);
    assert_there(&outcome, &asked);
    let compiled = outcome.compiled.expect("certified");
    let last = &compiled.commands.rows[compiled.commands.rows.len() - 1];
    assert!((last.joint_positions[6] - 0.3).abs() < 1e-6 && compiled.certificate.vias.len() == 1);
    assert!(compiled.certificate.end_heading_error.is_some_and(|off| off < 1e-3));
}
