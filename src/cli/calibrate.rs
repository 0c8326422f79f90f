//! `trajc calibrate LOG --robot ROBOT.yaml`.

use std::path::PathBuf;

use super::output::write_file;
use super::terminal::Terminal;
use crate::calibrate::{self, BagError, Fit, Log, PoseNoise, RewriteError, Topics};
use crate::diag::{Diagnostic, Diagnostics};
use crate::inputs::{Disk, read_robot_files};
use crate::mission::LimitsSpec;
use crate::robot::{self, DriveJoint, RobotInputs, RobotModel};

/// Wheel radii and track width from a log of wheel angles and poses.
///
/// Writes the mean radius and the track under `drive` of robot.yaml, and what remains uncertain (three standard deviations, and the
/// difference between the wheels) under `tolerance`. All else in the file stays as it is.
///
/// The log is CSV with the columns time_s, wheel_left_rad, wheel_right_rad, x_m, y_m, yaw_rad: angles of the wheels, not wrapped, and poses
/// of the base, on one clock. A row may leave its pose or its wheels empty. Or it is a ROS 2 bag (.mcap): wheel angles in /joint_states, poses
/// in /odom or /tf, which must not be made of those angles. missions/calibrate.yaml is a motion that shows all.
///
/// Exit 0: calibrated. 2: bad input, or a log that does not show radii and track.
#[derive(Debug, clap::Args)]
pub struct CalibrateArgs {
    /// The log (.csv, .mcap).
    log: PathBuf,
    /// The robot.yaml that gets the calibration.
    #[arg(long, value_name = "ROBOT.yaml")]
    robot: PathBuf,
    /// Print what would be written, and write nothing.
    #[arg(long)]
    dry_run: bool,
    /// Bag: the topic with poses (Odometry, PoseStamped, PoseWithCovarianceStamped, TFMessage) [default: /odom or /tf, whichever is there].
    #[arg(long, value_name = "TOPIC")]
    poses: Option<String>,
    /// Bag: the topic with wheel angles (JointState).
    #[arg(long, value_name = "TOPIC", default_value = "/joint_states")]
    wheels: String,
    /// Bag: the frame in /tf that is the base [default: the URDF's root link, else base_footprint, else base_link].
    #[arg(long, value_name = "FRAME")]
    base_frame: Option<String>,
    /// Standard deviation of the poses' coordinates, in metres.
    #[arg(long, value_name = "M", default_value = "0.005", value_parser = positive)]
    noise_m: f64,
    /// Standard deviation of the poses' headings, in radians.
    #[arg(long, value_name = "RAD", default_value = "0.0087", value_parser = positive)]
    noise_rad: f64,
    /// Print the calibration with its covariance as JSON.
    #[arg(long)]
    json: bool,
}

/// Radii and track that differ by less from robot.yaml's do not differ: no real log is so good.
const NOTHING: f64 = 1e-7;

fn positive(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|v| (1e-9..=1e3).contains(v))
        .ok_or_else(|| "expected a number above 0, such as 0.005".to_owned())
}

/// Calibrates.
///
/// # Errors
/// Bad input; a log whose motions do not determine the drive.
pub fn calibrate(args: &CalibrateArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    let mut disk = Disk::default();
    let name = args.log.display().to_string();
    let (spec, yaml, urdf) = read_robot_files(&args.robot, &disk, None)?;
    let Some(yaml) = yaml else {
        let fault =
            Diagnostic::error("calibrate/urdf", format!("`{}` is a URDF, expected a robot.yaml", args.robot.display()));
        return Err(fault.hint("write a robot.yaml for it: trajc robot init FILE.urdf --out robot.yaml").into());
    };
    let (model, drive) = robot::parse_with_drive(RobotInputs {
        spec: &spec,
        urdf: (&urdf.name, &urdf.text),
        files: &mut disk,
        overrides: &LimitsSpec::default(),
    })?;
    let log = read_log(args, &disk, &model, &drive)?;
    let [left, right] = model.wheel_radii.sides();
    let guess = [left, right, model.track_width];
    let noise = PoseNoise { metres: args.noise_m, radians: args.noise_rad };
    let fit = calibrate::fit(&log, guess, noise).map_err(|error| {
        let hint = error.hint();
        Diagnostics::from(Diagnostic::error("calibrate/undetermined", error).file(&name).hint(hint))
    })?;
    let new = calibrate::rewrite(&yaml.name, &yaml.text, &fit).map_err(|error| match error {
        RewriteError::Yaml(faults) => faults,
        RewriteError::NotATable(key) => Diagnostic::error("calibrate/robot", format!("`{key}` is no table"))
            .file(&yaml.name)
            .hint("write it as `key: value` pairs")
            .into(),
    })?;
    let text = if args.json { json(&fit, guess) } else { readable(&fit, guess) };
    terminal.print(&text);
    if fit.geometry.iter().zip(guess).all(|(new, old)| (new / old - 1.0).abs() < NOTHING) {
        terminal.remark("the log agrees with robot.yaml to rounding: are its poses made of the wheels' angles?\n");
    }
    if !args.dry_run {
        write_file(&args.robot, new.as_bytes())?;
        terminal.remark(&format!("{}: written\n", args.robot.display()));
    } else if !args.json {
        let old: Vec<&str> = yaml.text.lines().collect();
        let changed: String =
            new.lines().filter(|line| !old.contains(line)).map(|line| format!("  {line}\n")).collect();
        terminal.print(&format!("would write into {}:\n{changed}", args.robot.display()));
    }
    Ok(0)
}

/// The log, by its file name's ending.
fn read_log(
    args: &CalibrateArgs,
    disk: &Disk,
    model: &RobotModel,
    drive: &[Vec<DriveJoint>; 2],
) -> Result<Log, Diagnostics> {
    let name = args.log.display().to_string();
    let fault = |text: String| Diagnostic::error("calibrate/log", text).file(&name);
    let is_bag = args.log.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"));
    if !is_bag {
        let text = disk.text(&args.log, None)?.text;
        return Ok(calibrate::read_csv(&name, &text)?);
    }
    let bytes = disk.binary(&args.log, None)?;
    let topics = Topics { wheels: &args.wheels, poses: args.poses.as_deref(), base_frame: args.base_frame.as_deref() };
    calibrate::read_mcap(&bytes, model, drive, topics).map_err(|error: BagError| {
        let fault = fault(error.to_string());
        fault.hint(error.hint().unwrap_or("record it again, with `ros2 bag record -s mcap`")).into()
    })
}

fn readable(fit: &Fit, guess: [f64; 3]) -> String {
    let [radius, difference, track] = fit.deviations();
    let change = |new: f64, old: f64| 100.0 * (new / old - 1.0);
    let r = fit.remaining();
    format!(
        "wheel radius   {:.6} m ± {:.6} ({:+.3} %); left {:.6} m, right {:.6} m\nright wheel    {:+.3} % larger than the left one ± {:.3}{}\n\
         track width    {:.5} m ± {:.5} ({:+.3} %)\nfrom           {} pairs of poses, {} of them outliers; residuals {:.2} of the noise\n\
         remaining      wheel_radius {:.3} %, wheel_difference {:.3} %, track {:.3} % (3 sigma)\n",
        fit.radius(),
        radius,
        change(fit.radius(), guess[0]),
        fit.geometry[0],
        fit.geometry[1],
        100.0 * fit.difference(),
        100.0 * difference,
        if fit.larger_right() == 0.0 { ": taken for none" } else { "" },
        fit.geometry[2],
        track,
        change(fit.geometry[2], guess[2]),
        fit.pairs,
        fit.outliers,
        fit.residual,
        100.0 * r.wheel_radius,
        100.0 * r.wheel_difference,
        100.0 * r.track,
    )
}

fn json(fit: &Fit, guess: [f64; 3]) -> String {
    let [radius, difference, track] = fit.deviations();
    let remaining = fit.remaining();
    let value = serde_json::json!({
        "wheel_radius_m": {"left": fit.geometry[0], "right": fit.geometry[1], "mean": fit.radius(), "sigma": radius, "before": guess[0]},
        "wheel_difference": {"share": fit.difference(), "sigma": difference, "written": fit.larger_right()},
        "track_width_m": {"value": fit.geometry[2], "sigma": track, "before": guess[2]},
        "covariance_m2": {"order": ["left", "right", "track"], "rows": fit.covariance},
        "pairs": fit.pairs,
        "outliers": fit.outliers,
        "residual": fit.residual,
        "tolerance": {
            "wheel_radius": remaining.wheel_radius,
            "wheel_difference": remaining.wheel_difference,
            "track": remaining.track,
        },
    });
    format!("{value:#}\n")
}
