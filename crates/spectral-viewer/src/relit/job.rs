//! A picture to be made.

use glam::DQuat;
use spectral_core::illuminant::Illuminant;
use spectral_scene::Camera;

use super::choices::Colors;
use crate::subject::Job;

/// Surfaces under a sky, as somebody sees them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RelitJob {
    /// What light and albedos are multiplied in.
    pub(super) colors: Colors,
    /// Samples along a side of a pixel.
    pub(super) samples: u32,
    /// Pixels.
    pub(super) size: [u32; 2],
    /// In whose light; none for the sky's own.
    pub(super) lamp: Option<Illuminant>,
    /// How the sky is turned.
    pub(super) turn: DQuat,
    /// Who looks.
    pub(super) camera: Camera,
}

impl Job for RelitJob {
    type Facts = ();

    fn size(&self) -> [u32; 2] {
        self.size
    }
}
