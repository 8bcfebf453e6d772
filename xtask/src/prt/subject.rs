//! What is compared and priced.

use std::f64::consts::PI;

use anyhow::{Context, Result};
use glam::DVec3;
use spectral_core::color_checker;
use spectral_core::illuminant::Illuminant;
use spectral_prt::figures::{self, Figure, GRID, sky_shape};
use spectral_prt::{Albedo, Bands, IndexMap, Surface, sh};
use spectral_scene::{Camera, bundled};

/// A figure under lamps.
pub struct PrtSubject {
    /// Name for reports.
    pub name: &'static str,
    /// Lamps, one after the other.
    pub lamps: &'static [Illuminant],
    /// Where their light comes from.
    pub sky: SkyShape,
    /// Rays per vertex. What they miss of a shadow, frames and references miss alike.
    pub(super) rays: u32,
    pub(super) figure: fn() -> Result<Figure>,
}

/// Strength of light over directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SkyShape {
    /// The same from everywhere.
    Even,
    /// The figures' own.
    Overcast,
    /// A lamp with soft edges in a dim sky: narrower than few bands can tell.
    SoftBox,
}

/// Where the soft box stands, its standard deviation in radians, and the sky about it as a share of its irradiance.
const BOX_DIRECTION: DVec3 = DVec3::new(-0.6, 0.5, 0.8);
const BOX_SIGMA_RAD: f64 = PI / 9.0;
const BOX_SKY: f64 = 0.3;

impl SkyShape {
    /// Harmonic coefficients, for [`spectral_prt::Sky::of_shape`].
    #[must_use]
    pub fn shape(self, bands: Bands) -> Vec<f64> {
        let mut even = vec![0.0; bands.coefficients()];
        even[0] = 2.0 * PI.sqrt();
        match self {
            Self::Even => even,
            Self::Overcast => sky_shape(bands),
            Self::SoftBox => {
                // A point that heat has spread from: exp(-l (l + 1) sigma^2 / 2) of each degree is left.
                let mut shape = sh::harmonics(bands, BOX_DIRECTION.normalize());
                for (k, (s, even)) in shape.iter_mut().zip(even).enumerate() {
                    let degree = (k as f64).sqrt().floor();
                    *s *= (-0.5 * degree * (degree + 1.0) * BOX_SIGMA_RAD.powi(2)).exp();
                    *s += BOX_SKY / PI * even;
                }
                shape
            }
        }
    }
}

/// Figures that are compared.
pub const PRT: [PrtSubject; 4] = [
    PrtSubject {
        name: "prt-color-checker",
        lamps: &[Illuminant::Fl4],
        sky: SkyShape::Overcast,
        rays: 256,
        figure: painted_knot,
    },
    PrtSubject {
        name: "prt-metacow",
        lamps: &[Illuminant::D65, Illuminant::A, Illuminant::Fl2],
        sky: SkyShape::Overcast,
        rays: 32,
        figure: metacow,
    },
    PrtSubject {
        name: "prt-patches",
        lamps: &[Illuminant::Fl4],
        sky: SkyShape::Even,
        rays: 1,
        figure: patches,
    },
    PrtSubject {
        name: "prt-furnace",
        lamps: &[Illuminant::A, Illuminant::Fl11],
        sky: SkyShape::Even,
        rays: 1,
        figure: white_ball,
    },
];

/// Figures of the price list: a soft sky, where directions cost next to nothing, and a lamp.
pub const PRICED_PRT: [PrtSubject; 2] = [
    PrtSubject { name: "prt-overcast", ..PRT[0] },
    PrtSubject { name: "prt-soft-box", sky: SkyShape::SoftBox, ..PRT[0] },
];

/// The name of all of them together.
const ALL: &str = "prt";

/// Those of `subjects` with these names; all of them where none is named, the first in a quick run.
#[must_use]
pub fn named_prt(subjects: &'static [PrtSubject], names: &[String], quick: bool) -> Vec<&'static PrtSubject> {
    let wanted = |subject: &&PrtSubject| match names {
        [] => !quick || subject.name == subjects[0].name,
        names => names.iter().any(|name| name == subject.name || name == ALL),
    };
    subjects.iter().filter(wanted).collect()
}

/// Whether this names one of `subjects`, or all, and no scene.
#[must_use]
pub fn is_prt(subjects: &[PrtSubject], name: &str) -> bool {
    name == ALL || subjects.iter().any(|subject| subject.name == name)
}

fn painted_knot() -> Result<Figure> {
    Ok(figures::painted_knot())
}

fn metacow() -> Result<Figure> {
    Ok(figures::metacow()?.0)
}

/// The ColorChecker itself, seen from the front.
fn patches() -> Result<Figure> {
    let corners = [(-1.5, 1.0), (1.5, 1.0), (1.5, -1.0), (-1.5, -1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
    let surface = Surface::new(&corners, &[DVec3::Z; 4], &[[0, 3, 1], [1, 3, 2]])?;
    let uvs = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    Ok(Figure {
        surfaces: vec![surface],
        reflectances: color_checker::sampled(&GRID),
        index_maps: vec![IndexMap::new([6, 4], (0..24).collect())?],
        albedos: vec![Albedo::Indexed { map: 0, uvs }],
        // Each is 40 pixels across in a picture of 320 x 180.
        camera: Camera {
            yfov_rad: 2.0 * (1.125_f64 / DISTANCE_M).atan(),
            ..Camera::look_at(DVec3::new(0.0, 0.0, DISTANCE_M), DVec3::ZERO)
        },
        rays: 1,
    })
}

/// From the patches to the eye.
const DISTANCE_M: f64 = 4.0;

/// A white ball: nothing blocks its sky. The chart is there for the basis.
fn white_ball() -> Result<Figure> {
    let scene = bundled("sphere").context("the bundled scene")?;
    let ball = scene.refractors().next().context("a ball in the bundled scene")?;
    let surface = Surface::of_object(&scene, ball)?;
    let (low, high) = surface
        .positions()
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)));
    let (centre, reach) = (0.5 * (low + high), low.distance(high));
    let mut reflectances = color_checker::sampled(&GRID);
    reflectances.push(GRID.sample(|_| 1.0));
    Ok(Figure {
        albedos: vec![Albedo::Entry(reflectances.len() as u32 - 1)],
        surfaces: vec![surface],
        reflectances,
        index_maps: Vec::new(),
        camera: Camera {
            yfov_rad: 0.6,
            ..Camera::look_at(centre + reach * DVec3::new(0.3, 0.4, 1.5), centre)
        },
        rays: 1,
    })
}
