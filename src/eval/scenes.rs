//! Scenes: boxes in a room, start and goal.

use std::collections::BTreeSet;

use super::fault::ScenesError;
use crate::diag::Diagnostics;
use crate::geom::Aabb;
use crate::map::VoxelMap;
use crate::mission::{LimitsSpec, Mission, Parameterisation, PoseSpec, Sampling, TimeLaw, Unknown};
use crate::robot::RobotModel;

/// The value of `schema`.
pub const SCHEMA: &str = "trajc.scenes/1";
/// Scenes are compiled at this sampling time, s.
const SAMPLING_TIME: f64 = 0.1;

/// A file of scenes that share a room, a robot's limits and what is asked.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneSet {
    /// The file's path, for messages.
    pub file: String,
    /// `table1-15` and the like; decides which table is printed. Empty: not given.
    pub name: String,
    /// The room; its outside in x and y is an obstacle. Metres.
    pub bounds: Aabb,
    /// Cell size, m; the grid begins at the lower corner of `bounds`.
    pub resolution: f64,
    /// What the certificate must prove, m.
    pub clearance: f64,
    /// Over the robot's.
    pub limits: LimitsSpec,
    /// Whether the robot may drive backwards.
    pub reverse: bool,
    /// At least one; ids are distinct and fit for folders.
    pub scenes: Vec<Scene>,
}

/// One scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Its name.
    pub id: String,
    /// What sort of room it is, where the set has several; rows of tables go by it.
    pub kind: Option<String>,
    /// Obstacles.
    pub boxes: Vec<Aabb>,
    /// With x, y and yaw.
    pub start: PoseSpec,
    /// With x, y and yaw.
    pub goal: PoseSpec,
}

impl SceneSet {
    /// What a scene asks, as a mission without a map file: sampling time 0.1 s, time law `auto`, default sampling.
    pub fn mission(&self, scene: &Scene) -> Mission {
        Mission {
            name: scene.id.clone(),
            robot: Default::default(),
            map: None,
            start: Some(scene.start.clone()),
            start_file: None,
            goal: Some(scene.goal.clone()),
            via: Vec::new(),
            path: None,
            clearance: self.clearance,
            sampling_time: SAMPLING_TIME,
            sampling: Sampling::DEFAULT,
            time_law: TimeLaw::Auto,
            reverse: self.reverse,
            parameterisation: Parameterisation::DEFAULT,
            path_error_times: Vec::new(),
            path_error_samplings: Vec::new(),
            limits: self.limits.clone(),
            tolerance: None,
            source: Default::default(),
            spans: Default::default(),
        }
    }

    /// A scene's obstacles as voxels.
    ///
    /// # Errors
    /// A grid too large; sets that were read have none.
    pub fn voxels(&self, scene: &Scene) -> Result<VoxelMap, Diagnostics> {
        VoxelMap::from_boxes(self.bounds, self.resolution, &scene.boxes, Unknown::Occupied)
    }

    /// Joints that scenes name must be the robot's, at values it can hold. `text`: what the set was read from, for messages.
    ///
    /// # Errors
    /// The first hundred faults.
    pub fn fits(&self, robot: &RobotModel, text: &str) -> Result<(), Diagnostics> {
        let mut faults = Vec::new();
        for (i, scene) in self.scenes.iter().enumerate() {
            for (end, pose) in [("start", &scene.start), ("goal", &scene.goal)] {
                for (name, value) in &pose.joints {
                    let path = super::read::join(&format!("scenes[{i}].{end}.joints"), name);
                    match robot.joints.iter().find(|j| j.name == *name) {
                        None => {
                            let known = robot.joints.iter().map(|j| j.name.clone()).collect();
                            faults.push(ScenesError::UnknownJoint { path, robot: robot.name.clone(), known });
                        }
                        Some(j) if *value < j.lower - 1e-9 || *value > j.upper + 1e-9 => {
                            faults.push(ScenesError::Range {
                                path,
                                range: format!("within the joint's limits {} to {}", j.lower, j.upper),
                                found: value.to_string(),
                            });
                        }
                        Some(_) => {}
                    }
                }
            }
        }
        faults.truncate(super::fault::MOST);
        if faults.is_empty() { Ok(()) } else { Err(super::fault::diagnostics(&self.file, text, &faults)) }
    }

    /// The first id that is there twice.
    pub(super) fn repeated_id(&self) -> Option<(usize, &str)> {
        let mut seen = BTreeSet::new();
        self.scenes.iter().enumerate().find(|(_, s)| !seen.insert(&s.id)).map(|(i, s)| (i, s.id.as_str()))
    }
}
