//! Scenes that are compared, with what their lamps can put on the receiver.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use spectral_cli::lamps::luminous;
use spectral_scene::{BUNDLED, Light, LightShape, OpenError, ReceiverError, Scene};

use crate::checks::Expected;
use crate::layers::Layer;

/// Scenes from other programs, below the workspace's root, with the name of the object to bake onto.
const FILES: [(&str, &str, &str); 1] = [("bunny-glass", "tests/assets/bunny-glass.glb", "floor")];

/// What bundled scenes and files that follow their example call their receiver.
const RECEIVER: &str = "receiver";

/// The energy bounds are exact; an oracle's noise and sums in f32 need this much room.
const ENERGY_MARGIN: f64 = 1.01;

/// A scene and the receiver that is baked.
pub struct Subject {
    /// Name for reports.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// The receiver, an index into the scene's objects.
    pub receiver: usize,
}

/// Why a scene cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum SubjectError {
    /// It is neither a scene's name nor a readable file.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// It has nothing to bake onto.
    #[error("{scene}: {error}")]
    Receiver {
        /// Scene name.
        scene: String,
        /// What is missing.
        error: ReceiverError,
    },
}

impl Subject {
    /// Names of all scenes that `compare` and the tests use: the bundled ones and those from other programs.
    pub fn names() -> impl Iterator<Item = &'static str> {
        BUNDLED.iter().copied().chain(FILES.iter().map(|f| f.0))
    }

    /// One of [`Subject::names`], or a file; `workspace` is the workspace's root folder.
    ///
    /// # Errors
    /// If it cannot be loaded, or has no receiver.
    pub fn open(name: &str, workspace: &Path) -> Result<Self, SubjectError> {
        let file = FILES.iter().find(|f| f.0 == name);
        let source = file.map_or_else(|| PathBuf::from(name), |f| workspace.join(f.1));
        let (scene, _) = spectral_scene::open(&source.to_string_lossy())?;
        let receiver = scene
            .receiver(file.map_or(RECEIVER, |f| f.2))
            // A file of unknown origin: its first receiver.
            .or_else(|error| scene.receivers().next().ok_or(error))
            .map_err(|error| SubjectError::Receiver { scene: name.into(), error })?;
        Ok(Self { name: scene.name.clone(), scene, receiver })
    }

    /// XYZ at Y = 1 of unblocked perpendicular light of all lamps together.
    pub fn white_xyz(&self) -> [f64; 3] {
        spectral_cli::lamps::white_xyz(&self.scene)
    }

    /// Upper bound of the receiver's mean illuminance, lux, from light that meets nothing before it.
    pub fn max_direct_y(&self) -> f64 {
        let (low, high) = self.scene.bounds([self.receiver]).unwrap_or_default();
        let lamp = |light: &Light| match light.shape {
            LightShape::Directional { .. } => luminous(light),
            LightShape::Point { position_m, .. } | LightShape::Spot { position_m, .. } => {
                luminous(light) / position_m.distance_squared(position_m.clamp(low, high))
            }
        };
        self.scene.lights.iter().map(lamp).sum()
    }

    /// Upper bound of the receiver's mean illuminance, lux, from light that meets glass or a mirror: all that enters the
    /// bounding sphere of these, landing there.
    pub fn max_caustic_y(&self) -> f64 {
        let Some((low, high)) = self.scene.bounds(self.scene.casters()) else { return 0.0 };
        let (center, radius) = ((low + high) * 0.5, low.distance(high) * 0.5);
        let lamp = |light: &Light| match light.shape {
            LightShape::Directional { .. } => luminous(light) * PI * radius * radius,
            LightShape::Point { position_m, .. } | LightShape::Spot { position_m, .. } => {
                let sine = (radius / position_m.distance(center)).min(1.0);
                let hidden = if sine < 1.0 { (1.0 - sine * sine).sqrt() } else { -1.0 };
                luminous(light) * 2.0 * PI * (1.0 - hidden)
            }
        };
        self.scene.lights.iter().map(lamp).sum::<f64>() / self.receiver_area_m2()
    }

    /// What any result on the receiver must look like in this layer. `shadowed`: something stands before part of it.
    pub fn expected(&self, layer: Layer, shadowed: bool) -> Expected {
        let lux = match layer {
            Layer::Direct => self.max_direct_y(),
            Layer::Refracted | Layer::Reflected => self.max_caustic_y(),
        };
        Expected {
            white_xyz: self.white_xyz(),
            max_mean_y: lux * ENERGY_MARGIN,
            varies: layer != Layer::Direct || shadowed,
        }
    }

    /// Area of the receiver, square metres.
    fn receiver_area_m2(&self) -> f64 {
        let mesh = self.scene.world_mesh(self.receiver);
        let area = |&[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|i| mesh.positions[i as usize]);
            0.5 * (b - a).cross(c - a).length()
        };
        mesh.triangles.iter().map(area).sum()
    }
}
