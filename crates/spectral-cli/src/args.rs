//! The command line, as clap sees it. What the options mean together is checked in [`crate::run_options`].

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use spectral_core::dispersion::OffsetConvention;
use spectral_core::header::Format;
use spectral_core::observer::Observer;
use spectral_core::wavelengths::Scheme;

use crate::choices::{Backend, Fit, Gaps, Glass, Method, Reflected, Rule, Way};
use crate::pond::PondArgs;
use crate::prt::PrtArgs;
use crate::values::{self, Exposure, Size, WavelengthRange};
use crate::view::ViewArgs;

/// Texels of a bake if nothing else is said.
pub(crate) const DEFAULT_BAKE_SIZE: Size = Size { width: 256, height: 256 };
/// Pixels of a picture if nothing else is said.
pub(crate) const DEFAULT_RENDER_SIZE: Size = Size { width: 1280, height: 720 };

/// Real-time spectral light transport: dispersion and caustics, checked against an f64 oracle.
///
/// SCENE is a glTF file (.gltf, .glb) or the name of a bundled scene.
/// Exit status: 0 done, 1 failed, 2 bad usage.
#[derive(Debug, Parser)]
#[command(name = "spectral", version, disable_help_subcommand = true, arg_required_else_help = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Print a wavelength set, its K_n matrices and index offsets as a shader header.
    Matrices(MatricesArgs),
    /// Compute the irradiance on a receiver's UVs.
    Bake(BakeArgs),
    /// Render a picture through the scene's first camera.
    Render(RenderArgs),
    /// Print what a scene calls for: effects, passes and resources, with reasons.
    Plan(PlanArgs),
    /// Compute the light on the floor of a pond.
    Pond(PondArgs),
    /// Show matt surfaces under a spectral sky, by precomputed transfer.
    Prt(PrtArgs),
    /// List what can run plans on this machine.
    Devices(DevicesArgs),
    /// Write a scene as glTF.
    Export(ExportArgs),
    /// Show a scene in a window: orbit, drag the lamp, move the glass, switch methods; or the pond, to drop pebbles into.
    View(ViewArgs),
}

#[derive(Debug, Args)]
pub(crate) struct MatricesArgs {
    /// Number of wavelengths [default: 7; fraunhofer has 3 (default) or 4].
    #[arg(short = 'n', value_name = "N", value_parser = values::set_wavelengths, allow_negative_numbers = true)]
    pub(crate) wavelengths: Option<usize>,
    /// How wavelengths and weights are chosen: fraunhofer, gauss, uniform, equal-energy, asm2013 or optimal.
    #[arg(long, value_name = "SCHEME", default_value_t)]
    pub(crate) scheme: Scheme,
    /// Range the wavelengths are taken from, nm; fraunhofer and asm2013 have their own.
    #[arg(long, value_name = "LOW..HIGH", default_value = "420..680", allow_hyphen_values = true)]
    pub(crate) range: WavelengthRange,
    /// Colour-matching functions: cie1931, cie1964 or wyman2013.
    #[arg(long, value_name = "CMF", default_value_t)]
    pub(crate) cmf: Observer,
    /// Lines that the index offsets refer to: specgen (D, 589.3 nm) or gltf (d, 587.56 nm).
    #[arg(long, value_name = "LINES", default_value_t)]
    pub(crate) offsets: OffsetConvention,
    /// Language of the header: glsl, hlsl, wgsl, msl, c, rust, json or text.
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    pub(crate) format: Format,
    /// File to write [default: standard output].
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct BakeArgs {
    /// glTF file or bundled scene.
    pub(crate) scene: String,
    /// Object whose UV square receives the light [default: `receiver`, or the scene's only one].
    #[arg(long, value_name = "NAME")]
    pub(crate) receiver: Option<String>,
    /// Texels in u and v.
    #[arg(long, value_name = "WxH", default_value_t = DEFAULT_BAKE_SIZE, allow_hyphen_values = true)]
    pub(crate) size: Size,
    /// EXR file to write: XYZ in lux, total and direct, refracted, reflected.
    #[arg(short, long, value_name = "OUT.exr")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    /// glTF file or bundled scene.
    pub(crate) scene: String,
    /// Width and height in pixels.
    #[arg(long, value_name = "WxH", default_value_t = DEFAULT_RENDER_SIZE, allow_hyphen_values = true)]
    pub(crate) size: Size,
    /// Factor on the picture before the tone map of a PNG; auto is 1 / the 99th percentile of Y.
    #[arg(long, value_name = "E", default_value = "auto", allow_hyphen_values = true)]
    pub(crate) exposure: Exposure,
    /// Picture to write: .exr holds linear sRGB without exposure, .png the displayed picture.
    #[arg(short, long, value_name = "OUT.exr|OUT.png")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

/// What runs plans.
#[derive(Debug, Args)]
pub(crate) struct DeviceArgs {
    /// What runs the plan: auto, cpu, wgpu or vulkan.
    #[arg(long, value_name = "BACKEND", default_value = "auto")]
    pub(crate) backend: Backend,
    /// GPU adapter, by a part of its name; see `spectral devices`.
    #[arg(long, value_name = "NAME", value_parser = values::adapter)]
    pub(crate) adapter: Option<String>,
    /// CPU threads [default: one per core].
    #[arg(long, value_name = "N", value_parser = values::threads, allow_negative_numbers = true)]
    pub(crate) threads: Option<usize>,
}

/// What `bake` and `render` share.
#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    /// How light is computed: reference, caustics-map, acm, asm or footprint.
    #[arg(long, value_name = "METHOD", default_value = "footprint")]
    pub(crate) method: Method,
    /// Number of wavelengths [default: the method's].
    #[arg(long, value_name = "N", value_parser = values::any_wavelengths, allow_negative_numbers = true)]
    pub(crate) wavelengths: Option<usize>,
    /// Most internal reflections that are followed [default: the method's].
    #[arg(long, value_name = "B", value_parser = values::bounces, allow_negative_numbers = true)]
    pub(crate) bounces: Option<u32>,
    #[command(flatten)]
    pub(crate) device: DeviceArgs,
    /// Seed of the random numbers, for the methods that draw any.
    #[arg(long, value_name = "S", default_value_t = 0, value_parser = values::seed, allow_negative_numbers = true)]
    pub(crate) seed: u64,
    /// Photons to trace; few also mean fewer shadow rays per texel of a bake (reference only).
    #[arg(
        long,
        value_name = "P",
        value_parser = values::photons,
        allow_negative_numbers = true,
        conflicts_with = "noise"
    )]
    pub(crate) photons: Option<u64>,
    /// Relative standard error to reach (reference only).
    #[arg(long, value_name = "X", value_parser = values::noise, allow_negative_numbers = true)]
    pub(crate) noise: Option<f64>,
    #[command(flatten)]
    pub(crate) plan: PlanOptions,
    #[command(flatten)]
    pub(crate) price: PriceOptions,
    /// JSON file for settings, device, statistics and times.
    #[arg(long, value_name = "STATS.json")]
    pub(crate) stats: Option<PathBuf>,
}

/// Let the price list of scene and device choose method and settings.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct PriceOptions {
    /// Take the settings nearest to the oracle whose frame takes at most X ms here; measured on first use, then kept.
    #[arg(
        long,
        value_name = "X",
        value_parser = values::positive,
        allow_negative_numbers = true,
        conflicts_with_all = CHOSEN_BY_PRICE,
        conflicts_with = "target_de"
    )]
    pub(crate) budget_ms: Option<f64>,
    /// Take the fastest settings whose caustic has at most this mean CIEDE2000 from the oracle.
    #[arg(
        long,
        value_name = "X",
        value_parser = values::positive,
        allow_negative_numbers = true,
        conflicts_with_all = CHOSEN_BY_PRICE
    )]
    pub(crate) target_de: Option<f64>,
}

/// What the price list chooses, or what belongs to the reference.
const CHOSEN_BY_PRICE: [&str; 16] = [
    "method",
    "wavelengths",
    "refraction",
    "bounces",
    "photons",
    "noise",
    "levels",
    "scheme",
    "map_fit",
    "gap_filling",
    "rule",
    "glass",
    "reflections",
    "gap_radius",
    "gap_samples",
    "gap_threshold",
];

#[derive(Debug, Args)]
pub(crate) struct PlanArgs {
    /// glTF file or bundled scene.
    pub(crate) scene: String,
    /// Method to plan for: caustics-map, acm, asm or footprint.
    #[arg(long, value_name = "METHOD", default_value = "footprint")]
    pub(crate) method: Method,
    /// Number of wavelengths [default: the method's].
    #[arg(long, value_name = "N", value_parser = values::traced_wavelengths, allow_negative_numbers = true)]
    pub(crate) wavelengths: Option<usize>,
    #[command(flatten)]
    pub(crate) plan: PlanOptions,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Options of the methods that run plans.
#[derive(Clone, Debug, Args)]
pub(crate) struct PlanOptions {
    /// How light finds its way through glass: image-space or traced [default: the method's].
    #[arg(long, value_name = "HOW")]
    pub(crate) refraction: Option<Way>,
    /// Levels of adaptive photon emission, 0 for a fixed grid [default: the method's].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=8), allow_negative_numbers = true)]
    pub(crate) levels: Option<u32>,
    /// How the wavelengths of a photon are chosen, as for `matrices` [default: the method's].
    #[arg(long, value_name = "SCHEME")]
    pub(crate) scheme: Option<Scheme>,
    /// What a light's map shows: receivers, or finer the landings of this frame's light [default: the method's].
    #[arg(long, value_name = "WHAT")]
    pub(crate) map_fit: Option<Fit>,
    /// How gaps between wavelengths are filled: none, paper, paper-literal or disc [default: the method's].
    #[arg(long, value_name = "HOW")]
    pub(crate) gap_filling: Option<Gaps>,
    /// What glass does with light: fresnel or glsl, which is GLSL's refract() [default: fresnel].
    #[arg(long, value_name = "RULE")]
    pub(crate) rule: Option<Rule>,
    /// How a camera sees glass: straight or deferred refraction [default: the method's].
    #[arg(long, value_name = "HOW")]
    pub(crate) glass: Option<Glass>,
    /// Which reflections throw caustics: none, mirrors, or all, which is the outside of glass too [default: mirrors].
    #[arg(long, value_name = "WHICH")]
    pub(crate) reflections: Option<Reflected>,
    /// Reach of gap filling, texels of the map.
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u32).range(1..=15), allow_negative_numbers = true)]
    pub(crate) gap_radius: Option<u32>,
    /// Random samples of the paper's gap filling.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64), allow_negative_numbers = true)]
    pub(crate) gap_samples: Option<u32>,
    /// Hits that make a gap.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000), allow_negative_numbers = true)]
    pub(crate) gap_threshold: Option<u32>,
}

#[derive(Debug, Args)]
pub(crate) struct DevicesArgs {
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// glTF file or bundled scene.
    pub(crate) scene: String,
    /// Binary glTF file to write.
    #[arg(short, long, value_name = "FILE.glb")]
    pub(crate) output: PathBuf,
}
