//! Words for what a plan keeps and leaves out.

use frame_plan::Decision;
use spectral_scene::{Effects, Scene};

use crate::geometry::Geometry;
use crate::lights::LightSetup;
use crate::{Emission, GapFilling, Interfaces, Method, Settings};

/// A method's name, as on the command line.
fn method_name(method: Method) -> &'static str {
    match method {
        Method::CausticsMap => "caustics-map",
        Method::Acm => "acm",
        Method::Asm => "asm",
    }
}

/// What was kept and left out.
pub(crate) fn decisions(
    scene: &Scene,
    settings: &Settings,
    effects: &Effects,
    geometry: &Geometry,
    setups: &[LightSetup],
) -> Vec<Decision> {
    let mut decisions = Vec::new();
    let mut decide = |pass: &str, kept: bool, reason: String| {
        decisions.push(Decision { pass: pass.into(), kept, reason });
    };
    let state = |on: bool| if on { "on" } else { "off" };
    for (index, light) in scene.lights.iter().enumerate() {
        let shines = setups.iter().any(|setup| setup.index == index);
        if !shines {
            let reason = match &settings.lights {
                Some(chosen) if !chosen.contains(&index) => "not chosen",
                _ => "gives no light",
            };
            decide("visibility", false, format!("light {index} `{}`: {reason}", light.name));
        }
    }
    for object in &geometry.turned {
        let name = &scene.objects[*object].name;
        decide(
            "photon_trace",
            true,
            format!("`{name}` is closed and inside out: its faces are turned outwards"),
        );
    }
    for object in &geometry.open {
        let name = &scene.objects[*object].name;
        decide("photon_trace", true, format!("`{name}` has an open edge: light may land inside it"));
    }
    if setups.iter().any(|setup| setup.caustic) {
        let method = method_name(settings.method);
        let (kept, reason) = match settings.emission() {
            Emission::Grid => (false, format!("{method}: a photon per texel of the emission view")),
            Emission::Adaptive { levels } => {
                let cells = if levels == 1 { "level" } else { "levels" };
                (true, format!("{method}: photons where {levels} {cells} of the emission view show glass"))
            }
        };
        for pass in ["coverage_mip", "photon_refine"] {
            decide(pass, kept, reason.clone());
        }
    }
    for setup in setups {
        let light = format!("light {} `{}`", setup.index, setup.name);
        let caustics = format!("{light}, caustics: {}, {}", state(setup.caustic), effects.caustics.reason);
        for pass in ["photon_trace", "map_resolve"] {
            decide(pass, setup.caustic, caustics.clone());
        }
        let shadows = format!("{light}, shadows: {}, {}", state(setup.shadows), effects.shadows.reason);
        decide("visibility", setup.shadows, shadows);
        if !setup.caustic {
            continue;
        }
        let count = setup.bands.wavelengths_nm.len();
        let why = if scene.lights[setup.index].spectrum.line_nm().is_some() {
            "its spectrum is a line".to_owned()
        } else {
            format!(
                "dispersion: {}, {}; absorption: {}, {}",
                state(effects.dispersion.on),
                effects.dispersion.reason,
                state(effects.absorption.on),
                effects.absorption.reason
            )
        };
        decide(
            "photon_trace",
            true,
            format!("{light}, {count} wavelength{}: {why}", if count == 1 { "" } else { "s" }),
        );
        let gaps = match settings.gap_filling() {
            GapFilling::None => format!("{light}: no gap filling was asked for"),
            _ if count == 1 => format!("{light}: one wavelength leaves no gaps between wavelengths"),
            _ => format!(
                "{light}, gaps between wavelengths: dispersion: {}, {}",
                state(effects.dispersion.on),
                effects.dispersion.reason
            ),
        };
        for pass in ["gap_mask", "gap_fill"] {
            decide(pass, setup.gaps, gaps.clone());
        }
        decide(
            "visibility",
            setup.exits,
            if setup.exits {
                format!("{light}, exit: light leaves glass by its back faces")
            } else if settings.interfaces == Interfaces::One {
                format!("{light}, exit: one interface was asked for")
            } else {
                format!("{light}, exit: no face of glass points away from the light")
            },
        );
        decide(
            "visibility",
            setup.separate_direct,
            if setup.separate_direct {
                format!("{light}, landing apart from shadow: opaque surfaces stand before the glass")
            } else {
                format!("{light}, landing serves for shadow: no opaque surface stands before the glass")
            },
        );
    }
    decisions
}
