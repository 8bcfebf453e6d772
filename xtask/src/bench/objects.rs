//! Table 2 of the paper: five objects by three methods.

use anyhow::{Context, Result};
use serde::Serialize;
use spectral_scene::{Scene, bundled};

use super::frames::{self, Frames};
use super::{Args, Turns};

/// The paper's objects and the scenes here that have their number of faces. Its bunny has 138,902.
const OBJECTS: [(&str, &str); 5] = [
    ("sphere", "sphere"),
    ("ring", "ring"),
    ("gem", "gem"),
    ("bunny", "organic"),
    ("glass on table", "glass"),
];

/// An object of the table.
pub(super) struct Subject {
    object: &'static str,
    scene: Scene,
}

/// A row.
#[derive(Serialize)]
pub(super) struct ObjectRow {
    /// What the paper calls it.
    pub(super) object: &'static str,
    /// The scene that stands for it.
    pub(super) scene: String,
    /// Triangles of its refractors.
    pub(super) faces: usize,
    /// One entry per column.
    pub(super) frames: Vec<Frames>,
}

/// The objects of these scenes, or all of them.
pub(super) fn named(scenes: &[String]) -> Result<Vec<Subject>> {
    let all = OBJECTS.map(|(_, scene)| scene.to_owned());
    let wanted = if scenes.is_empty() { all.as_slice() } else { scenes };
    let subject = |name: &String| {
        let known = OBJECTS.iter().find(|(_, scene)| scene == name);
        let subject = known.and_then(|&(object, scene)| Some(Subject { object, scene: bundled(scene)? }));
        subject.with_context(|| format!("--object {name}: not in the table; there are {}", all.join(", ")))
    };
    wanted.iter().map(subject).collect()
}

pub(super) fn measure(turns: &mut Turns, subjects: &[Subject], args: &Args) -> Result<Vec<ObjectRow>> {
    let row = |Subject { object, scene }: &Subject| {
        eprintln!("  {object}");
        let faces = |i: usize| scene.meshes[scene.objects[i].mesh].triangles.len();
        Ok(ObjectRow {
            object,
            scene: scene.name.clone(),
            faces: scene.refractors().map(faces).sum(),
            frames: frames::measure(turns, scene, args, |settings| settings)?,
        })
    };
    subjects.iter().map(row).collect()
}
