//! What frames change and read.

use asm_core::Picture;
use frame_plan::{ExecuteError, Executor, ResourceId};
use glam::{DMat3, UVec2, Vec4};
use spectral_core::mat3::{self, Mat3};
use spectral_core::patch::Shown;
use spectral_scene::Camera;
use std::f64::consts::FRAC_1_PI;

use super::error::RelightingError;
use super::{Relighting, Shape, pack};
use crate::sh::ShRotation;
use crate::shared::prt_picture::PrtPicture;
use crate::sky::Sky;

/// How radiance becomes the picture's XYZ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// XYZ is multiplied by this.
    pub factor: f64,
    /// Before that it is balanced: the white of some light becomes D65 with Y = 1 (Bradford).
    pub balance: Option<Shown>,
}

impl Default for Exposure {
    /// XYZ as it is, in the sky's unit.
    fn default() -> Self {
        Self { factor: 1.0, balance: None }
    }
}

/// What may be another in every frame.
#[derive(Clone, Copy, Debug)]
pub struct Shot<'a> {
    /// The light, in the coefficients of the palette.
    pub sky: &'a Sky,
    /// Turns the light.
    pub rotation: DMat3,
    /// Who looks.
    pub camera: &'a Camera,
    /// How radiance becomes the picture's XYZ.
    pub exposure: Exposure,
}

impl Relighting {
    /// Everything of the next frame.
    ///
    /// # Errors
    /// As the other functions that write.
    pub fn write(&self, executor: &mut dyn Executor, shot: &Shot<'_>) -> Result<(), RelightingError> {
        self.write_sky(executor, shot.sky)?;
        self.write_rotation(executor, shot.rotation)?;
        self.write_camera(executor, shot.camera)?;
        self.write_exposure(executor, &shot.exposure)
    }

    /// The light of the next frame: another illuminant, other surroundings.
    ///
    /// # Errors
    /// [`RelightingError::Mismatch`] for another number of bands or spectral coefficients; [`RelightingError::Value`] for
    /// light that is not finite; those of the executor.
    pub fn write_sky(&self, executor: &mut dyn Executor, sky: &Sky) -> Result<(), RelightingError> {
        let sky = self.shape.packed_sky(sky)?;
        Ok(executor.write_buffer(self.ids.sky, 0, bytemuck::cast_slice(&sky))?)
    }

    /// The light of the next frame is the sky's, turned: what came from direction d comes from `rotation * d`.
    ///
    /// # Errors
    /// [`RelightingError::Rotation`]; those of the executor.
    pub fn write_rotation(
        &self,
        executor: &mut dyn Executor,
        rotation: DMat3,
    ) -> Result<(), RelightingError> {
        let matrices = self.shape.packed_rotation(rotation)?;
        Ok(executor.write_buffer(self.ids.rotation, 0, bytemuck::cast_slice(&matrices))?)
    }

    /// The next frame is seen by `camera`.
    ///
    /// # Errors
    /// [`RelightingError::Value`] for a camera that sees nothing; those of the executor.
    pub fn write_camera(&self, executor: &mut dyn Executor, camera: &Camera) -> Result<(), RelightingError> {
        let view = self.shape.view(camera)?;
        Ok(executor.write_buffer(self.ids.views, 0, bytemuck::bytes_of(&view))?)
    }

    /// How radiance becomes the next frame's XYZ.
    ///
    /// # Errors
    /// [`RelightingError::Value`] for a factor that is negative or not finite; those of the executor.
    pub fn write_exposure(
        &self,
        executor: &mut dyn Executor,
        exposure: &Exposure,
    ) -> Result<(), RelightingError> {
        let params = self.shape.exposed(exposure)?;
        Ok(executor.set_params(self.ids.shade, bytemuck::bytes_of(&params))?)
    }

    /// Wait for the last frame and read it: XYZ, pixel means. Few bands ring, so opposite to strong light Y may be slightly
    /// negative; only the display clamps.
    ///
    /// # Errors
    /// Those of the executor.
    pub fn read(&self, executor: &mut dyn Executor) -> Result<Picture, ExecuteError> {
        Ok(self.read_with_uncovered(executor)?.0)
    }

    /// The same, and of each pixel the share where no surface is, 0 to 1: where the sky would be seen.
    ///
    /// # Errors
    /// Those of the executor.
    pub fn read_with_uncovered(
        &self,
        executor: &mut dyn Executor,
    ) -> Result<(Picture, Vec<f32>), ExecuteError> {
        let bytes = executor.read(self.ids.picture)?;
        let pixels = bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned::<Vec4>);
        let (xyz, uncovered) = pixels.map(|pixel| (pixel.truncate().to_array(), pixel.w)).unzip();
        let [width, height] = self.shape.size;
        Ok((Picture { width, height, xyz }, uncovered))
    }

    /// The buffer that a frame leaves the picture in: XYZ and the share without a surface per pixel, f32, rows from the top.
    pub fn picture(&self) -> ResourceId {
        self.ids.picture
    }
}

impl Shape {
    pub(super) fn packed_sky(&self, sky: &Sky) -> Result<Vec<Vec4>, RelightingError> {
        for (got, unit, with, expected) in [
            (sky.bands().count(), "bands of harmonics", "the transfer", self.bands.count()),
            (sky.light().len(), "spectral coefficients", "the palette", self.coefficients),
        ] {
            if got != expected {
                return Err(RelightingError::Mismatch { what: "the sky", got, unit, with, expected });
            }
        }
        let packed = pack::sky(sky.light(), self.bands);
        match packed.iter().flat_map(|block| block.to_array()).find(|v| !v.is_finite()) {
            Some(got) => Err(RelightingError::Value {
                what: "a coefficient of the sky",
                got: got.into(),
                expected: "finite in f32",
            }),
            None => Ok(packed),
        }
    }

    pub(super) fn packed_rotation(&self, rotation: DMat3) -> Result<Vec<f32>, RelightingError> {
        Ok(pack::rotation(&ShRotation::new(self.bands, rotation)?))
    }

    pub(super) fn view(&self, camera: &Camera) -> Result<asm_core::shared::view::View, RelightingError> {
        let opening = camera.yfov_rad;
        if !(opening > 0.0 && opening < std::f64::consts::PI) {
            let expected = "above 0 and below pi";
            return Err(RelightingError::Value { what: "the camera's opening, rad", got: opening, expected });
        }
        let frame = camera.world_from_camera.to_cols_array();
        if let Some(&got) = frame.iter().chain([&camera.znear_m]).find(|v| !v.is_finite()) {
            let what = "a number of the camera";
            return Err(RelightingError::Value { what, got, expected: "finite" });
        }
        Ok(self.space.camera_view(camera, UVec2::from(self.size) * self.samples))
    }

    pub(super) fn exposed(&self, exposure: &Exposure) -> Result<PrtPicture, RelightingError> {
        let factor = exposure.factor;
        if !(factor.is_finite() && factor >= 0.0) {
            let expected = "finite and not negative";
            return Err(RelightingError::Value { what: "the exposure", got: factor, expected });
        }
        // Radiance of a matt surface is irradiance times reflectance over pi.
        let scale = mat3::diagonal([factor * FRAC_1_PI; 3]);
        let shown: Mat3 =
            exposure.balance.map_or(scale, |balance| mat3::multiply(&scale, &balance.display_from_light()));
        let column = |c: usize| glam::DVec3::new(shown[0][c], shown[1][c], shown[2][c]).as_vec3();
        Ok(PrtPicture {
            shown_from_x: column(0),
            blocks: self.blocks(),
            shown_from_y: column(1),
            samples: self.samples,
            shown_from_z: column(2),
            camera_view: 0,
            size: UVec2::from(self.size),
            reserved: UVec2::ZERO,
        })
    }
}
