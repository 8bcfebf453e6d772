//! What a caller may choose.

use serde::{Deserialize, Serialize};
use spectral_core::observer::{Observer, VISIBLE_NM};
use spectral_core::wavelengths::{DEFAULT_RANGE_NM, Scheme};

use crate::PlanError;
use crate::passes::photon_path::MOST_ORDERS;
use crate::shared::crossing::{RULE_FRESNEL, RULE_GLSL};
use crate::shared::footprint::MOST_NODES;

/// How caustics are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Caustics mapping (Shah, Konttinen & Pattanaik), per wavelength: a photon per texel of the light's view.
    CausticsMap,
    /// Adaptive caustic maps (Wyman & Nichols 2009): photons refined where glass is, one wavelength.
    Acm,
    /// Adaptive spectral mapping (Blanchette & Agu 2013): as [`Method::Acm`], split into wavelengths, gaps filled.
    Asm,
    /// Spectral footprints: cells of light, few wavelengths each, laid down as a continuous function of place and wavelength
    /// along paths through the scene's geometry.
    #[default]
    Footprint,
}

impl Method {
    /// As the command line and JSON have it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::CausticsMap => "caustics-map",
            Self::Acm => "acm",
            Self::Asm => "asm",
            Self::Footprint => "footprint",
        }
    }
}

/// Where photons start in the light's view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Emission {
    /// In every texel.
    Grid,
    /// In tiles of 8 x 8 texels, a workgroup each, found by descending a mip chain: where a cell shows no glass, nothing below
    /// it is looked at. The same photons as [`Emission::Grid`]'s, less most of those that miss.
    Adaptive {
        /// Levels that are looked at, 1 to 8; the coarsest has cells of 2^(levels - 1) tiles along each side.
        levels: u32,
    },
}

/// How light finds its way through glass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Refraction {
    /// By what the light sees of the glass: in at its front, out at the back face that an image of them shows, on to what an image of
    /// the receivers shows. Two interfaces of one refractor.
    ImageSpace,
    /// Along paths through the scene's geometry: through every surface, with [`Settings::bounces`] reflections inside the first
    /// glass.
    Traced,
}

impl Refraction {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::ImageSpace, Self::Traced];

    /// As the command line and JSON have it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::ImageSpace => "image-space",
            Self::Traced => "traced",
        }
    }
}

/// What an interface does with light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RefractionRule {
    /// Snell's law and Fresnel's equations; total reflection is told apart and counted.
    #[default]
    Fresnel,
    /// GLSL's `refract()`, as the shaders of the papers have it: nothing is reflected, and at total reflection it returns the
    /// zero vector. Such a photon stays where it is: it is put down under that place and counted as astray.
    Glsl,
}

impl RefractionRule {
    /// As shaders know it.
    pub(crate) fn code(self) -> u32 {
        match self {
            Self::Fresnel => RULE_FRESNEL,
            Self::Glsl => RULE_GLSL,
        }
    }
}

/// Which reflections throw caustics: light goes back from the first surface that it meets, once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reflections {
    /// None.
    None,
    /// Those of mirrors.
    #[default]
    Mirrors,
    /// Those of mirrors and of the outside of glass, which takes a second pass of photons over the glass.
    All,
}

/// How a camera sees glass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GlassView {
    /// As a tint on what is straight behind it.
    Straight,
    /// Deferred refraction: each wavelength is bent at front and back and fetches the background where it leads.
    Deferred,
}

/// How gaps between the wavelengths of a map are filled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GapFilling {
    /// Not at all.
    None,
    /// As the text of Blanchette & Agu 2013 has it: random samples round each texel; where at least the threshold hit light,
    /// the mean of the hits and the texel. Light is not kept.
    Paper,
    /// As their Fig. 9 prints it: where more than the threshold hit light, the sum of the hits. Light is not kept.
    PaperLiteral,
    /// Gaps, and lit texels within twice the radius of one, exchange light with each other within the radius: no pattern, every
    /// unit kept, and what is even, or far from gaps, stays as it is.
    Disc,
}

/// What the views of a light's map are fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MapFit {
    /// All that may be lit.
    Receivers,
    /// Where this frame's light lands, told from a part of the photons, on the device. Only as fine as photons are dense and as
    /// a bake's samples resolve. Not for [`Settings::shah_intensity`], whose light depends on the size of texels.
    Landings,
}

/// The range of the wavelengths of Blanchette & Agu 2013, nm.
const ASM_RANGE_NM: (f64, f64) = (380.0, 680.0);

/// How a photon is put into the map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Splat {
    /// Into the one texel where it lands.
    Point,
    /// Over the texels round it.
    Gaussian {
        /// Reach to each side, texels, 1 to 8; the standard deviation is half of it.
        radius: u32,
    },
    /// A Gaussian as wide as the photon's beam: its standard deviation is 0.6 of the distance to where the next photon of
    /// the emission view lands, but at least half a texel of the map and at most 3.3.
    Auto,
}

/// How `rayGeo` improves its guess of a landing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LandingUpdate {
    /// Shah's: the distance from the ray's origin to the surface that the light sees over the last guess.
    Distance,
    /// The ray's own crossing of the plane of that surface: exact in one step on a flat receiver.
    #[default]
    Plane,
}

/// How many interfaces refract.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Interfaces {
    /// Only where light enters (Shah).
    One,
    /// Where it enters and where it leaves (Wyman 2005).
    #[default]
    Two,
}

/// Settings of a plan. The default is physical; [`Settings::shah`] is the tutorial's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// How caustics are made.
    pub method: Method,
    /// Wavelengths per photon; `None` is 7, and 1 for [`Method::Acm`]. One wavelength is the d line, where glTF states the index
    /// of refraction. A line light always has one, its own.
    pub wavelengths: Option<u32>,
    /// How they are chosen; `None` is [`Scheme::Optimal`], but [`Scheme::Uniform`] for [`Method::Asm`] with more than 7.
    pub scheme: Option<Scheme>,
    /// What from, nm; `None` is 380 to 780 for [`Scheme::Optimal`], whose nodes are placed for all that is visible, 380 to 680
    /// (the paper's) for the others of [`Method::Asm`], else 420 to 680 (SPECGEN's). Schemes with fixed wavelengths ignore it.
    pub range_nm: Option<(f64, f64)>,
    /// The colour-matching functions behind XYZ.
    pub observer: Observer,
    /// Texels of the emission view, along each side; [`Method::Footprint`] has a cell between each four of them.
    pub emission_size: u32,
    /// Where photons start; `None` is [`Emission::Grid`] for [`Method::CausticsMap`], 6 levels for [`Method::Acm`] and 3 for
    /// [`Method::Asm`].
    pub emission: Option<Emission>,
    /// Texels of the map, along each side; `None` is the larger side of a bake within 512 to 2048, and 512 for
    /// pictures.
    pub map_size: Option<u32>,
    /// What the map shows; `None` is [`MapFit::Landings`], but [`MapFit::Receivers`] for [`Method::Asm`], whose gaps are filled over
    /// a number of texels.
    pub map_fit: Option<MapFit>,
    /// How gaps in the map are filled; `None` is [`GapFilling::Disc`] for [`Method::Asm`] and [`GapFilling::None`] for the
    /// others. Only where light is split.
    pub gap_filling: Option<GapFilling>,
    /// Reach of gap filling, texels, 1 to 15.
    pub gap_radius: u32,
    /// Random samples of the paper's rules, 1 to 64.
    pub gap_samples: u32,
    /// Hits among the samples, at least 1. For [`GapFilling::Disc`]: lit texels that face each other across a gap.
    pub gap_threshold: u32,
    /// Steps of `rayGeo`.
    pub ray_geo_iterations: u32,
    /// What a step is.
    pub ray_geo_update: LandingUpdate,
    /// Steps of the search for the back face.
    pub exit_iterations: u32,
    /// How many interfaces refract in image space.
    pub interfaces: Interfaces,
    /// How light finds its way through glass; `None` is [`Refraction::Traced`] for [`Method::Footprint`], which knows no other, and
    /// [`Refraction::ImageSpace`] for the others.
    pub refraction: Option<Refraction>,
    /// What an interface does with light, in the map and before the camera.
    pub refraction_rule: RefractionRule,
    /// Which reflections throw caustics.
    pub reflections: Reflections,
    /// How a camera sees glass; `None` is [`GlassView::Straight`] for [`Method::CausticsMap`] and [`GlassView::Deferred`] for the
    /// others.
    pub glass_view: Option<GlassView>,
    /// Reflections inside glass that light is followed through where refraction is traced; in image space none is.
    pub bounces: u32,
    /// How often a cell of [`Method::Footprint`] may be split where its paths go apart.
    pub cell_splits: u32,
    /// Total reflections inside glass that the camera's rays follow; the papers follow none.
    pub view_bounces: u32,
    /// How a photon is put into the map.
    pub splat: Splat,
    /// Samples per texel of a bake, along each side; more where the map is finer, fewer where the device has no texture for
    /// them.
    pub bake_samples: u32,
    /// Samples per pixel of a picture, along each side; fewer where the device has no texture for them.
    pub picture_samples: u32,
    /// Shah's intensity: every photon brings this times 4 / `emission_size` of the light's illuminance to its texel, instead
    /// of its flux. `None` keeps energy.
    pub shah_intensity: Option<f64>,
    /// Shah's exponent on the map (1.3 in the tutorial), in pictures on what surfaces reflect. `None` keeps energy.
    pub artistic_power: Option<f64>,
    /// Which lights shine, by index; `None` is all.
    pub lights: Option<Vec<usize>>,
    /// Leave out what the scene does not call for.
    pub prune: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self::of(Method::default())
    }
}

impl Settings {
    /// The defaults of a method.
    pub fn of(method: Method) -> Self {
        Self {
            method,
            wavelengths: None,
            scheme: None,
            range_nm: None,
            observer: Observer::Cie1931,
            emission_size: if method == Method::Footprint { 128 } else { 512 },
            emission: None,
            map_size: None,
            map_fit: None,
            gap_filling: None,
            gap_radius: 7,
            gap_samples: 15,
            gap_threshold: 10,
            ray_geo_iterations: 4,
            ray_geo_update: LandingUpdate::Plane,
            exit_iterations: 8,
            interfaces: Interfaces::Two,
            refraction: None,
            refraction_rule: RefractionRule::Fresnel,
            reflections: Reflections::Mirrors,
            glass_view: None,
            bounces: 3,
            cell_splits: 3,
            view_bounces: 3,
            splat: Splat::Auto,
            bake_samples: 4,
            picture_samples: 2,
            shah_intensity: None,
            artistic_power: None,
            lights: None,
            prune: true,
        }
    }

    /// What the tutorial has: 100 x 100 vertices, one interface, one step of `rayGeo`, soft splats, its intensity of 1000 and its
    /// exponent of 1.3. Energy is not kept.
    pub fn shah() -> Self {
        Self {
            emission_size: 100,
            ray_geo_iterations: 1,
            ray_geo_update: LandingUpdate::Distance,
            interfaces: Interfaces::One,
            splat: Splat::Gaussian { radius: 2 },
            shah_intensity: Some(1000.0),
            artistic_power: Some(1.3),
            ..Self::of(Method::CausticsMap)
        }
    }

    /// Number of wavelengths.
    pub fn wavelength_count(&self) -> u32 {
        self.wavelengths.unwrap_or(match self.method {
            Method::Acm => 1,
            Method::Footprint => 3,
            Method::CausticsMap | Method::Asm => 7,
        })
    }

    /// How wavelengths are chosen.
    pub fn scheme(&self) -> Scheme {
        let many = self.method == Method::Asm && self.wavelength_count() > 7;
        self.scheme.unwrap_or(if many { Scheme::Uniform } else { Scheme::Optimal })
    }

    /// The range that wavelengths are chosen from, nm.
    pub fn range_nm(&self) -> (f64, f64) {
        self.range_nm.unwrap_or(match (self.scheme(), self.method) {
            (Scheme::Optimal, _) => VISIBLE_NM,
            (_, Method::Asm) => ASM_RANGE_NM,
            _ => DEFAULT_RANGE_NM,
        })
    }

    /// Where photons start.
    pub fn emission(&self) -> Emission {
        if self.method == Method::Footprint {
            return Emission::Grid; // cells are split where they need it
        }
        self.emission.unwrap_or(match self.method {
            Method::CausticsMap | Method::Footprint => Emission::Grid,
            Method::Acm => Emission::Adaptive { levels: 6 },
            Method::Asm => Emission::Adaptive { levels: 3 },
        })
    }

    /// How light finds its way through glass.
    pub fn refraction(&self) -> Refraction {
        self.refraction.unwrap_or(match self.method {
            Method::Footprint => Refraction::Traced,
            Method::CausticsMap | Method::Acm | Method::Asm => Refraction::ImageSpace,
        })
    }

    /// What the map shows.
    pub fn map_fit(&self) -> MapFit {
        if self.shah_intensity.is_some() {
            return MapFit::Receivers;
        }
        self.map_fit.unwrap_or(match self.method {
            Method::CausticsMap | Method::Acm | Method::Footprint => MapFit::Landings,
            Method::Asm => MapFit::Receivers,
        })
    }

    /// How gaps in the map are filled.
    pub fn gap_filling(&self) -> GapFilling {
        self.gap_filling.unwrap_or(match self.method {
            Method::Asm => GapFilling::Disc,
            Method::CausticsMap | Method::Acm | Method::Footprint => GapFilling::None,
        })
    }

    /// How a camera sees glass.
    pub fn glass_view(&self) -> GlassView {
        self.glass_view.unwrap_or(match self.method {
            Method::CausticsMap => GlassView::Straight,
            Method::Acm | Method::Asm | Method::Footprint => GlassView::Deferred,
        })
    }

    /// Checks what does not depend on the scene.
    pub(crate) fn check(&self) -> Result<(), PlanError> {
        check_count("emission_size", self.emission_size, 1, 16_384)?;
        check_count("wavelengths", self.wavelength_count(), 1, 4096)?;
        check_count("ray_geo_iterations", self.ray_geo_iterations, 1, 256)?;
        check_count("exit_iterations", self.exit_iterations, 1, 256)?;
        check_count("gap_radius", self.gap_radius, 1, 15)?;
        check_count("gap_samples", self.gap_samples, 1, 64)?;
        check_count("gap_threshold", self.gap_threshold, 1, 1000)?;
        check_count("bounces", self.bounces, 0, MOST_ORDERS - 1)?;
        self.check_refraction()?;
        check_count("cell_splits", self.cell_splits, 0, 8)?;
        if self.method == Method::Footprint {
            check_count("emission_size", self.emission_size, 2, 16_384)?;
            check_count("wavelengths", self.wavelength_count(), 1, MOST_NODES as u32)?;
        }
        check_count("view_bounces", self.view_bounces, 0, 64)?;
        check_count("bake_samples", self.bake_samples, 1, 16)?;
        check_count("picture_samples", self.picture_samples, 1, 16)?;
        if let Some(size) = self.map_size {
            check_count("map_size", size, 1, 16_384)?;
        }
        if let Emission::Adaptive { levels } = self.emission() {
            check_count("emission levels", levels, 1, 8)?;
        }
        if let Splat::Gaussian { radius } = self.splat {
            check_count("splat radius", radius, 1, 8)?;
        }
        check_positive("shah_intensity", self.shah_intensity)?;
        check_positive("artistic_power", self.artistic_power)
    }
}

impl Settings {
    fn check_refraction(&self) -> Result<(), PlanError> {
        let refused = |setting, got: &str, expected: &str| {
            Err(PlanError::Setting { setting, got: got.into(), expected: expected.into() })
        };
        match (self.refraction(), self.method, self.interfaces) {
            (Refraction::ImageSpace, Method::Footprint, _) => refused(
                "refraction",
                "image-space",
                "traced with method footprint, which tells by the surfaces on its paths what belongs together",
            ),
            (Refraction::Traced, _, Interfaces::One) => refused(
                "interfaces",
                "one",
                "two where refraction is traced, which goes through every surface",
            ),
            _ => Ok(()),
        }
    }
}

fn check_count(setting: &'static str, got: u32, min: u32, max: u32) -> Result<(), PlanError> {
    if (min..=max).contains(&got) {
        return Ok(());
    }
    Err(PlanError::Setting { setting, got: got.to_string(), expected: format!("{min} to {max}") })
}

fn check_positive(setting: &'static str, got: Option<f64>) -> Result<(), PlanError> {
    match got {
        Some(got) if !(got > 0.0 && got.is_finite()) => {
            Err(PlanError::Setting { setting, got: got.to_string(), expected: "above 0 and finite".into() })
        }
        _ => Ok(()),
    }
}
