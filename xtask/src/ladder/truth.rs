//! What a scene's rungs are held against: the oracle's bake and picture, each the mean of two independent halves, whose distance
//! tells the noise.

use std::time::Instant;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use spectral_reference::{Bake, BakeSettings, Effort as Photons, RenderSettings};
use spectral_scene::IrradianceMaps;
use xtask::kept::{Absent, Kept, Key};
use xtask::layers::{Layer, size, total};
use xtask::metrics::{Map, Metrics, compare, exposure, mean_of};
use xtask::oracle_picture::OraclePicture;
use xtask::picture_distance::mean_flip;
use xtask::subject::Subject;
use xtask::terminal_percent::percent_on_terminal;

use super::Effort;

/// The oracle's answer for a scene.
pub(super) struct Truth {
    /// The mean of two halves.
    pub(super) maps: IrradianceMaps,
    /// Where the caustic is.
    pub(super) layer: Layer,
    /// Through the first camera, if there is one.
    pub(super) picture: Option<OraclePicture>,
    /// How good the answer is.
    pub(super) noise: Noise,
}

/// How far the oracle is from itself.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Noise {
    /// Paths of one wavelength of both halves.
    pub(super) photons: u64,
    /// What they took when they were sent, seconds.
    pub(super) seconds: f64,
    /// They were kept from a run before.
    pub(super) kept: bool,
    /// Of Y at 64 x 64, relative, of the layer that is compared; from the reference's own replicates.
    pub(super) standard_error: f64,
    /// One half against the mean of both, whose own error is as large, in the layer that is compared.
    pub(super) half: Metrics,
    /// The same of all light on the receiver.
    pub(super) half_all_light: Option<Metrics>,
    /// The same of the picture: mean FLIP.
    pub(super) half_flip: Option<f64>,
}

/// What is kept with the samples.
#[derive(Serialize, Deserialize)]
struct Content {
    photons: u64,
    seconds: f64,
    /// Of each layer, of the mean of both halves.
    standard_errors: [f64; 3],
    picture: bool,
}

/// Both halves, as they are kept.
struct Halves {
    content: Content,
    kept: bool,
    maps: [IrradianceMaps; 2],
    picture: Option<OraclePicture>,
}

/// Of a scene, kept or made.
pub(super) fn of(subject: &Subject, effort: &Effort, kept: &Kept, program: &str) -> Result<Truth> {
    let settings = settings(subject, effort);
    let key = Key::of(&(&subject.scene, subject.receiver, &settings), program)?;
    let halves = match read(subject, effort, kept, &key) {
        Ok(halves) => halves,
        Err(absent) => {
            if let Absent::Damaged(what) = absent {
                eprintln!("  oracle: made again, {what}");
            }
            let halves = make(subject, &settings)?;
            kept.write(&subject.name, &key, &halves.content, &halves.samples())?;
            halves
        }
    };
    truth(subject, effort, halves)
}

/// All that the oracle is asked.
#[derive(Serialize)]
struct Settings {
    halves: [BakeSettings; 2],
    picture: Option<RenderSettings>,
}

fn settings(subject: &Subject, effort: &Effort) -> Settings {
    let half = |seed| BakeSettings {
        size: effort.receiver_size,
        effort: match effort.oracle {
            Photons::Photons(photons) => Photons::Photons(photons.div_ceil(2)),
            // Errors of independent halves add up in squares.
            Photons::Noise { relative, max_photons, max_rays } => Photons::Noise {
                relative: relative * std::f64::consts::SQRT_2,
                max_photons: max_photons.div_ceil(2),
                max_rays: max_rays.div_ceil(2),
            },
        },
        seed,
        ..BakeSettings::default()
    };
    let picture = RenderSettings {
        size: effort.picture_size,
        samples_per_pixel: effort.oracle_samples,
        photons: effort.oracle_picture_photons,
        ..RenderSettings::default()
    };
    Settings { halves: [half(0), half(1)], picture: (!subject.scene.cameras.is_empty()).then_some(picture) }
}

fn make(subject: &Subject, settings: &Settings) -> Result<Halves> {
    let start = Instant::now();
    let bake = |half: &BakeSettings| {
        let progress = percent_on_terminal("oracle");
        spectral_reference::bake(&subject.scene, subject.receiver, half, &progress).context("oracle")
    };
    let bakes = [bake(&settings.halves[0])?, bake(&settings.halves[1])?];
    let picture = settings.picture.as_ref().map(|settings| {
        let progress = percent_on_terminal("oracle, picture");
        OraclePicture::render(&subject.scene, settings, &progress).context("oracle, picture")
    });
    let picture = picture.transpose()?;
    let errors = |bake: &Bake| {
        let error = bake.standard_error;
        [error.direct, error.refracted, error.reflected]
    };
    let [a, b] = [&bakes[0], &bakes[1]].map(errors);
    let content = Content {
        photons: bakes.iter().map(|bake| bake.photons).sum(),
        seconds: start.elapsed().as_secs_f64(),
        standard_errors: std::array::from_fn(|i| 0.5 * a[i].hypot(b[i])),
        picture: picture.is_some(),
    };
    Ok(Halves { content, kept: false, maps: bakes.map(|bake| bake.maps), picture })
}

impl Halves {
    /// In the order of [`read`].
    fn samples(&self) -> Vec<f32> {
        let layers = self.maps.iter().flat_map(|maps| [&maps.direct, &maps.refracted, &maps.reflected]);
        let pictures = self.picture.iter().flat_map(|picture| [&picture.xyz, &picture.half]);
        layers.chain(pictures).flatten().flatten().copied().collect()
    }
}

fn read(subject: &Subject, effort: &Effort, kept: &Kept, key: &Key) -> Result<Halves, Absent> {
    let (content, samples) = kept.read::<Content>(&subject.name, key)?;
    let count = |[width, height]: [u32; 2]| width as usize * height as usize;
    let (texels, pixels) = (count(effort.receiver_size), count(effort.picture_size));
    let expected = 3 * (6 * texels + if content.picture { 2 * pixels } else { 0 });
    if samples.len() != expected {
        return Err(Absent::Damaged(format!("{} samples, {expected} would be right", samples.len())));
    }
    let mut rest = samples.as_chunks::<3>().0;
    let mut take = |count: usize| {
        let (these, those) = rest.split_at(count);
        rest = those;
        these.to_vec()
    };
    let [width, height] = effort.receiver_size;
    let mut half = || IrradianceMaps {
        width,
        height,
        direct: take(texels),
        refracted: take(texels),
        reflected: take(texels),
    };
    let maps = [half(), half()];
    let picture = content.picture.then(|| OraclePicture { xyz: take(pixels), half: take(pixels) });
    Ok(Halves { content, kept: true, maps, picture })
}

fn truth(subject: &Subject, effort: &Effort, halves: Halves) -> Result<Truth> {
    let [half, other] = &halves.maps;
    let maps = IrradianceMaps {
        width: half.width,
        height: half.height,
        direct: mean_of(&half.direct, &other.direct),
        refracted: mean_of(&half.refracted, &other.refracted),
        reflected: mean_of(&half.reflected, &other.reflected),
    };
    let layer = Layer::of_caustic(&maps).context("oracle: nothing to compare, the receiver is black")?;
    let distance = compare(&layer.of(half), &layer.of(&maps), subject.white_xyz());
    let half_flip = halves.picture.as_ref().map(|picture| {
        let [mean, half] = [&picture.xyz, &picture.half].map(|xyz| picture_map(effort, xyz));
        mean_flip(&half, &mean, exposure(&mean).unwrap_or(1.0))
    });
    let [direct, refracted, reflected] = halves.content.standard_errors;
    let noise = Noise {
        photons: halves.content.photons,
        seconds: halves.content.seconds,
        kept: halves.kept,
        standard_error: match layer {
            Layer::Direct => direct,
            Layer::Refracted => refracted,
            Layer::Reflected => reflected,
        },
        half_all_light: all_light(half, &maps, subject.white_xyz()),
        half: distance.context("oracle: nothing to compare")?,
        half_flip,
    };
    Ok(Truth { maps, layer, picture: halves.picture, noise })
}

/// A picture to compare.
pub(super) fn picture_map<'a>(effort: &Effort, xyz: &'a [[f32; 3]]) -> Map<'a> {
    Map { size: effort.picture_size.map(|n| n as usize), xyz }
}

/// All light on the receiver against the oracle's.
pub(super) fn all_light(
    maps: &IrradianceMaps,
    oracle: &IrradianceMaps,
    white_xyz: [f64; 3],
) -> Option<Metrics> {
    let (a, b) = (total(maps), total(oracle));
    let [a, b] = [(&a, maps), (&b, oracle)].map(|(xyz, maps)| Map { size: size(maps), xyz });
    compare(&a, &b, white_xyz).ok()
}
