//! Lights, to and from KHR_lights_punctual.

use std::f64::consts::FRAC_PI_4;

use glam::{DMat4, DQuat, DVec3};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use spectral_core::illuminant::black_body;
use spectral_core::light::{LightError, LightSpectrum};

use super::document as doc;
use super::error::{LoadError, invalid};
use super::material::spectral;
use crate::{Light, LightShape};

/// What `extras.spectral` says of a light.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Spectral {
    Illuminant(String),
    LineNm(f64),
    CctK(f64),
    BlackBodyK(f64),
    Color([f64; 3]),
}

/// A light placed by its node; it shines along the node's -Z.
pub(super) fn read(
    index: usize,
    light: &doc::Light,
    node_name: &str,
    world_from_node: DMat4,
) -> Result<Light, LoadError> {
    let at = format!("extensions.KHR_lights_punctual.lights[{index}]");
    let color = light.color.unwrap_or([1.0; 3]);
    let spectrum = match spectral(&at, light.extras.as_ref())? {
        None => Ok(LightSpectrum::d65_upsampled(color)),
        Some(Spectral::Color(color)) => Ok(LightSpectrum::d65_upsampled(color)),
        Some(Spectral::Illuminant(name)) => LightSpectrum::illuminant(&name),
        Some(Spectral::LineNm(lambda_nm)) => LightSpectrum::line(lambda_nm),
        Some(Spectral::CctK(cct_k)) => LightSpectrum::cct(cct_k),
        Some(Spectral::BlackBodyK(cct_k)) => {
            black_body(cct_k).map(|_| LightSpectrum::BlackBody { cct_k }).map_err(LightError::from)
        }
    };
    let spectrum = spectrum.or_else(|error| {
        let value = light.extras.as_ref().map_or(&Value::Null, |extras| &extras["spectral"]);
        invalid(format!("{at}.extras.spectral"), format!("is {value}"), error.to_string())
    })?;

    let position_m = world_from_node.w_axis.truncate();
    let direction = world_from_node.transform_vector3(DVec3::NEG_Z).normalize_or_zero();
    let shape = match light.kind.as_str() {
        "directional" => LightShape::Directional { direction },
        "point" => LightShape::Point { position_m, range_m: light.range },
        "spot" => {
            let spot = light.spot.clone().unwrap_or_default();
            LightShape::Spot {
                position_m,
                direction,
                inner_cone_rad: spot.inner_cone_angle.unwrap_or(0.0),
                outer_cone_rad: spot.outer_cone_angle.unwrap_or(FRAC_PI_4),
                range_m: light.range,
            }
        }
        other => {
            return invalid(at, format!("is of type `{other}`"), "known are directional, point and spot");
        }
    };
    Ok(Light {
        name: light.name.clone().unwrap_or_else(|| node_name.to_owned()),
        color,
        intensity: light.intensity.unwrap_or(1.0),
        spectrum,
        shape,
    })
}

/// The light and the node that places it, which refers to the light as number `index`.
pub(super) fn write(index: usize, light: &Light) -> (doc::Light, doc::Node) {
    let mut spot = None;
    let (kind, position, direction, range) = match light.shape {
        LightShape::Directional { direction } => ("directional", None, Some(direction), None),
        LightShape::Point { position_m, range_m } => ("point", Some(position_m), None, range_m),
        LightShape::Spot { position_m, direction, inner_cone_rad, outer_cone_rad, range_m } => {
            spot = Some(doc::Spot {
                inner_cone_angle: Some(inner_cone_rad),
                outer_cone_angle: Some(outer_cone_rad),
            });
            ("spot", Some(position_m), Some(direction), range_m)
        }
    };
    let punctual = doc::Light {
        name: Some(light.name.clone()),
        kind: kind.into(),
        color: Some(light.color),
        intensity: Some(light.intensity),
        range,
        spot,
        extras: extras(light),
    };
    let node = doc::Node {
        name: Some(light.name.clone()),
        translation: position.map(|p| p.to_array()),
        rotation: direction.map(|d| DQuat::from_rotation_arc(DVec3::NEG_Z, d.normalize()).to_array()),
        extensions: Some(doc::NodeExtensions { lights_punctual: Some(doc::LightReference { light: index }) }),
        ..doc::Node::default()
    };
    (punctual, node)
}

fn extras(light: &Light) -> Option<Value> {
    let spectral = match &light.spectrum {
        spectrum if *spectrum == LightSpectrum::d65_upsampled(light.color) => return None,
        LightSpectrum::UpsampledD65 { linear_srgb, .. } => Spectral::Color(*linear_srgb),
        LightSpectrum::Illuminant(illuminant) => Spectral::Illuminant(illuminant.to_string()),
        LightSpectrum::BlackBody { cct_k } => Spectral::BlackBodyK(*cct_k),
        LightSpectrum::Daylight { cct_k } => Spectral::CctK(*cct_k),
        LightSpectrum::Line { lambda_nm } => Spectral::LineNm(*lambda_nm),
    };
    Some(json!({ "spectral": spectral }))
}
