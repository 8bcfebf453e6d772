//! What a pond is besides its surface: water, light, and the rules by which its floor is lit.

use serde::{Deserialize, Serialize};

use crate::error::{PondError, check_at_least, check_finite, check_positive};
use crate::height_field::{HeightField, check_values};

/// Which integral is meant; see `docs/src/methods/pond.md` for the errata.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// Facets as large as they are, a lobe normalised over directions, the inverse square of the distance: flux is conserved.
    #[default]
    Physical,
    /// Eq. 2 of the paper with |P_z|, and the factor n in the discretised sum: brightness in arbitrary units.
    Paper,
}

/// How normals follow from heights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Normals {
    /// Differences of the two neighbours, second order.
    #[default]
    Central,
    /// The plane through h(i, j), h(i + 1, j) and h(i, j + 1), as the paper has it.
    OneSided,
}

/// What is outside of the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outside {
    /// No light comes in from there.
    #[default]
    Dark,
    /// The pond again, without end.
    Periodic,
}

/// Light that reaches the surface: L_s.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Illumination {
    /// The same everywhere: irradiance perpendicular to the light, in the unit that the floor's comes out in (lux, W/m^2).
    Uniform(f64),
    /// That irradiance at every sample of the surface (Fig. 3 of the paper).
    Map(Vec<f64>),
}

/// A pond without its surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pond {
    /// Depth d of the floor below the water at rest, metres.
    pub depth_m: f64,
    /// Index of refraction above the surface, n_i.
    pub ior_above: f64,
    /// Index of refraction of the water, n_t.
    pub ior_below: f64,
    /// Extinction epsilon, 1/m: light loses exp(-epsilon s) on a way of s metres.
    pub extinction_per_m: f64,
    /// Exponent a of the lobe: cos^(2a) in the physical form, exp(-a sin^2) in the paper's. Large is clear, 0 is milk.
    pub scattering: f64,
    /// Direction of travel of the incident light, of any length; its z must be negative.
    pub light_direction: [f64; 3],
    /// How much of it there is.
    pub illumination: Illumination,
    /// Which integral is meant.
    pub form: Form,
    /// How normals follow from heights.
    pub normals: Normals,
    /// What is outside of the grid.
    pub outside: Outside,
}

impl Default for Pond {
    /// 0.3 m of water under light from straight above.
    fn default() -> Self {
        Self {
            depth_m: 0.3,
            ior_above: 1.0,
            ior_below: 1.333,
            extinction_per_m: 0.3,
            scattering: 50.0,
            light_direction: [0.0, 0.0, -1.0],
            illumination: Illumination::Uniform(1.0),
            form: Form::default(),
            normals: Normals::default(),
            outside: Outside::default(),
        }
    }
}

/// Direction of travel of light that is tilted from straight down towards +x.
#[must_use]
pub fn light_tilted_deg(angle_deg: f64) -> [f64; 3] {
    let angle = angle_deg.to_radians();
    [angle.sin(), 0.0, -angle.cos()]
}

impl Pond {
    /// Whether this pond can be under this surface.
    ///
    /// # Errors
    /// A number outside its range, light that does not come from above, a surface below the floor, an illumination that
    /// does not fit the grid.
    pub fn check(&self, surface: &HeightField) -> Result<(), PondError> {
        const NOT_NEGATIVE: &str = "finite and not negative";
        surface.check()?;
        check_at_least("depth, metres,", self.depth_m, 0.0, NOT_NEGATIVE)?;
        check_positive("index of refraction above the surface", self.ior_above)?;
        check_positive("index of refraction of the water", self.ior_below)?;
        check_at_least("extinction, 1/m,", self.extinction_per_m, 0.0, NOT_NEGATIVE)?;
        check_at_least("scattering exponent a", self.scattering, 0.0, NOT_NEGATIVE)?;
        self.light_direction.iter().try_for_each(|&x| check_finite("light direction", x))?;
        let [.., z] = self.light_direction;
        if z >= 0.0 || self.unit_light_direction()[2] >= 0.0 {
            let expected = "negative: light comes from above";
            return Err(PondError::Setting { name: "z of the light direction", got: z, expected });
        }
        check_values("height", surface.size, &surface.heights_m, "above the floor", |h| {
            self.depth_m + h >= 0.0
        })?;
        match &self.illumination {
            Illumination::Uniform(level) => check_at_least("illumination", *level, 0.0, NOT_NEGATIVE),
            Illumination::Map(levels) => {
                let allowed = |x: f64| x.is_finite() && x >= 0.0;
                check_values("illumination", surface.size, levels, NOT_NEGATIVE, allowed)
            }
        }
    }

    /// L_i: the light's direction of travel, of length 1.
    #[must_use]
    pub fn unit_light_direction(&self) -> [f64; 3] {
        // Scaled first, so that the squares of the longest and the shortest vectors stay in range.
        let largest = self.light_direction.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let scaled = self.light_direction.map(|x| x / largest);
        let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
        scaled.map(|x| x / length)
    }

    /// n_t / n_i.
    #[must_use]
    pub fn eta(&self) -> f64 {
        self.ior_below / self.ior_above
    }
}

impl Illumination {
    /// L_s at a sample.
    pub(crate) fn at(&self, sample: usize) -> f64 {
        match self {
            Self::Uniform(level) => *level,
            Self::Map(levels) => levels[sample],
        }
    }

    /// The largest L_s.
    pub(crate) fn largest(&self) -> f64 {
        match self {
            Self::Uniform(level) => *level,
            Self::Map(levels) => levels.iter().copied().fold(0.0, f64::max),
        }
    }
}
