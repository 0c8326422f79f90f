//! `trajc inspect FILE`.

mod commands;

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::inputs::{self, Disk, read_map_file, read_robot_files};
use super::plot;
use super::terminal::Terminal;
use crate::diag::{Diagnostic, Diagnostics};
use crate::map::{self, MapInputs};
use crate::mission::{LimitsSpec, MapSpec, Unknown};
use crate::pipeline;
use crate::report::plot::Figure;
use crate::report::schema::{MapPart, RobotPart};
use crate::robot::{self, RobotInputs};

/// Print what the program understood of a URDF, robot.yaml, map, mission or command file.
///
/// Of a command file: its rows, peaks against the limits, and of .mcap topics, attachments and the certificate as recorded.
#[derive(Debug, clap::Args)]
pub struct InspectArgs {
    /// .urdf, robot.yaml, a mission, a map, commands.csv or commands.mcap.
    file: PathBuf,
    /// Cell size, in metres [default: 0.05 of point clouds; grids have their own]
    #[arg(long, value_name = "M")]
    resolution: Option<f64>,
    /// Slab of a map that holds obstacles, in metres.
    #[arg(long, value_name = "LOW,HIGH", value_delimiter = ',', allow_hyphen_values = true, default_values_t = [0.02, 2.0])]
    height: Vec<f64>,
    /// Print it as JSON.
    #[arg(long)]
    json: bool,
    /// Draw it too: from above; of commands, wheels and joints over time.
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
}

/// What is printed, and what is drawn.
struct Understood {
    text: String,
    json: Value,
    figure: Figure,
}

/// What a .yaml is, by its keys.
enum YamlKind {
    Mission,
    Robot,
    Map,
}

/// Prints.
///
/// # Errors
/// Bad input.
pub fn inspect(args: &InspectArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    let path = args.file.as_path();
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let understood = match ending.as_str() {
        "urdf" | "xacro" => of_robot(path)?,
        "mcap" => commands::describe(path)?,
        "csv" if starts_as_commands(path)? => commands::describe(path)?,
        "yaml" | "yml" => match kind_of_yaml(path)? {
            YamlKind::Mission => of_mission(path)?,
            YamlKind::Robot => of_robot(path)?,
            YamlKind::Map => of_map(args, path)?,
        },
        _ => of_map(args, path)?,
    };
    if let Some(path) = &args.plot {
        super::output::write_file(path, understood.figure.to_svg().as_bytes())?;
    }
    terminal.print(&if args.json { format!("{:#}\n", understood.json) } else { understood.text });
    Ok(0)
}

fn kind_of_yaml(path: &Path) -> Result<YamlKind, Diagnostics> {
    let text = Disk::default().text(path, None)?.text;
    let has =
        |key: &str| text.lines().any(|line| line.starts_with(key) && line[key.len()..].trim_start().starts_with(':'));
    if has("image") && has("resolution") {
        Ok(YamlKind::Map)
    } else if has("urdf") || has("drive") {
        Ok(YamlKind::Robot)
    } else {
        Ok(YamlKind::Mission)
    }
}

fn starts_as_commands(path: &Path) -> Result<bool, Diagnostics> {
    let bytes = Disk::default().binary(path, None)?;
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(4096)]).into_owned();
    Ok(head.contains("# format: trajc.commands") || head.contains("wheel_left_rad_s"))
}

fn of_robot(path: &Path) -> Result<Understood, Diagnostics> {
    let disk = Disk::default();
    let (spec, _, urdf) = read_robot_files(path, &disk, None)?;
    let overrides = LimitsSpec::default();
    let mut files = disk.clone();
    let inputs = RobotInputs { spec: &spec, urdf: (&urdf.name, &urdf.text), files: &mut files, overrides: &overrides };
    let (robot, findings) = robot::parse_with_findings(inputs)?;
    let json = json!(RobotPart::from(&robot));
    let mut text = robot.describe();
    if !findings.is_empty() {
        text += "easily missed\n";
    }
    for finding in findings {
        text += &format!("  {finding}\n");
    }
    Ok(Understood { text, json, figure: plot::robot(&robot) })
}

fn of_map(args: &InspectArgs, path: &Path) -> Result<Understood, Diagnostics> {
    let height = match args.height[..] {
        [low, high] if low.is_finite() && high.is_finite() && low < high => [low, high],
        _ => {
            let written: Vec<String> = args.height.iter().map(f64::to_string).collect();
            let message = format!("--height {} is no slab: expected LOW,HIGH", written.join(","));
            let hint = "give two ends in metres, the lower first, such as --height 0.02,2";
            return Err(Diagnostic::error("inspect/height", message).hint(hint).into());
        }
    };
    let file = read_map_file(path, &Disk::default(), None)?;
    let spec = MapSpec {
        file: path.to_path_buf(),
        resolution: args.resolution,
        height: Some(height),
        unknown: Unknown::Occupied,
        origin: None,
        keep_out: Vec::new(),
        boxes: Vec::new(),
        speed_zones: Vec::new(),
    };
    let beside = file.beside.as_ref().map(|(name, bytes)| (name.as_str(), bytes.as_slice()));
    let inputs = MapInputs { name: &file.name, bytes: &file.bytes, beside };
    let map = map::parse(&inputs, &spec, height[1])?;
    let survey = map::survey(&inputs)?;
    let mut json = json!(MapPart::from(&map));
    if let Some(survey) = &survey {
        json["measured"] = json!({"low_m": survey.bounds[0], "high_m": survey.bounds[1], "heights": survey.heights});
        json["floor"] = json!(survey.floor.map(|floor| {
            json!({"z_m": floor.level, "tilt_rad": floor.tilt(), "slope": floor.slope, "share": floor.share})
        }));
    }
    let measured = survey.map_or(String::new(), |survey| survey.describe() + "\n");
    Ok(Understood { text: measured + &map.describe(), json, figure: plot::map(&file.name, &map) })
}

fn of_mission(path: &Path) -> Result<Understood, Diagnostics> {
    let (mut inputs, disk) = inputs::read(path)?;
    let world = pipeline::world(&mut inputs)?;
    let mission = &inputs.mission;
    let mut out = format!("mission {}\n", mission.name);
    let pose = |p: &crate::mission::PoseSpec| {
        let number = |v: Option<f64>| v.map_or("free".to_owned(), |v| format!("{v}"));
        let joints: Vec<String> = p.joints.iter().map(|(name, v)| format!("{name} {v}")).collect();
        let within = if p.within > 0.0 { format!(" (anywhere within {} m)", p.within) } else { String::new() };
        let [x, y, yaw] = [p.x, p.y, p.yaw].map(number);
        if let Some(link) = &p.link {
            let [x, y, z] = link.position;
            let turned = link.rpy.map_or(String::new(), |[r, p, y]| format!(", turned by {r}, {p}, {y} rad"));
            let (name, within) = (&link.name, link.within);
            return format!(
                "link {name} within {within} m of x {x} m, y {y} m, z {z} m{turned}; yaw {yaw} rad {}",
                joints.join(", ")
            );
        }
        format!("x {x} m, y {y} m{within}, yaw {yaw} rad {}", joints.join(", "))
    };
    let vias = mission.via.iter().map(|via| ("via", Some(&via.place)));
    let ends = [("start", mission.start.as_ref())].into_iter().chain(vias).chain([("goal", mission.goal.as_ref())]);
    for (name, spec) in ends {
        if let Some(spec) = spec {
            out += &format!("  {name:<10} {}\n", pose(spec));
        }
    }
    if let Some(file) = &mission.start_file {
        out += &format!("             start from {}\n", file.display());
    }
    out += &format!("  clearance  {} m, sampling time {} s\n", mission.clearance, mission.sampling_time);
    out += "  reads     ";
    for file in disk.paths() {
        out += &format!(" {}", file.display());
    }
    out += "\n\n";
    out += &world.robot.describe();
    if let Some(map) = &world.map {
        out += "\n";
        out += &map.describe();
    }
    let json = json!({
        "mission": mission.name,
        "clearance_m": mission.clearance,
        "sampling_time_s": mission.sampling_time,
        "reads": disk.paths(),
        "robot": RobotPart::from(&world.robot),
        "map": world.map.as_deref().map(MapPart::from),
    });
    Ok(Understood { text: out, json, figure: plot::mission(mission, &world) })
}
