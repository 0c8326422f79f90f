use super::*;
use crate::emit::mcap::attached;
use crate::emit::mcap::tests::{MISSION, REPORT, URDF, file};
use crate::emit::{csv, samples};
use ::mcap::records::{MessageHeader, Record, op};
use ::mcap::{Attachment, Compression, WriteOptions, Writer};
use nalgebra::Isometry3;
use std::io::Cursor;

fn good() -> Vec<u8> {
    file(&samples::table(20, &[("blade", false), ("lift", true)]), Isometry3::identity(), &[])
}

fn code(bytes: &[u8]) -> &'static str {
    read("c.mcap", bytes).expect_err("must be refused").0[0].code
}

fn assert_same(found: &CommandTable, wanted: &CommandTable) {
    let numbers = |t: &CommandTable| -> Vec<f64> {
        let row = |r: &CommandRow| {
            let mut all = vec![r.wheel_left, r.wheel_right, r.pose.x, r.pose.y, r.pose.yaw];
            all.extend(r.joint_positions.iter().chain(&r.joint_velocities));
            all
        };
        t.rows.iter().flat_map(row).collect()
    };
    assert_eq!(CommandTable { rows: Vec::new(), ..found.clone() }, CommandTable { rows: Vec::new(), ..wanted.clone() });
    let (found, wanted) = (numbers(found), numbers(wanted));
    assert_eq!(found.len(), wanted.len());
    for (a, b) in found.iter().zip(&wanted) {
        assert!((a - b).abs() <= 1e-12, "{a} is not {b}");
    }
}

/// The file written anew, each message and attachment changed, or left out where the change says so.
fn rewritten(
    bytes: &[u8],
    compression: Option<Compression>,
    mut change: impl FnMut(&str, &mut u64, &mut Vec<u8>) -> bool,
) -> Vec<u8> {
    let options = WriteOptions::new().profile("ros2").library("test").compression(compression).compression_threads(0);
    let mut writer = Writer::with_options(Cursor::new(Vec::new()), options).expect("memory");
    for record in ::mcap::read::ChunkFlattener::new(bytes).expect("good") {
        if let Record::Metadata(metadata) = record.expect("good") {
            writer.write_metadata(&metadata).expect("memory");
        }
    }
    for message in ::mcap::MessageStream::new(bytes).expect("good") {
        let message = message.expect("good");
        let (mut stamp, mut data) = (message.log_time, message.data.to_vec());
        let schema = message.channel.schema.as_ref().expect("ours have");
        let id = writer.add_schema(&schema.name, &schema.encoding, &schema.data).expect("memory");
        let metadata = &message.channel.metadata;
        let channel_id = writer.add_channel(id, &message.channel.topic, "cdr", metadata).expect("memory");
        if change(&message.channel.topic, &mut stamp, &mut data) {
            let header = MessageHeader { channel_id, sequence: 0, log_time: stamp, publish_time: stamp };
            writer.write_to_known_channel(&header, &data).expect("memory");
        }
    }
    writer.finish().expect("memory");
    writer.into_inner().into_inner()
}

/// What is said of a file in which message `row` of a topic is changed.
fn fault(topic: &str, row: usize, change: impl Fn(&mut u64, &mut Vec<u8>) -> bool) -> String {
    let mut seen = 0;
    let bytes = rewritten(&good(), None, |name, stamp, data| {
        seen += usize::from(name == topic);
        if name == topic && seen == row + 1 { change(stamp, data) } else { true }
    });
    read("c.mcap", &bytes).expect_err("changed").0[0].message.clone()
}

#[test]
fn commands_read_back_as_the_csv_has_them_with_whole_turns() {
    for joints in [&[("blade", false), ("lift", true)][..], &[]] {
        let mut table = samples::table(300, joints);
        // A start heading beyond two turns: a quaternion does not know that.
        table.rows.iter_mut().for_each(|row| row.pose.yaw += 20.0);
        assert!(table.rows[299].pose.yaw - table.rows[0].pose.yaw > 2.0, "turns in all");
        let pose = Isometry3::translation(0.03, 0.0, 0.08);
        let found = read("c.mcap", &file(&table, pose, &[])).expect("ours");
        let (from_csv, header) = csv::read("c.csv", &csv::write(&table, &samples::header())).expect("ours");
        assert_same(&found.table, &from_csv);
        assert_eq!(found.header, header);
    }
}

#[test]
fn attachments_come_back_byte_by_byte() {
    let meshes = [("package://r/a b.STL".to_string(), vec![0, 255, 7])];
    let found = read("c.mcap", &file(&samples::table(3, &[]), Isometry3::identity(), &meshes)).expect("ours");
    assert_eq!(found.attachment(attached::MISSION), Some(MISSION.as_bytes()));
    assert_eq!(found.attachment(attached::URDF), Some(URDF.as_bytes()));
    assert_eq!(found.attachment(attached::REPORT), Some(REPORT.as_bytes()));
    assert_eq!(found.attachment("meshes/package://r/a b.STL"), Some(&[0, 255, 7][..]));
    assert_eq!(found.attachment("nothing"), None);
    assert_eq!(found.attachments[0].media_type, "application/yaml");
}

#[test]
fn a_file_written_anew_by_another_tool_is_still_read() {
    let table = samples::table(20, &[("blade", false), ("lift", true)]);
    for compression in [None, Some(Compression::Zstd)] {
        let bytes = rewritten(&good(), compression, |_, _, _| true);
        assert_same(&read("c.mcap", &bytes).expect("same content").table, &table);
    }
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    let good = good();
    assert_eq!(code(&[]), "commands/not-mcap");
    assert_eq!(code(b"time_s,wheel_left_rad_s\n0,0\n"), "commands/not-mcap");
    for at in (8..good.len()).step_by(97).chain([good.len() - 1, good.len() - 8]) {
        let code = code(&good[..at]);
        assert!(matches!(code, "commands/cut-short" | "commands/damaged"), "cut at {at}: {code}");
    }
}

#[test]
fn no_flipped_bit_goes_unseen() {
    // Neither does one make the reader panic, whatever length it lies about.
    let good = good();
    let whole = read("c.mcap", &good).expect("good");
    for at in (0..good.len()).step_by(7) {
        let mut bytes = good.clone();
        bytes[at] ^= 1 << (at % 8);
        if let Ok(found) = read("c.mcap", &bytes) {
            assert_eq!(found, whole, "byte {at}: read as something else");
        }
    }
}

#[test]
fn lengths_that_lie_behind_right_checksums_are_refused() {
    let good = rewritten(&good(), None, |_, _, _| true);
    // The chunk is the first record with that opcode behind the head; all its checksums are set to «none».
    let mut at = 8;
    while good[at] != op::CHUNK {
        at += 9 + u64::from_le_bytes(good[at + 1..at + 9].try_into().expect("8")) as usize;
    }
    let first = at + 9 + 8 + 8 + 8 + 4 + 4 + 8;
    let mut bytes = good.clone();
    bytes[at + 9 + 24..at + 9 + 28].fill(0);
    bytes[first + 1..first + 9].copy_from_slice(&u64::MAX.to_le_bytes());
    assert_eq!(code(&bytes), "commands/damaged");
    let mut writer = Writer::new(Cursor::new(Vec::new())).expect("memory");
    let (name, media_type) = ("a".to_string(), "b".to_string());
    writer.attach(&Attachment { log_time: 1, create_time: 1, name, media_type, data: vec![1].into() }).expect("memory");
    writer.finish().expect("memory");
    let file = writer.into_inner().into_inner();
    let at = file.windows(2).position(|w| w == [op::ATTACHMENT, 39]).expect("an attachment of 39 bytes");
    for length in 0..39u64 {
        let mut bytes = file[..at + 1].to_vec();
        bytes.extend(length.to_le_bytes());
        bytes.extend(&file[at + 9..at + 9 + length as usize]);
        bytes.extend(&file[at + 9 + 39..]);
        assert!(read("c.mcap", &bytes).is_err(), "{length}");
    }
}

#[test]
fn a_bag_of_something_else_is_told_apart() {
    let mut writer = Writer::new(Cursor::new(Vec::new())).expect("memory");
    writer.finish().expect("memory");
    let faults = read("bag.mcap", &writer.into_inner().into_inner()).expect_err("foreign").0;
    assert_eq!((faults[0].code, faults[0].file.as_deref()), ("commands/foreign", Some("bag.mcap")));
}

#[test]
fn topics_that_contradict_each_other_are_refused() {
    let cut = |_: &mut u64, data: &mut Vec<u8>| {
        data.truncate(data.len() - 8);
        true
    };
    let cases = [
        (fault(topic::WHEELS, 3, |_, _| false), "/wheel_velocity_controller/commands has 19 messages, must have 20"),
        (fault(topic::TRAJECTORY, 0, |_, _| false), "joint_trajectory has 0 messages, must have 1"),
        (fault(topic::WHEELS, 3, cut), "message 3: the message is cut short"),
        (fault(topic::TWIST, 4, cut), "/cmd_vel, message 4: the message is cut short"),
    ];
    for (said, part) in cases {
        assert!(said.contains(part), "{said}");
    }
    let set = |from_end: usize, value: f64| {
        move |_: &mut u64, data: &mut Vec<u8>| {
            let at = data.len() - from_end;
            data[at..at + 8].copy_from_slice(&value.to_le_bytes());
            true
        }
    };
    let later = |stamp: &mut u64, _: &mut Vec<u8>| {
        *stamp += 1000;
        true
    };
    let cases = [
        (fault(topic::TWIST, 2, set(8, 0.5)), "/cmd_vel, message 2: the turn rate (rad/s) is 0.5"),
        (fault(topic::TWIST, 2, set(40, 0.5)), "what no differential drive can do is 0.5"),
        (fault(topic::WHEELS, 2, set(8, 0.5)), "/cmd_vel, message 2: the speed (m/s)"),
        (fault(topic::WHEELS, 2, set(8, f64::NAN)), "a number is not finite"),
        (fault(topic::TRANSFORMS, 2, set(8, 0.5)), "no unit quaternion about z"),
        (fault(topic::TRAJECTORY, 0, set(8, 0.5)), "a point's time (s)"),
        (fault(topic::JOINTS, 5, later), "/joint_states, message 5: log time (s)"),
    ];
    for (said, part) in cases {
        assert!(said.contains(part), "{said}");
    }
}
