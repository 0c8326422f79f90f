use proptest::prelude::*;

use super::*;

#[test]
fn frames_are_those_of_the_protocols_table() {
    assert_eq!((mode_frame().id, mode_frame().bytes()), (0x421, &[0x01][..]));
    let motion = |v, w| motion_frame([v, w]);
    assert_eq!(motion(0, 0), Frame { id: 0x111, data: [0; 8], length: 8 });
    assert_eq!(motion(1500, -300).bytes(), [0x05, 0xdc, 0xfe, 0xd4, 0, 0, 0, 0]);
    assert_eq!(motion(-1, 1).bytes(), [0xff, 0xff, 0x00, 0x01, 0, 0, 0, 0]);
    assert_eq!(motion(i16::MAX, i16::MIN).bytes(), [0x7f, 0xff, 0x80, 0x00, 0, 0, 0, 0]);
}

#[test]
fn the_state_of_a_base_is_read_and_told_in_words() {
    let frame = |id, data: [u8; 8], length| Frame { id, data, length };
    let state = State::of(&frame(0x211, [0, 1, 0, 252, 0, 0, 0, 7], 8)).expect("a state");
    assert_eq!(state, State { vehicle: 0, mode: BY_CAN, faults: 0 });
    assert_eq!(state.trouble(), None);
    let stopped = State::of(&frame(0x211, [1, 0, 0, 0, 4, 0, 0, 0], 8)).and_then(|s| s.trouble());
    assert_eq!(stopped.as_deref(), Some("its emergency stop is pressed (remote control lost)"));
    assert_eq!(State::of(&frame(0x221, [0; 8], 8)), None);
    assert_eq!(State::of(&frame(0x211, [0; 8], 3)), None);
}

/// Sum of what is held, and of the frames sent on the grid, up to each frame: in units times a frame.
fn sums(rows: &[[f64; 2]], hold: f64) -> (f64, [i16; 2]) {
    let mut diffuser = Diffuser::default();
    let (mut worst, mut row, mut frame) = (0.0f64, 0, 0);
    let (mut sent_sum, mut last) = ([0.0; 2], [0; 2]);
    let travelled = |t: f64, axis: usize| {
        let whole = ((t / hold + 1e-9) as usize).min(rows.len());
        let part = rows.get(whole).map_or(0.0, |r| r[axis] * (t - whole as f64 * hold));
        rows[..whole].iter().map(|r| r[axis] * hold).sum::<f64>() + part
    };
    while (frame as f64 + 1.0) * FRAME_TIME <= rows.len() as f64 * hold {
        let (row_at, frame_at) = (row as f64 * hold, frame as f64 * FRAME_TIME);
        if row < rows.len() && row_at <= frame_at + 1e-9 {
            diffuser.hold(row_at, rows[row]);
            row += 1;
            continue;
        }
        last = diffuser.frame(frame_at, rows.get(row).map(|held| (row_at, *held)));
        frame += 1;
        for axis in 0..2 {
            sent_sum[axis] += f64::from(last[axis]) * UNIT * FRAME_TIME;
            let off = sent_sum[axis] - travelled(frame as f64 * FRAME_TIME, axis);
            worst = worst.max(off.abs() / (UNIT * FRAME_TIME));
        }
    }
    (worst, last)
}

proptest! {
    #[test]
    fn what_is_sent_stays_within_half_a_unit_of_what_is_commanded(
        rows in prop::collection::vec([0.01..1.5f64, 0.01..2.0f64], 1..60),
        hold in prop_oneof![Just(0.1), Just(0.02), Just(0.05), Just(0.03), Just(0.141)],
    ) {
        let (worst, _) = sums(&rows, hold);
        prop_assert!(worst <= 0.5 + 1e-6, "{worst} units");
    }
}

#[test]
fn rounding_is_carried_on_and_zero_is_zero() {
    // 0.3 mm/s for a second is 0.3 mm: a third of the frames say 1 mm/s.
    let rows: Vec<[f64; 2]> = (0..10).map(|_| [0.0003, 0.0]).collect();
    assert!(sums(&rows, 0.1).0 <= 0.5 + 1e-9);
    let stopped: Vec<[f64; 2]> = vec![[0.0304, 0.7777], [0.0, 0.0], [0.0, 0.0]];
    assert_eq!(sums(&stopped, 0.1).1, [0, 0]);
}
