//! What shines in a scene.

use spectral_core::upsample::SmoothSpectrum;
use spectral_prt::figures::{Figure, GRID};
use spectral_prt::{Bands, GlossTransfer, Palette, PhongLobe, Projection, Transfer};
use spectral_scene::Material;

use super::stage::transfer;
use crate::error::CliError;
use crate::messages;
use crate::values::Gloss;

/// Lobes are as sharp as bands hold this share of them, and no sharper.
const HELD: f64 = 0.9;

/// The lobes of a scene's objects, in their order.
#[derive(Clone, Debug, Default)]
pub(super) struct Shine {
    lobes: Vec<Option<PhongLobe>>,
    /// What they reflect; 0 for what is matt.
    reflectances: Vec<Vec<f64>>,
    names: Vec<String>,
}

impl Shine {
    /// The next object. Returns what it reflects as a matt surface does: nothing of metal, of others what its lobe leaves.
    ///
    /// A material of roughness 1 that is no metal is matt altogether.
    pub(super) fn add(&mut self, name: &str, material: &Material, gloss: Gloss) -> Vec<f64> {
        let roughness = match gloss {
            Gloss::Material => material.roughness,
            Gloss::Roughness(roughness) => roughness,
        };
        let color = base_color(material);
        let (lobe, of_lobe, matt) = if material.is_metal() {
            (Some(PhongLobe::of_roughness(roughness)), color, GRID.sample(|_| 0.0))
        } else if roughness < 1.0 {
            let at_normal = GRID.sample(|lambda_nm| {
                let n = material.dispersion.ior(lambda_nm);
                ((n - 1.0) / (n + 1.0)).powi(2)
            });
            let left = color.iter().zip(&at_normal).map(|(r, f0)| r * (1.0 - f0)).collect();
            (Some(PhongLobe::of_roughness(roughness)), at_normal, left)
        } else {
            (None, GRID.sample(|_| 0.0), color)
        };
        self.lobes.push(lobe);
        self.reflectances.push(of_lobe);
        self.names.push(name.into());
        matt
    }

    /// How many objects shine.
    pub(super) fn count(&self) -> usize {
        self.lobes.iter().flatten().count()
    }

    /// What lobes reflect, of each object: a basis should know it.
    pub(super) fn reflectances(&self) -> &[Vec<f64>] {
        &self.reflectances
    }

    /// The palette of the objects with their lobes.
    pub(super) fn on(&self, palette: Palette, projection: &Projection<'_>) -> Palette {
        palette.with_gloss(projection, &self.reflectances)
    }

    /// No lobe sharper than bands hold; those that were are warned about.
    fn within(&mut self, bands: Bands, sharpest: PhongLobe, warnings: &mut Vec<String>) {
        for (name, lobe) in self.names.iter().zip(&mut self.lobes) {
            if let Some(lobe) = lobe
                && lobe.exponent() > sharpest.exponent()
            {
                let problem = format!(
                    "`{name}` is shown less sharp than it is: {} bands hold a roughness of {:.2} and more, its is {:.2}",
                    bands.count(),
                    sharpest.roughness(),
                    lobe.roughness()
                );
                messages::warn_and_keep(warnings, problem);
                *lobe = sharpest;
            }
        }
    }
}

/// Transfer of a figure, and of what shines in it.
///
/// # Errors
/// A usage error for more bands of light than lobes have; what the cache's file system says.
pub(super) fn transfers(
    figure: &Figure,
    shine: Option<&mut Shine>,
    bands: Bands,
    warnings: &mut Vec<String>,
) -> Result<(Transfer, Option<GlossTransfer>), CliError> {
    let Some(shine) = shine else {
        return Ok((transfer(&figure.surfaces, bands, figure.rays)?, None));
    };
    // One band holds no lobe, and there is no transfer for those of more than five.
    let possible = (Bands::new(2 * u8::from(bands) - 1).ok()).zip(PhongLobe::sharpest(bands, HELD));
    let Some((of_lobes, sharpest)) = possible else {
        let most = Bands::MAX.count().div_ceil(2);
        return Err(CliError::usage(format!(
            "--bands {}: with --gloss 2 to {most} are possible",
            bands.count()
        )));
    };
    shine.within(bands, sharpest, warnings);
    let wide = transfer(&figure.surfaces, of_lobes, figure.rays)?;
    let gloss = GlossTransfer::new(&wide, bands, &shine.lobes).map_err(CliError::failed)?;
    Ok((wide.with_bands(bands), Some(gloss)))
}

/// The smooth spectrum of a material's colour.
pub(super) fn base_color(material: &Material) -> Vec<f64> {
    let spectrum = SmoothSpectrum::reflectance(material.base_color);
    GRID.sample(|lambda_nm| spectrum.at(lambda_nm))
}
