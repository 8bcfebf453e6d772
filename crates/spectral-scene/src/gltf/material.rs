//! Materials, to and from glTF.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use spectral_core::dispersion::Dispersion;
use spectral_core::glass;

use super::document as doc;
use super::error::{LoadError, Warning, invalid};
use crate::{Attenuation, Iridescence, Material};

/// Index of refraction where KHR_materials_ior is absent.
const DEFAULT_IOR: f64 = 1.5;

/// What `extras.spectral` says of a material.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Spectral {
    Cauchy(Vec<f64>),
    Glass(String),
    Sellmeier(Vec<[f64; 2]>),
}

/// `extras.spectral` as `T`, if it is there.
pub(super) fn spectral<T: serde::de::DeserializeOwned>(
    at: &str,
    extras: Option<&Value>,
) -> Result<Option<T>, LoadError> {
    let Some(spectral) = extras.and_then(|extras| extras.get("spectral")) else { return Ok(None) };
    T::deserialize(spectral).map(Some).or_else(|error| {
        let at = format!("{at}.extras.spectral");
        invalid(
            at,
            format!("is {spectral}: {error}"),
            "one of the forms in the documentation of the glTF loader",
        )
    })
}

/// A material and what it says that is not simulated.
pub(super) fn read(index: usize, material: &doc::Material) -> Result<(Material, Vec<Warning>), LoadError> {
    let at = format!("materials[{index}]");
    let name = material.name.clone().unwrap_or_else(|| format!("material {index}"));
    let pbr = material.pbr_metallic_roughness.clone().unwrap_or_default();
    let extensions = material.extensions.clone().unwrap_or_default();
    let mut warnings = Vec::new();

    let mut ior = extensions.ior.and_then(|e| e.ior).unwrap_or(DEFAULT_IOR);
    if ior == 0.0 {
        warnings.push(Warning::IorZero { material: name.clone() });
        ior = DEFAULT_IOR;
    }
    let khr_dispersion = extensions.dispersion.map_or(0.0, |e| e.dispersion);
    let dispersion = match spectral(&at, material.extras.as_ref())? {
        None => Dispersion::from_khr(ior, khr_dispersion),
        Some(Spectral::Cauchy(coefficients)) => Dispersion::cauchy(&coefficients),
        Some(Spectral::Sellmeier(terms)) => Dispersion::sellmeier(terms),
        Some(Spectral::Glass(name)) => match glass::by_name(&name) {
            Ok(dispersion) => Ok(dispersion),
            Err(unknown) => {
                return invalid(format!("{at}.extras.spectral.glass"), "names no glass", unknown.to_string());
            }
        },
    };
    let dispersion =
        dispersion.or_else(|e| invalid(&at, format!("has no usable refractive index: {e}"), "correct it"))?;

    let transmission = extensions.transmission.unwrap_or_default();
    let roughness = pbr.roughness_factor.unwrap_or(1.0);
    if transmission.transmission_factor > 0.0 {
        if roughness > 0.0 {
            warnings.push(Warning::RoughGlass { material: name.clone(), roughness });
        }
        if extensions.volume.as_ref().is_none_or(|v| v.thickness_factor == 0.0) {
            warnings.push(Warning::ThinWalled { material: name.clone() });
        }
    }
    let volume = extensions.volume.unwrap_or_default();
    let attenuation = volume
        .attenuation_distance
        .map(|distance_m| Attenuation { color: volume.attenuation_color.unwrap_or([1.0; 3]), distance_m });
    let iridescence = extensions.iridescence.map(|film| Iridescence {
        factor: film.iridescence_factor.unwrap_or(0.0),
        ior: film.iridescence_ior.unwrap_or(1.3),
        thickness_min_nm: film.iridescence_thickness_minimum.unwrap_or(100.0),
        thickness_max_nm: film.iridescence_thickness_maximum.unwrap_or(400.0),
    });
    if iridescence.is_some_and(|film| film.factor > 0.0) {
        warnings.push(Warning::Iridescence { material: name.clone() });
    }
    let textures = [
        ("baseColorTexture", &pbr.base_color_texture),
        ("metallicRoughnessTexture", &pbr.metallic_roughness_texture),
        ("normalTexture", &material.normal_texture),
        ("emissiveTexture", &material.emissive_texture),
        ("transmissionTexture", &transmission.transmission_texture),
    ];
    for (texture, _) in textures.into_iter().filter(|(_, t)| t.is_some()) {
        warnings.push(Warning::TextureIgnored { material: name.clone(), texture });
    }
    if let Some(alpha_mode) = material.alpha_mode.as_ref().filter(|mode| *mode != "OPAQUE") {
        warnings.push(Warning::AlphaIgnored { material: name.clone(), alpha_mode: alpha_mode.clone() });
    }
    let strength = extensions.emissive_strength.and_then(|e| e.emissive_strength).unwrap_or(1.0);
    let [r, g, b, _] = pbr.base_color_factor.unwrap_or([1.0; 4]);
    let material = Material {
        name,
        base_color: [r, g, b],
        metallic: pbr.metallic_factor.unwrap_or(1.0),
        roughness,
        transmission: transmission.transmission_factor,
        dispersion,
        attenuation,
        thickness_m: volume.thickness_factor,
        iridescence,
        emissive: material.emissive_factor.unwrap_or([0.0; 3]).map(|c| c * strength),
        double_sided: material.double_sided,
    };
    if material.is_mirror() && roughness > 0.0 {
        warnings.push(Warning::NearlySmoothMetal { material: material.name.clone(), roughness });
    } else if material.is_metal() && !material.is_mirror() {
        warnings.push(Warning::RoughMetal { material: material.name.clone(), roughness });
    }
    Ok((material, warnings))
}

pub(super) fn write(material: &Material) -> doc::Material {
    let (ior, khr_dispersion) = khr_index(&material.dispersion);
    // Without extras the numbers of the extensions must give back the same medium, bit for bit.
    let extras = match Dispersion::from_khr(ior, khr_dispersion) {
        Ok(plain) if plain == material.dispersion => None,
        _ => Some(json!({ "spectral": spectral_of(&material.dispersion) })),
    };
    let [r, g, b] = material.base_color;
    // A power of two divides and multiplies without rounding.
    let brightest = material.emissive.into_iter().fold(1.0, f64::max);
    let strength = brightest.log2().ceil().exp2();
    let volume = (material.thickness_m > 0.0 || material.attenuation.is_some()).then(|| doc::Volume {
        thickness_factor: material.thickness_m,
        attenuation_distance: material.attenuation.map(|a| a.distance_m),
        attenuation_color: material.attenuation.map(|a| a.color),
    });
    let extensions = doc::MaterialExtensions {
        ior: (ior != DEFAULT_IOR).then_some(doc::Ior { ior: Some(ior) }),
        transmission: material.is_refractor().then_some(doc::Transmission {
            transmission_factor: material.transmission,
            transmission_texture: None,
        }),
        volume,
        dispersion: (khr_dispersion > 0.0).then_some(doc::KhrDispersion { dispersion: khr_dispersion }),
        iridescence: material.iridescence.map(|film| doc::Iridescence {
            iridescence_factor: Some(film.factor),
            iridescence_ior: Some(film.ior),
            iridescence_thickness_minimum: Some(film.thickness_min_nm),
            iridescence_thickness_maximum: Some(film.thickness_max_nm),
        }),
        emissive_strength: (strength > 1.0)
            .then_some(doc::EmissiveStrength { emissive_strength: Some(strength) }),
    };
    doc::Material {
        name: Some(material.name.clone()),
        pbr_metallic_roughness: Some(doc::MetallicRoughness {
            base_color_factor: Some([r, g, b, 1.0]),
            metallic_factor: Some(material.metallic),
            roughness_factor: Some(material.roughness),
            ..doc::MetallicRoughness::default()
        }),
        emissive_factor: (material.emissive != [0.0; 3]).then(|| material.emissive.map(|c| c / strength)),
        double_sided: material.double_sided,
        extensions: (extensions != doc::MaterialExtensions::default()).then_some(extensions),
        extras,
        ..doc::Material::default()
    }
}

/// n_d and 20 / V_d: what viewers without `extras.spectral` get to see.
fn khr_index(dispersion: &Dispersion) -> (f64, f64) {
    let khr = dispersion.khr_dispersion();
    // KHR_materials_dispersion cannot say that a medium disperses the other way round.
    (dispersion.n_d(), if khr.is_finite() { khr.max(0.0) } else { 0.0 })
}

fn spectral_of(dispersion: &Dispersion) -> Spectral {
    if let Some(glass) = glass::CATALOGUE.iter().find(|glass| glass.dispersion() == *dispersion) {
        return Spectral::Glass(glass.name.into());
    }
    match dispersion {
        Dispersion::Constant { n } => Spectral::Cauchy(vec![*n, 0.0]),
        Dispersion::Cauchy { a, b_um2, c_um4: 0.0 } => Spectral::Cauchy(vec![*a, *b_um2]),
        Dispersion::Cauchy { a, b_um2, c_um4 } => Spectral::Cauchy(vec![*a, *b_um2, *c_um4]),
        Dispersion::Sellmeier { terms } => Spectral::Sellmeier(terms.clone()),
    }
}
