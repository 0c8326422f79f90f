//! What goes out on which topic, by a transport that keeps it.

use std::cell::RefCell;
use std::rc::Rc;

use super::*;
use crate::emit::cdr::Reader;
use crate::play::clock::SimulatedClock;
use crate::play::fixtures::{ready, smooth, table, tight_robot};
use crate::play::{Play, play};

/// Index of a topic, and a message.
type Message = (usize, Vec<u8>);
type Sent = Rc<RefCell<Vec<Message>>>;

/// Keeps messages; asks again for topic 0 once.
struct Kept {
    sent: Sent,
    asks: bool,
}

impl Transport for Kept {
    fn ready(&mut self, _interrupted: &dyn Fn() -> bool) -> Result<(), SinkError> {
        Ok(())
    }

    fn publish(&mut self, topic: usize, message: &[u8], _stamp: u64) -> Result<(), SinkError> {
        self.sent.borrow_mut().push((topic, message.to_vec()));
        Ok(())
    }

    fn asked_again(&mut self) -> Vec<usize> {
        if std::mem::take(&mut self.asks) { vec![0] } else { Vec::new() }
    }

    fn alive(&mut self) -> Result<(), SinkError> {
        Ok(())
    }
}

/// Times of the points of a joint trajectory, s.
fn point_times(message: &[u8]) -> Vec<f64> {
    let mut r = Reader::new(message).expect("CDR");
    let seconds = |r: &mut Reader<'_>| Ok(f64::from(r.i32()?) + 1e-9 * f64::from(r.u32()?));
    seconds(&mut r).expect("a stamp");
    r.string().expect("a frame");
    r.sequence(|r| r.string()).expect("names");
    let points = r.sequence(|r| {
        (0..4).try_for_each(|_| r.f64s().map(|_| ()))?;
        seconds(r)
    });
    points.expect("points")
}

fn run(hold: f64, requests: impl Fn(usize) -> usize) -> (Vec<Topic>, Vec<Message>, usize) {
    let speeds = [smooth(&[3.0, 2.0], 20, [6, 4]), smooth(&[3.0, 2.5], 20, [6, 4]), smooth(&[0.3, -0.3], 20, [6, 4])];
    let table = table(&speeds, hold);
    let robot = tight_robot(&table);
    let (motion, limits) = ready(table.clone());
    let topics = topics(&table, &Names::default()).expect("all");
    let sent = Sent::default();
    let transport = Kept { sent: sent.clone(), asks: true };
    let mut sink = TopicSink::new(transport, &topics, &robot, "<robot/>", &table);
    let what = Play { motion: &motion, limits: &limits, first_row: 0, file_step: hold };
    let count = sent.clone();
    let mut clock = SimulatedClock::default();
    let outcome = play(&what, &mut sink, &mut clock, &|| requests(count.borrow().len())).expect("ready");
    let sent = sent.borrow().clone();
    (topics, sent, outcome.sent)
}

#[test]
fn each_command_goes_out_on_its_four_topics_and_what_is_sent_once_before() {
    let (topics, sent, rows) = run(0.1, |_| 0);
    let of = |content| topics.iter().position(|t| t.content == content).expect("a topic");
    let count = |content| sent.iter().filter(|(topic, _)| *topic == of(content)).count();
    assert_eq!(count(Content::Description), 2, "again for who came late");
    assert_eq!((count(Content::Plan), count(Content::Trajectory)), (1, 1));
    for content in [Content::Twist, Content::WheelSpeeds, Content::JointStates, Content::Transforms] {
        assert_eq!(count(content), rows, "{content:?}");
    }
    let first_twist = sent.iter().position(|(topic, _)| *topic == of(Content::Twist)).expect("twists");
    assert_eq!(first_twist, 3);
}

#[test]
fn a_stop_replaces_the_joint_trajectory_which_its_controller_plays_alone() {
    let (topics, sent, rows) = run(0.1, |sent| usize::from(sent > 60));
    let trajectory = topics.iter().position(|t| t.content == Content::Trajectory).expect("joints");
    let found: Vec<Vec<f64>> =
        sent.iter().filter(|(topic, _)| *topic == trajectory).map(|(_, message)| point_times(message)).collect();
    let [planned, stop] = &found[..] else { panic!("{} trajectories", found.len()) };
    assert!(stop.len() < rows && rows < planned.len());
    for times in [planned, stop] {
        assert!(times.iter().enumerate().all(|(k, time)| (time - 0.1 * k as f64).abs() < 1e-6), "{times:?}");
    }
}

#[test]
fn rows_that_are_held_for_long_are_sent_again() {
    let (topics, sent, rows) = run(0.5, |_| 0);
    let twist = topics.iter().position(|t| t.content == Content::Twist).expect("twists");
    let twists = sent.iter().filter(|(topic, _)| *topic == twist).count();
    assert!((5 * rows - 5..=5 * rows).contains(&twists), "{twists} twists, {rows} rows");
}

#[test]
fn topics_can_be_chosen_and_renamed() {
    let table = table(&[vec![0.0], vec![0.0]], 0.1);
    let names = |only: &[&str], remapped: &[(&str, &str)]| Names {
        only: only.iter().map(|s| (*s).to_owned()).collect(),
        remapped: remapped.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect(),
    };
    let found = topics(&table, &names(&["/cmd_vel"], &[("/cmd_vel", "/base/cmd_vel")])).expect("one");
    assert_eq!(found.iter().map(|t| t.name.as_str()).collect::<Vec<_>>(), ["/base/cmd_vel"]);
    let all = topics(&table, &Names::default()).expect("all");
    assert_eq!(all.len(), 6, "without joints no trajectory");
    assert_eq!(all[awaited(&all)].name, "/cmd_vel");
    assert!(topics(&table, &names(&["/cmd"], &[])).is_err());
    assert!(topics(&table, &names(&[], &[("/cmd_vel", "cmd")])).is_err());
    assert!(topics(&table, &names(&["/joint_trajectory_controller/joint_trajectory"], &[])).is_err());
}
