//! What came out, as text.

use super::super::text_table::{TextTable, fixed};
use super::{Curve, Figures, Held, How, Judged, MISSED, Row};
use crate::report::names;
use crate::retime::printed::Printed;
use crate::robot::RobotModel;

/// One table a curve: a row for every way to drive it, beside the independent optimum and what the paper says.
pub fn table(judged: &[Judged], robot: &RobotModel, held: Held) -> String {
    let mut text = format!(
        "Curves of [CONV] section 3, and tighter ones: wheel radius {} m, track {} m, commands held for {} s\n\n",
        robot.wheel_radii.mean, robot.track_width, held.sampling_time
    );
    for one in judged {
        text += &of_curve(one, robot);
        text.push('\n');
    }
    text += &format!(
        "  Peaks: of both wheels, as written: differences of held speeds. * over the limit, or the end point missed by more than {} mm.\n",
        1e3 * MISSED
    );
    text +=
        "  Clipped: a robot that clips each wheel's speed at its limit and follows the commands exactly otherwise.\n";
    text += "  Over: the law's own time against the optimum of an independent solver (speed, acceleration and jerk; toppra: without jerk).\n";
    text += &format!(
        "  To the letter: as the paper has it, limits broken, sampled `instant`. Compiled: slowed down until they hold, certified, `{}`.\n",
        names::sampling(held.sampling)
    );
    text += "  Paper: it says in words who misses the end point; it prints no time, peak or distance, and of its control points the ends.\n";
    text
}

fn of_curve(judged: &Judged, robot: &RobotModel) -> String {
    let Curve { title, length, least_radius, optimum, lower_bound, .. } = &judged.curve;
    let head =
        ["", "time s", "over %", "optimum s", "toppra s", "rows s", "m/s ", "m/s² ", "m/s³ ", "end mm ", "clipped mm "];
    let title = format!("{title}, {length:.3} m, least radius {least_radius:.3} m");
    let mut table = TextTable::new(title, &head);
    let limits = [robot.wheel.speed, robot.wheel.acceleration, robot.wheel.jerk];
    let blank = || std::iter::repeat_n(String::new(), 5);
    table.row("limit", blank().chain(limits.map(|l| fixed(l.unwrap_or(f64::NAN), 4) + " ")));
    if let Some([without, with]) = judged.curve.paper {
        let says = |what: &str| blank().chain(std::iter::repeat_n(String::new(), 4)).chain([what.to_owned()]);
        table.row(format!("paper, without Eq. 5 ({without})"), says("missed "));
        table.row(format!("paper, with Eq. 5 ({with})"), says("reached "));
    }
    for row in &judged.rows {
        match &row.outcome {
            Err(reason) => table.remark(name(row), format!("refused: {reason}")),
            Ok(figures) => {
                let mut cells = vec![fixed(figures.time, 3), fixed(100.0 * (figures.time / optimum - 1.0), 2)];
                cells.extend([fixed(*optimum, 3), fixed(*lower_bound, 3), fixed(figures.table.duration(), 1)]);
                cells.extend(peaks(figures, robot));
                for miss in [figures.followed, figures.clipped] {
                    cells.push(marked(fixed(1e3 * miss.distance, 3), miss.distance > MISSED));
                }
                table.row(name(row), cells);
            }
        }
    }
    table.render()
}

fn peaks(figures: &Figures, robot: &RobotModel) -> impl Iterator<Item = String> {
    let over = figures.over(robot);
    figures.peaks.into_iter().zip(over).map(|(peak, over)| marked(fixed(peak, 4), over))
}

/// With a star, or a space in its place.
fn marked(text: String, mark: bool) -> String {
    text + if mark { "*" } else { " " }
}

/// As its row is called.
pub(super) fn name(row: &Row) -> String {
    match (row.how, &row.outcome) {
        (How::Paper(Printed { eq2, eq5 }), _) => match (eq2, eq5) {
            (false, false) => "uncompensated".into(),
            (true, false) => "uncompensated, Eq. 2".into(),
            (false, true) => "Eq. 5, to the letter".into(),
            (true, true) => "Eq. 2 and 5, to the letter".into(),
        },
        (how @ How::Compiled(_), Ok(figures)) if !figures.taken.is_empty() => {
            format!("compiled, {} ({})", how.key(), figures.taken)
        }
        (how @ How::Compiled(_), _) => format!("compiled, {}", how.key()),
    }
}
