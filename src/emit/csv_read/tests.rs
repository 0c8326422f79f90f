use super::*;
use crate::emit::{csv::write, samples};
use crate::mission::Sampling;
use proptest::prelude::*;

fn good() -> String {
    write(&samples::table(4, &[("blade", false)]), &samples::header())
}

/// The one fault of a text: code, line (from 1), message.
fn fault(text: &str) -> (&'static str, usize, String) {
    let faults = read("c.csv", text).expect_err("must be refused").0;
    let at = faults[0].at.as_ref().expect("has a place");
    assert_eq!(at.source.name, "c.csv");
    let line = 1 + text[..at.range.start].matches('\n').count();
    (faults[0].code, line, faults[0].message.clone())
}

#[test]
fn a_table_reads_back_as_itself_whatever_the_column_order_and_line_ends() {
    let (table, header) = (samples::table(4, &[("a,b", true), ("blade", false)]), samples::header());
    let text = write(&table, &header);
    assert_eq!(read("c.csv", &text), Ok((table.clone(), header.clone())));
    assert_eq!(read("c.csv", &text.replace('\n', "\r\n")), Ok((table.clone(), header.clone())));
    let table = samples::table(4, &[]);
    let text = write(&table, &header);
    let reversed: String = text
        .lines()
        .map(|l| if l.starts_with('#') { l.to_string() } else { l.rsplit(',').collect::<Vec<_>>().join(",") } + "\n")
        .collect();
    assert_eq!(read("c.csv", &reversed), Ok((table, header)));
}

#[test]
fn a_file_of_another_kind_is_told_in_one_sentence() {
    for text in ["", "a,b\n1,2\n", "# hello\n# there: is\n1,2\n", "\u{feff}# format: trajc.commands/1\n"] {
        let faults = read("c.csv", text).expect_err("foreign").0;
        assert_eq!(faults[0].code, "commands/format", "{text:?}");
    }
    let (code, line, message) = fault(&good().replace("commands/1", "commands/2"));
    assert_eq!((code, line), ("commands/format", 1));
    assert_eq!(message, "format is `trajc.commands/2`, this program reads `trajc.commands/1`");
}

#[test]
fn a_fault_in_the_head_has_its_line() {
    let cases = [
        ("# sampling: mean", "# sampling: average", 6, "must be one of mean, instant, tracked"),
        ("# sampling: mean", "# samplin: mean", 6, "unknown key `samplin`"),
        ("# sampling: mean", "# sampling", 6, "`# key: value`"),
        ("sampling_time_s: 0.1", "sampling_time_s: 0", 5, "must be a number above 0"),
        ("wheel_radius_m: 0.08", "wheel_radius_m: NaN", 7, "must be a number above 0"),
        ("# track_width_m: 0.32\n", "", 1, "no `# track_width_m: …`"),
        ("# sampling: mean", "# robot: x", 6, "`robot` is given twice"),
    ];
    for (from, to, wanted, part) in cases {
        let (_, line, message) = fault(&good().replace(from, to));
        assert!(line == wanted && message.contains(part), "{to}: line {line}: {message}");
    }
}

#[test]
fn columns_must_be_all_there_once_and_known() {
    let cases = [
        ("v_mps,", "v_mps2,", "unknown column `v_mps2`"),
        ("v_mps,", "x_m,", "column `x_m` is there twice"),
        ("joint.blade.vel_rad_s,", "joint.blade.vel_mps,", "without `joint.blade.vel_rad_s`"),
        ("joint.blade.pos_rad,", "joint.blade.pos_deg,", "unknown column `joint.blade.pos_deg`"),
        ("joint.blade.pos_rad,", "joint..pos_rad,", "unknown column `joint..pos_rad`"),
        ("yaw_rad", "yaw", "unknown column `yaw`"),
    ];
    for (from, to, part) in cases {
        let (code, line, message) = fault(&good().replace(from, to));
        assert!(code == "commands/column" && line == 10 && message.contains(part), "{to}: line {line}: {message}");
    }
    let cut: String = good().lines().take(9).map(|l| format!("{l}\n")).collect();
    assert_eq!(fault(&cut).0, "commands/no-columns");
    let cut: String = good().lines().take(10).map(|l| format!("{l}\n")).collect();
    assert_eq!(fault(&cut).0, "commands/no-rows");
}

#[test]
fn a_faulty_row_has_its_line() {
    let good = good();
    let row = good.lines().nth(12).expect("third row").to_string();
    let change = |to: &str| fault(&good.replace(&row, to));
    let cells: Vec<&str> = row.split(',').collect();
    let with = |at: usize, cell: &str| {
        let mut cells = cells.clone();
        cells[at] = cell;
        cells.join(",")
    };
    let cases = [
        (cells[..5].join(","), "commands/row", "5 cells, the header 10"),
        (format!("{row},1"), "commands/row", "11 cells"),
        (with(1, "inf"), "commands/number", "`inf` is no finite number"),
        (with(2, "NaN"), "commands/number", "`NaN`"),
        (with(9, ""), "commands/number", "``"),
        (with(9, "1e999"), "commands/number", "`1e999`"),
        (with(0, "0.1"), "commands/time", "does not increase"),
        (with(0, "0.21"), "commands/time", "is at 0.2 s"),
        (with(3, "1"), "commands/contradiction", "v_mps is 1, but the wheels"),
        (with(4, "1"), "commands/contradiction", "omega_rad_s is 1"),
    ];
    for (to, wanted, part) in cases {
        let (code, line, message) = change(&to);
        assert!(code == wanted && line == 13 && message.contains(part), "{to}: line {line}: {code}: {message}");
    }
}

#[test]
fn a_file_full_of_faults_reports_a_dozen() {
    let text = write(&samples::table(500, &[]), &samples::header()).replace("0.1,", "x,").replace("0.2,", "y,");
    let text: String = text
        .lines()
        .map(|l| if l.starts_with(|c: char| c.is_ascii_digit()) { "z\n".into() } else { format!("{l}\n") })
        .collect();
    assert_eq!(read("c.csv", &text).expect_err("faulty").0.len(), FAULTS);
}

fn any_table() -> impl Strategy<Value = CommandTable> {
    let value = || prop_oneof![-1e9..1e9, -1.0..1.0, Just(0.0), -1e-300..1e-300];
    let joints = proptest::collection::vec(("[a-z,\"._ ]{0,6}[a-z]", any::<bool>()), 0..4);
    joints.prop_flat_map(move |mut joints| {
        let mut seen = std::collections::BTreeSet::new();
        joints.retain(|(name, _)| seen.insert(name.clone()));
        let n = joints.len();
        let list = move || proptest::collection::vec(value(), n);
        let row =
            (value(), value(), list(), list(), (value(), value(), value())).prop_map(|(l, r, p, v, (x, y, yaw))| {
                CommandRow {
                    wheel_left: l,
                    wheel_right: r,
                    joint_positions: p,
                    joint_velocities: v,
                    pose: Pose2::new(x, y, yaw),
                }
            });
        let rows = proptest::collection::vec(row, 1..6);
        let radii = (1e-3..1.0, proptest::option::of(-0.1..0.1));
        (rows, 1e-4..10.0, radii, 0.01..2.0, 0usize..3).prop_map(move |(rows, dt, (mean, larger), track, sampling)| {
            CommandTable {
                sampling_time: dt,
                sampling: [Sampling::Mean, Sampling::Instant, Sampling::Tracked][sampling],
                wheel_radii: WheelRadii { mean, difference: larger.unwrap_or(0.0) },
                track_width: track,
                joints: joints.clone(),
                rows,
            }
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_table_reads_back_exactly(table in any_table(), mission in "[a-z/ .:#]{0,9}", map in proptest::option::of("[a-z]{1,5}")) {
        let mission = mission.trim().to_string();
        let header = CsvHeader { mission, map, ..samples::header() };
        prop_assert_eq!(read("c.csv", &write(&table, &header)), Ok((table, header)));
    }

    #[test]
    fn no_text_makes_it_panic(text in "\\PC{0,200}", cut in 0usize..700) {
        let _ = read("c.csv", &text);
        let good = good();
        let at = (0..=cut.min(good.len())).rev().find(|i| good.is_char_boundary(*i)).unwrap_or(0);
        let _ = read("c.csv", &format!("{}{text}", &good[..at]));
    }
}
