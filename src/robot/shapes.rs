//! Collision geometry of a link to convex shapes; meshes by their hull.

use std::path::{Component, Path, PathBuf};

use nalgebra::{Isometry3, Vector3};
use urdf_rs::Geometry;

use super::{Convex, Files, hull, mesh};
use crate::diag::{Diagnostic, Span};

/// How many folders above the URDF's are searched for a package.
const PACKAGE_LEVELS: usize = 5;

/// The convex shape of one `<collision>` and its pose against the element's origin. `urdf`: its path, and how many [`levels`] below
/// the robot's folder it lies.
///
/// # Errors
/// Meshes that are not found, lie elsewhere or cannot be read; `<capsule>`.
pub(super) fn convex(
    geometry: &Geometry,
    urdf: (&str, usize),
    files: &mut dyn Files,
    at: &Span,
) -> Result<(Isometry3<f64>, Convex), Box<Diagnostic>> {
    let shape = match geometry {
        Geometry::Box { size } => Convex::Box { half: size.0.map(|s| 0.5 * s) },
        Geometry::Cylinder { radius, length } => Convex::Cylinder { radius: *radius, half_length: 0.5 * length },
        Geometry::Sphere { radius } => Convex::Sphere { radius: *radius },
        Geometry::Mesh { filename, scale } => {
            let (path, bytes) = find(filename.trim(), urdf, files, at)?;
            let points =
                mesh::vertices(&path.to_string_lossy(), &bytes).map_err(|error| unreadable(&path, &error, at))?;
            return Ok(centred_hull(&points, scale.map_or([1.0; 3], |s| s.0)));
        }
        Geometry::Capsule { .. } => {
            let fault = Diagnostic::error("robot/geometry", "collision shape <capsule> is not supported").at(at);
            return Err(Box::new(fault.hint("use a cylinder and two spheres")));
        }
    };
    Ok((Isometry3::identity(), shape))
}

fn unreadable(path: &Path, error: &mesh::MeshError, at: &Span) -> Box<Diagnostic> {
    let fault = Diagnostic::error("robot/mesh", format!("mesh {}: {error}", path.display())).at(at);
    Box::new(match error {
        mesh::MeshError::Format(_) => {
            fault.hint("convert it to STL or OBJ (metres, same frame), or use a box or cylinder")
        }
        mesh::MeshError::Empty => fault.hint("export it again, with its triangles; or use a box or cylinder"),
        _ => fault.hint("export it again, as STL or OBJ; or use a box or cylinder"),
    })
}

/// The hull about the centre of its bounding box.
fn centred_hull(points: &[[f64; 3]], scale: [f64; 3]) -> (Isometry3<f64>, Convex) {
    let scaled: Vec<[f64; 3]> = points.iter().map(|p| [0, 1, 2].map(|i| p[i] * scale[i])).collect();
    let mut vertices = hull::extreme_points(&scaled);
    let low = [0, 1, 2].map(|i| vertices.iter().map(|v| v[i]).fold(f64::INFINITY, f64::min));
    let high = [0, 1, 2].map(|i| vertices.iter().map(|v| v[i]).fold(f64::NEG_INFINITY, f64::max));
    let centre = [0, 1, 2].map(|i| low[i] + 0.5 * (high[i] - low[i]));
    for v in &mut vertices {
        *v = [0, 1, 2].map(|i| v[i] - centre[i]);
    }
    (Isometry3::translation(centre[0], centre[1], centre[2]), Convex::Hull { vertices })
}

/// A mesh file by the name in the URDF.
fn find(
    name: &str,
    (urdf_path, levels): (&str, usize),
    files: &mut dyn Files,
    at: &Span,
) -> Result<(PathBuf, Vec<u8>), Box<Diagnostic>> {
    let folder = Path::new(urdf_path).parent().unwrap_or(Path::new(""));
    // A URDF alone in a ROS package: what belongs to it lies beside its folder.
    let mut levels = levels.max(usize::from(folder.file_name().is_some_and(|name| name == "urdf")));
    let candidates: Vec<PathBuf> = if let Some(in_package) = name.strip_prefix("package://") {
        let without_package = in_package.split_once('/').map(|(_, rest)| rest);
        let names = [Some(in_package), without_package];
        levels = 0;
        let places = upwards(folder);
        places.iter().flat_map(|place| names.iter().flatten().map(move |name| place.join(name))).collect()
    } else if let Some(plain) = name.strip_prefix("file://") {
        vec![folder.join(plain)]
    } else if let Some((scheme, _)) = name.split_once("://") {
        let message = format!("mesh {name}: `{scheme}://` is not supported");
        let fault = Diagnostic::error("robot/mesh", message).at(at);
        return Err(Box::new(fault.hint("use package://, file:// or a path relative to the URDF")));
    } else {
        vec![folder.join(name)]
    };
    let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase()).unwrap_or_default();
    if !matches!(ending.as_str(), "stl" | "obj") {
        return Err(unreadable(Path::new(name), &mesh::MeshError::Format(ending), at));
    }
    let plain = name.split_once("://").map_or(name, |(_, plain)| plain);
    if leaves(Path::new(plain), folder, levels) && !candidates.iter().all(|path| files.may_leave(path)) {
        let message = format!("mesh {name} is not under the robot's folder");
        let fault = Diagnostic::error("robot/mesh-outside", message).at(at);
        return Err(Box::new(fault.hint("copy it there, or allow the folder that it lies in: --allow-path DIR")));
    }
    let (mut reason, mut near) = (None, None);
    for path in &candidates {
        match files.read(path) {
            Ok(bytes) => return Ok((path.clone(), bytes)),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                near = near.or_else(|| files.nearest(path));
            }
            Err(error) => reason = reason.or(Some(format!("{}: {error}, expected a file", path.display()))),
        }
    }
    let is_there = reason.is_some();
    let why = reason.unwrap_or_else(|| "not found".into());
    let fault = Diagnostic::error("robot/mesh", format!("mesh {name}: {why}")).at(at);
    let shown: Vec<_> = candidates.iter().take(4).map(|p| p.display().to_string()).collect();
    let near = match near {
        _ if is_there => "name the mesh file itself, .stl or .obj; ".to_owned(),
        Some(near) => format!("did you mean `{near}`? "),
        None => String::new(),
    };
    Err(Box::new(fault.hint(format!(
        "{near}looked for {}{}",
        shown.join(", "),
        if candidates.len() > 4 { ", …" } else { "" }
    ))))
}

/// Folders that a `urdf: FOLDER/FILE.urdf` leads down from the robot.yaml, whose folder is the robot's.
pub(super) fn levels(urdf: &Path) -> usize {
    let mut parts = urdf.components();
    parts.next_back();
    let down = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    if parts.clone().all(down) { parts.filter(|part| matches!(part, Component::Normal(_))).count() } else { 0 }
}

/// Whether a path from `folder` leads out of the folder so many levels above it. (By its name: links are the user's own.)
fn leaves(name: &Path, folder: &Path, levels: usize) -> bool {
    let name = match name.strip_prefix(folder) {
        Ok(below) if name.is_absolute() => below,
        _ => name,
    };
    let mut depth = levels;
    for part in name.components() {
        depth = match part {
            Component::Normal(_) => depth + 1,
            Component::CurDir => depth,
            Component::ParentDir if depth > 0 => depth - 1,
            Component::ParentDir | Component::RootDir | Component::Prefix(_) => return true,
        };
    }
    false
}

/// A folder and those above it, as far as packages are searched.
fn upwards(folder: &Path) -> Vec<PathBuf> {
    let mut places = vec![folder.to_path_buf()];
    for _ in 0..PACKAGE_LEVELS {
        let last = places.last().expect("begins with the folder itself");
        let above = match last.components().next_back() {
            Some(Component::Normal(_)) => last.parent().unwrap_or(Path::new("")).to_path_buf(),
            Some(Component::RootDir | Component::Prefix(_)) => break,
            _ => last.join(".."),
        };
        places.push(above);
    }
    places
}

/// Whether a posed shape has only finite numbers; lengths multiply along a chain.
pub(super) fn finite(pose: &Isometry3<f64>, convex: &Convex) -> bool {
    let size = convex.half_extents().iter().sum::<f64>();
    (pose.translation.vector + Vector3::repeat(size)).iter().all(|v| v.is_finite()) && pose.rotation.coords.norm() > 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_are_searched_from_the_folder_upwards() {
        let shown = |folder: &str| -> Vec<String> {
            upwards(Path::new(folder)).iter().map(|p| p.display().to_string()).collect()
        };
        assert_eq!(shown("a/b"), ["a/b", "a", "", "..", "../..", "../../.."]);
        assert_eq!(shown("/a"), ["/a", "/"]);
        assert_eq!(shown("../x")[..3], ["../x", "..", "../.."]);
    }

    #[test]
    fn meshes_stay_under_the_robots_folder() {
        for (name, levels, out) in [
            ("meshes/a.stl", 0, false),
            ("meshes/../a.stl", 0, false),
            ("./a.stl", 0, false),
            ("../meshes/a.stl", 0, true),
            ("../meshes/a.stl", 1, false),
            ("../../meshes/a.stl", 1, true),
            ("m/../../../a.stl", 1, true),
            ("/r/own/m/a.stl", 0, false),
            ("/r/own/../a.stl", 0, true),
            ("/etc/a.stl", 3, true),
        ] {
            assert_eq!(leaves(Path::new(name), Path::new("/r/own"), levels), out, "{name} from {levels}");
        }
        for (urdf, down) in [("a.urdf", 0), ("./urdf/a.urdf", 1), ("x/y/a.urdf", 2), ("../a.urdf", 0), ("/a/b.urdf", 0)]
        {
            assert_eq!(levels(Path::new(urdf)), down, "{urdf}");
        }
    }

    #[test]
    fn a_hull_is_centred_on_its_bounding_box() {
        let points = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 6.0], [0.5, 0.5, 0.5]];
        let (pose, convex) = centred_hull(&points, [0.5, 1.0, -1.0]);
        assert_eq!(pose.translation.vector, Vector3::new(1.0, 1.0, -3.0));
        assert_eq!(convex.half_extents(), [1.0, 1.0, 3.0]);
        let Convex::Hull { vertices } = convex else { panic!("not a hull") };
        assert_eq!(vertices.len(), 4);
    }
}
