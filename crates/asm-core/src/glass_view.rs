//! Deferred refraction: the wavelengths that a camera sees glass and mirrors at, and the step from the background to the picture.

use frame_plan::{Bound, ResourceId, Step};
use glam::{UVec2, Vec3};
use spectral_core::rgb::{linear_srgb_from_xyz, xyz_from_linear_srgb};
use spectral_core::wavelengths::WavelengthSet;
use spectral_scene::{Effects, Scene};

use crate::bands::{D_LINE_NM, Glass, one_wavelength};
use crate::caustics::Caustics;
use crate::decisions::CameraGlass;
use crate::geometry::bounds;
use crate::lights::REACH;
use crate::passes::deferred_refraction::{DeferredRefraction, SEEN_ROWS, ViewBand};
use crate::shared::optics::Optics;
use crate::{PlanError, Settings};

/// Guesses at the background.
const BACKGROUND_ITERATIONS: u32 = 8;

/// Columns of a matrix.
type Columns = [[f64; 3]; 3];

/// The wavelengths that a camera sees glass at, with K_n in XYZ.
struct ViewWavelengths {
    nm: Vec<f64>,
    bands: Vec<ViewBand>,
}

impl ViewWavelengths {
    fn new(scene: &Scene, settings: &Settings, effects: &Effects) -> Result<Self, PlanError> {
        let one = (settings.prune && one_wavelength(scene, effects)) || settings.wavelength_count() == 1;
        let (nm, columns) = if let Some(line_nm) = only_line_nm(scene, settings) {
            (vec![line_nm], vec![IDENTITY])
        } else if one {
            (vec![D_LINE_NM], vec![IDENTITY])
        } else {
            let count = settings.wavelength_count() as usize;
            let set = WavelengthSet::new(settings.scheme(), count, settings.range_nm(), settings.observer)?;
            let columns = match &set.weights_xyz {
                Some(weights) => weights.iter().map(diagonal).collect(),
                None => set.weights_rgb.iter().map(xyz_from_rgb_weights).collect(),
            };
            (set.wavelengths_nm, columns)
        };
        Ok(Self { nm, bands: bands_that_sum_to_the_identity(&columns) })
    }
}

const IDENTITY: Columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The wavelength of the lights that shine, if they have one in common and no other.
fn only_line_nm(scene: &Scene, settings: &Settings) -> Option<f64> {
    let chosen = |i: usize| settings.lights.as_ref().is_none_or(|chosen| chosen.contains(&i));
    let shining = scene.lights.iter().enumerate().filter(|(i, light)| chosen(*i) && light.intensity > 0.0);
    let mut lines = shining.map(|(_, light)| light.spectrum.line_nm());
    let first = lines.next()??;
    lines.all(|line| line == Some(first)).then_some(first)
}

fn diagonal(weights: &[f64; 3]) -> Columns {
    std::array::from_fn(|c| std::array::from_fn(|r| if r == c { weights[c] } else { 0.0 }))
}

/// K_n = M(RGB to XYZ) diag(weights) M(XYZ to RGB).
fn xyz_from_rgb_weights(weights: &[f64; 3]) -> Columns {
    IDENTITY.map(|unit| {
        let rgb = linear_srgb_from_xyz(unit);
        xyz_from_linear_srgb(std::array::from_fn(|c| rgb[c] * weights[c]))
    })
}

/// In f32, with what rounding leaves given to the largest entry, so that the sum in the shader's order is exact.
fn bands_that_sum_to_the_identity(columns: &[Columns]) -> Vec<ViewBand> {
    let mut bands: Vec<[[f32; 3]; 3]> =
        columns.iter().map(|m| m.map(|column| column.map(|v| v as f32))).collect();
    for c in 0..3 {
        for r in 0..3 {
            let wanted = if r == c { 1.0 } else { 0.0 };
            let largest = (0..bands.len())
                .max_by(|&a, &b| bands[a][c][r].abs().total_cmp(&bands[b][c][r].abs()))
                .unwrap_or_default();
            for _ in 0..8 {
                let sum = bands.iter().fold(0.0_f32, |sum, m| sum + m[c][r]);
                if sum == wanted {
                    break;
                }
                bands[largest][c][r] += wanted - sum;
            }
        }
    }
    let band = |[x, y, z]: [[f32; 3]; 3]| ViewBand {
        from_x: Vec3::from(x),
        reserved0: 0,
        from_y: Vec3::from(y),
        reserved1: 0,
        from_z: Vec3::from(z),
        reserved2: 0,
    };
    bands.into_iter().map(band).collect()
}

/// Resources of deferred refraction.
pub(crate) struct GlassViewResources {
    bands: ResourceId,
    optics: ResourceId,
    wavelengths: u32,
    /// What the camera sees without glass, XYZ per sample.
    pub(crate) background: ResourceId,
    pub(crate) counts: ResourceId,
}

/// What the camera has drawn.
pub(crate) struct CameraBuffers {
    pub(crate) size: UVec2,
    pub(crate) samples: u32,
    pub(crate) opaque: ResourceId,
    pub(crate) glass: ResourceId,
    pub(crate) backs: ResourceId,
    pub(crate) picture: ResourceId,
}

/// Bytes of the background per sample.
pub(crate) const BACKGROUND_BYTES: u64 = 16;

impl Caustics<'_> {
    pub(crate) fn glass_view(
        &mut self,
        effects: &Effects,
        sampled: [u32; 2],
    ) -> Result<GlassViewResources, PlanError> {
        let wavelengths = ViewWavelengths::new(self.scene, self.settings, effects)?;
        let glasses = Glass::of(self.scene);
        let metres = self.space.metres_per_unit;
        let optics: Vec<Optics> = wavelengths
            .nm
            .iter()
            .flat_map(|&nm| glasses.iter().map(move |glass| glass.optics(nm, metres)))
            .collect();
        let remedy = "the picture's size";
        let bytes = BACKGROUND_BYTES * u64::from(sampled[0]) * u64::from(sampled[1]);
        let counts = self.resources.buffer("view counts", 8 * SEEN_ROWS as u64, remedy)?;
        self.resources.make_readable(counts);
        Ok(GlassViewResources {
            bands: self.resources.filled("view bands", &wavelengths.bands)?,
            optics: self.resources.filled("view optics", &optics)?,
            wavelengths: wavelengths.nm.len() as u32,
            background: self.resources.buffer("background", bytes, remedy)?,
            counts,
        })
    }

    /// The step from the background, with light of all lights in it, to the picture.
    pub(crate) fn refract_view(
        &mut self,
        view: &GlassViewResources,
        camera: &CameraBuffers,
        seen: &CameraGlass,
    ) -> Result<(), PlanError> {
        let glass = bounds(self.geometry.refractor_corners()).unwrap_or_default();
        let params = DeferredRefraction {
            size: camera.size,
            samples: camera.samples,
            camera_view: self.camera_view(),
            wavelengths: view.wavelengths,
            materials: self.scene.materials.len() as u32,
            exit_iterations: self.settings.exit_iterations,
            background_iterations: BACKGROUND_ITERATIONS,
            exit_reach: glass.0.distance(glass.1) as f32,
            bounces: self.settings.view_bounces,
            rule: self.settings.refraction_rule.code(),
            mirrors: u32::from(seen.mirrors),
            mirror_reach: REACH as f32,
            eye_object: seen.inside.map_or(0, |object| object as u32 + 1),
            eye_material: seen.inside.map_or(0, |object| self.scene.objects[object].material as u32),
            reserved0: 0,
        };
        let bindings = [
            self.triangles,
            self.views,
            view.bands,
            view.optics,
            view.background,
            camera.opaque,
            camera.glass,
            camera.backs,
            camera.picture,
            view.counts,
        ];
        let groups = self.resources.groups(camera.size.to_array(), 1, "the picture's size")?;
        self.resources.plan.steps.push(Step::ClearBuffer { buffer: view.counts });
        self.dispatch("deferred_refraction", "camera", &params, bindings.map(Bound::from).to_vec(), groups);
        Ok(())
    }
}
