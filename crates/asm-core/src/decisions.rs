//! Words for what a plan keeps and leaves out: one decision for each pass that its method could use.

use frame_plan::Decision;
use spectral_scene::{Effect, Effects, Scene};

use crate::geometry::Geometry;
use crate::lights::LightSetup;
use crate::shared::triangle::{TRIANGLE_MIRROR, TRIANGLE_REFRACTS};
use crate::{Emission, GapFilling, GlassView, Interfaces, MapFit, Method, Reflections, Refraction, Settings};

/// What a plan ends in.
pub(crate) enum Output<'a> {
    /// Irradiance on the object of this name.
    Bake { receiver: &'a str },
    /// A camera's picture.
    Picture(CameraGlass),
}

/// What a camera does about glass and mirrors.
#[derive(Clone, Copy)]
pub(crate) struct CameraGlass {
    /// It draws glass.
    pub(crate) drawn: bool,
    /// It draws the backs of glass.
    pub(crate) backs: bool,
    /// Glass bends its rays.
    pub(crate) bends: bool,
    /// Mirrors throw its rays on.
    pub(crate) mirrors: bool,
    /// The refractor that its eye is in.
    pub(crate) inside: Option<usize>,
}

impl CameraGlass {
    /// A pass of its own follows rays beyond what they meet first.
    pub(crate) fn goes_on(&self) -> bool {
        self.bends || self.mirrors || self.inside.is_some()
    }
}

/// What a plan is made from.
pub(crate) struct Grounds<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) settings: &'a Settings,
    pub(crate) effects: &'a Effects,
    pub(crate) geometry: &'a Geometry,
    pub(crate) setups: &'a [LightSetup],
}

/// What was kept and left out, in the order in which passes run.
pub(crate) fn decisions(grounds: &Grounds<'_>, output: &Output<'_>) -> Vec<Decision> {
    let mut decisions = Vec::new();
    if let Output::Bake { receiver } = output {
        decisions.push(grounds.shading("uv_visibility", format!("which part of `{receiver}` is where")));
    }
    decisions.push(grounds.visibility(output));
    if grounds.settings.method == Method::Footprint {
        decisions.push(grounds.photons("path_trace", grounds.photon_notes()));
        decisions.push(grounds.map_fit(output));
        decisions.extend(grounds.splits());
        decisions.push(grounds.photons("footprint_splat", grounds.footprint_notes()));
    } else {
        decisions.extend(grounds.emission());
        decisions.push(grounds.map_fit(output));
        decisions.extend(grounds.tracers());
        decisions.extend(grounds.gaps());
    }
    decisions.push(grounds.photons("map_resolve", Vec::new()));
    match output {
        Output::Bake { receiver } => {
            let mut bake = grounds.shading("receiver_bake", format!("what lands on `{receiver}`"));
            bake.notes = grounds.light_notes();
            decisions.push(bake);
        }
        Output::Picture(camera) => {
            let mut shade = grounds.shading("shade", "what the camera sees is lit".into());
            shade.notes = grounds.light_notes();
            decisions.push(shade);
            decisions.push(grounds.deferred_refraction(*camera));
        }
    }
    decisions
}

fn decision(pass: &str, kept: bool, reason: String) -> Decision {
    Decision { pass: pass.into(), kept, reason, notes: Vec::new() }
}

fn state(name: &str, effect: &Effect) -> String {
    format!("{name}: {}, {}", if effect.on { "on" } else { "off" }, effect.reason)
}

/// An effect as the reason for a pass that is kept.
fn kept_for(name: &str, effect: &Effect) -> String {
    let state = state(name, effect);
    if effect.on { state } else { format!("{state}; kept, since nothing is pruned") }
}

const DARK: &str = "no light shines";

impl Grounds<'_> {
    fn lit(&self) -> bool {
        !self.setups.is_empty()
    }

    fn caustic(&self) -> bool {
        self.setups.iter().any(|s| s.caustic)
    }

    /// Light goes into glass.
    fn refracted(&self) -> bool {
        self.setups.iter().any(|s| s.refracted)
    }

    /// `TRIANGLE_*` of what light is thrown back from.
    fn reflecting(&self) -> u32 {
        self.setups.iter().fold(0, |flags, s| flags | s.reflecting)
    }

    /// Why there are photons, or why not.
    fn photon_reason(&self) -> String {
        let Effects { caustics, reflective_caustics, .. } = self.effects;
        if self.caustic() {
            let refracted = self.refracted().then(|| kept_for("caustics", caustics));
            let mirrored = self.reflecting() & TRIANGLE_MIRROR != 0;
            let reflected = mirrored.then(|| kept_for("reflective caustics", reflective_caustics));
            let reasons: Vec<_> = refracted.into_iter().chain(reflected).collect();
            return if reasons.is_empty() { kept_for("caustics", caustics) } else { reasons.join("; ") };
        }
        if !self.lit() {
            return DARK.into();
        }
        let refracted = if caustics.on {
            format!("{}, but no glass, or nothing behind it, has an area", state("caustics", caustics))
        } else {
            state("caustics", caustics)
        };
        format!("{refracted}; {}", self.no_reflections())
    }

    /// Why no light is thrown back.
    fn no_reflections(&self) -> String {
        let reflective = &self.effects.reflective_caustics;
        if reflective.on && self.settings.reflections == Reflections::None {
            "reflective caustics: none were asked for".into()
        } else {
            state("reflective caustics", reflective)
        }
    }

    /// What light is thrown back from.
    fn reflection_note(&self) -> String {
        let reflecting = self.reflecting();
        let mirrors = (reflecting & TRIANGLE_MIRROR != 0).then_some("mirrors");
        let outsides = (reflecting & TRIANGLE_REFRACTS != 0).then_some("the outside of glass");
        let from: Vec<_> = mirrors.into_iter().chain(outsides).collect();
        if from.is_empty() {
            format!("reflected light: not traced, {}", self.no_reflections())
        } else {
            format!("reflected light: traced apart, thrown back once by {}", from.join(" and by "))
        }
    }

    /// A pass that runs once per light wherever there are photons.
    fn photons(&self, pass: &str, notes: Vec<String>) -> Decision {
        Decision { notes, ..decision(pass, self.caustic(), self.photon_reason()) }
    }

    /// The pass that photons go through glass by, and the one that they do not.
    fn tracers(&self) -> [Decision; 2] {
        let refraction = self.settings.refraction();
        let of = |pass, own: Refraction| {
            if refraction == own || !self.caustic() {
                return self.photons(pass, self.photon_notes());
            }
            let method = self.settings.method.name();
            let reason = match refraction {
                Refraction::ImageSpace => format!("{method}: photons find their way in image space"),
                Refraction::Traced => format!("{method}: photons go along paths through the geometry"),
            };
            decision(pass, false, reason)
        };
        [of("photon_trace", Refraction::ImageSpace), of("photon_path", Refraction::Traced)]
    }

    /// What is followed inside glass, where paths are.
    fn inside_note(&self) -> Option<String> {
        if self.settings.refraction() == Refraction::ImageSpace || !self.refracted() {
            return None;
        }
        let refractors = match self.scene.refractors().count() {
            1 => "the refractor".to_owned(),
            count => format!("{count} refractors"),
        };
        Some(match self.settings.bounces {
            0 => format!("paths go through {refractors} and follow no reflection inside"),
            1 => format!("paths go through {refractors} and follow 1 reflection inside the first glass"),
            bounces => {
                format!(
                    "paths go through {refractors} and follow {bounces} reflections inside the first glass"
                )
            }
        })
    }

    /// A pass that runs wherever there is light.
    fn shading(&self, pass: &str, what: String) -> Decision {
        decision(pass, self.lit(), if self.lit() { what } else { DARK.into() })
    }

    fn light_name(&self, index: usize) -> String {
        format!("light {index} `{}`", self.scene.lights[index].name)
    }

    /// What each light does, those that do nothing included.
    fn light_notes(&self) -> Vec<String> {
        let note = |index: usize| {
            let name = self.light_name(index);
            match self.setups.iter().find(|setup| setup.index == index) {
                Some(setup) => match (setup.refracted, setup.reflecting != 0) {
                    (true, false) => format!("{name}: direct, and through glass"),
                    (true, true) => format!("{name}: direct, through glass, and reflected"),
                    (false, true) => format!("{name}: direct, and reflected"),
                    (false, false) => format!("{name}: direct"),
                },
                None => match &self.settings.lights {
                    Some(chosen) if !chosen.contains(&index) => format!("{name}: not chosen"),
                    _ => format!("{name}: gives no light"),
                },
            }
        };
        (0..self.scene.lights.len()).map(note).collect()
    }

    fn visibility(&self, output: &Output<'_>) -> Decision {
        let effects = self.effects;
        let shadows = self.setups.iter().any(|s| s.shadows);
        let mut reasons = Vec::new();
        if self.caustic() {
            reasons.push(self.photon_reason());
        }
        if shadows {
            reasons.push(kept_for("shadows", &effects.shadows));
        }
        let mut notes = Vec::new();
        if let (Output::Picture(camera), true) = (output, self.lit()) {
            reasons.insert(0, "what the camera sees".into());
            notes = self.camera_notes(*camera);
        }
        let kept = !reasons.is_empty();
        if !kept {
            reasons = if self.lit() {
                vec![self.photon_reason(), state("shadows", &effects.shadows)]
            } else {
                vec![DARK.into()]
            };
        }
        notes.extend(self.setups.iter().flat_map(|setup| self.view_notes(setup)));
        Decision { notes, ..decision("visibility", kept, reasons.join("; ")) }
    }

    /// Which views of a light are drawn.
    fn view_notes(&self, setup: &LightSetup) -> Vec<String> {
        let name = self.light_name(setup.index);
        if !setup.caustic {
            return Vec::new();
        }
        let exit = match (setup.exits, self.settings.interfaces) {
            _ if !setup.refracted => "exit: not drawn, no light goes into glass",
            (false, _) if self.settings.refraction() == Refraction::Traced => {
                "exit: not drawn, paths are traced"
            }
            (true, _) => "exit: drawn, light leaves glass by its back faces",
            (false, Interfaces::One) => "exit: not drawn, one interface was asked for",
            (false, Interfaces::Two) => "exit: not drawn, no face of glass points away from the light",
        };
        let landing = match (setup.shadows, setup.separate_direct) {
            (true, true) if setup.receiver_view.is_some() => {
                "shadow: drawn apart from landing, which is what the receiver's texture sees"
            }
            (true, true) if setup.cut => {
                "shadow: drawn apart from landing, opaque surfaces stand before the glass"
            }
            (true, true) => "shadow: drawn apart from landing, nothing lands on mirrors",
            (true, false) => "shadow: landing serves for it, no opaque surface stands before the glass",
            (false, _) => "shadow: not drawn, there are none",
        };
        [exit, landing].map(|note| format!("{name}, {note}")).to_vec()
    }

    fn camera_notes(&self, camera: CameraGlass) -> Vec<String> {
        let drawn = |kept: bool| if kept { "drawn" } else { "not drawn" };
        let seen = state("deferred refraction", &self.effects.deferred_refraction);
        let backs = match self.settings.glass_view() {
            GlassView::Deferred => format!("where its rays leave glass, {seen}"),
            GlassView::Straight => {
                format!("thickness of glass, {}", state("absorption", &self.effects.absorption))
            }
        };
        vec![
            format!("camera, glass: {}, {seen}", drawn(camera.drawn)),
            format!("camera, backs of glass: {}, {backs}", drawn(camera.backs)),
        ]
    }

    fn emission(&self) -> [Decision; 2] {
        let method = self.settings.method.name();
        let (kept, reason) = match (self.caustic(), self.settings.emission()) {
            (false, _) => (false, self.photon_reason()),
            (true, Emission::Grid) => (false, format!("{method}: a photon per texel of the emission view")),
            (true, Emission::Adaptive { levels }) => {
                let what = match (self.refracted(), self.reflecting() & TRIANGLE_MIRROR != 0) {
                    (true, true) => "glass or mirrors",
                    (false, true) => "mirrors",
                    _ => "glass",
                };
                let cells = if levels == 1 { "level" } else { "levels" };
                (true, format!("{method}: photons where {levels} {cells} of the emission view show {what}"))
            }
        };
        ["coverage_mip", "photon_refine"].map(|pass| decision(pass, kept, reason.clone()))
    }

    fn map_fit(&self, output: &Output<'_>) -> Decision {
        let kept = self.setups.iter().any(LightSetup::fits_map);
        let method = self.settings.method.name();
        let reason = if !self.caustic() {
            self.photon_reason()
        } else if kept {
            let tells = match self.settings.method {
                Method::Footprint => "the paths of whole cells tell",
                _ => "a part of the photons tells",
            };
            format!("{method}: {tells} where light lands, and the map shows no more")
        } else if self.settings.map_fit() == MapFit::Landings && matches!(output, Output::Bake { .. }) {
            if self.setups.iter().any(|s| s.receiver_view.is_some()) {
                "the map holds the receiver's own texels".into()
            } else {
                "no finer map would be resolved by the bake's samples".into()
            }
        } else {
            format!("{method}: the map shows all that may be lit")
        };
        decision("map_fit", kept, reason)
    }

    /// How cells are split, and where each light's land.
    fn splits(&self) -> Vec<Decision> {
        let (kept, reason) = match self.settings.cell_splits {
            0 => (false, "cells are not split".to_owned()),
            splits => (
                self.caustic(),
                format!("cells are split up to {splits} times along each side, and more often across edges"),
            ),
        };
        ["footprint_split", "footprint_queue"].map(|pass| decision(pass, kept, reason.clone())).into()
    }

    fn footprint_notes(&self) -> Vec<String> {
        if !self.caustic() {
            return Vec::new();
        }
        let maps = self.setups.iter().filter(|s| s.caustic).map(|setup| {
            let map = match setup.receiver_view {
                Some(_) => "light lands on the receiver's own texels",
                None => "light lands on a map seen from the light",
            };
            format!("{}: {map}", self.light_name(setup.index))
        });
        maps.collect()
    }

    /// What was done to the glass, and the wavelengths of each light.
    fn photon_notes(&self) -> Vec<String> {
        if !self.caustic() {
            return Vec::new();
        }
        let name = |object: &usize| &self.scene.objects[*object].name;
        let turned = self
            .geometry
            .turned
            .iter()
            .map(|o| format!("`{}` is closed and inside out: its faces are turned outwards", name(o)));
        let open = self
            .geometry
            .open
            .iter()
            .map(|o| format!("`{}` has an open edge: light may land inside it", name(o)));
        let wavelengths = self.setups.iter().filter(|s| s.caustic).map(|setup| {
            let why = if self.scene.lights[setup.index].spectrum.line_nm().is_some() {
                "its spectrum is a line".to_owned()
            } else {
                let Effects { dispersion, absorption, .. } = self.effects;
                format!("{}; {}", state("dispersion", dispersion), state("absorption", absorption))
            };
            let count = setup.bands.wavelengths_nm.len();
            let s = if count == 1 { "" } else { "s" };
            format!("{}, {count} wavelength{s}: {why}", self.light_name(setup.index))
        });
        let inside = self.inside_note();
        turned.chain(open).chain(wavelengths).chain(inside).chain([self.reflection_note()]).collect()
    }

    fn gaps(&self) -> [Decision; 3] {
        let dispersion = &self.effects.dispersion;
        let kept = self.setups.iter().any(|s| s.gaps);
        let one = |setup: &LightSetup| setup.bands.wavelengths_nm.len() == 1;
        let reason = if !self.caustic() {
            self.photon_reason()
        } else if !self.refracted() {
            "no light goes into glass, and reflection does not split it".into()
        } else if self.settings.gap_filling() == GapFilling::None {
            format!("{}: no gap filling was asked for", self.settings.method.name())
        } else if kept {
            format!("gaps between wavelengths: {}", kept_for("dispersion", dispersion))
        } else if self.setups.iter().all(one) {
            "one wavelength leaves no gaps between wavelengths".into()
        } else {
            format!("gaps between wavelengths: {}", state("dispersion", dispersion))
        };
        let without = self.setups.iter().filter(|s| kept && !s.gaps);
        let notes: Vec<_> = without
            .map(|s| format!("{}: not filled, one wavelength leaves no gaps", self.light_name(s.index)))
            .collect();
        let disc = self.settings.gap_filling() == GapFilling::Disc;
        let reach = if kept && !disc { "the paper's rules ask every texel".into() } else { reason.clone() };
        [("gap_mask", kept, reason.clone()), ("gap_reach", kept && disc, reach), ("gap_fill", kept, reason)]
            .map(|(pass, kept, reason)| Decision { notes: notes.clone(), ..decision(pass, kept, reason) })
    }

    fn deferred_refraction(&self, camera: CameraGlass) -> Decision {
        let Effects { deferred_refraction, mirror_images, immersion, .. } = self.effects;
        if !self.lit() {
            return decision("deferred_refraction", false, DARK.into());
        }
        let glass = if camera.bends {
            kept_for("deferred refraction", deferred_refraction)
        } else if camera.drawn {
            "glass tints what is straight behind it: bending the view was not asked for".into()
        } else {
            state("deferred refraction", deferred_refraction)
        };
        let mirrors = camera.mirrors.then(|| kept_for("mirror images", mirror_images));
        let inside = camera.inside.map(|_| kept_for("immersion", immersion));
        let reasons: Vec<_> = std::iter::once(glass).chain(mirrors).chain(inside).collect();
        decision("deferred_refraction", camera.goes_on(), reasons.join("; "))
    }
}
