//! Lights: what they give an unblocked point, and the bundles of paths they send at refractors and mirrors.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use glam::{DVec2, DVec3};
use spectral_core::observer::Observer;
use spectral_core::rgb::luminance;
use spectral_scene::{Light, LightShape, Scene};

use crate::medium::Nesting;
use crate::spectrum::Spectrum;
use crate::tree::Pending;
use crate::world::World;

/// A light of the scene with its spectrum prepared.
#[derive(Clone, Debug)]
pub(crate) struct Lamp {
    shape: LightShape,
    /// Lux or candela, the colour's luminance included.
    strength: f64,
    pub(crate) unit_xyz: [f64; 3],
    pub(crate) spectrum: Spectrum,
    /// Refractors around a point or spot light.
    nesting: Nesting,
}

/// Light that reaches a point if nothing blocks it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Incident {
    /// Unit vector towards the light.
    pub(crate) towards: DVec3,
    /// To the light, metres; infinite for directional light.
    pub(crate) distance_m: f64,
    /// On a surface perpendicular to it, lux.
    pub(crate) lux: f64,
}

impl Lamp {
    /// All lights of the scene.
    pub(crate) fn all(scene: &Scene, observer: Observer, step_nm: f64, world: &World) -> Vec<Self> {
        scene.lights.iter().map(|light| Self::new(light, observer, step_nm, world)).collect()
    }

    fn new(light: &Light, observer: Observer, step_nm: f64, world: &World) -> Self {
        let nesting = match light.shape {
            LightShape::Directional { .. } => Nesting::default(),
            LightShape::Point { position_m, .. } | LightShape::Spot { position_m, .. } => {
                world.nesting_at(position_m, &mut Pending::default())
            }
        };
        Self {
            shape: light.shape,
            strength: light.intensity * luminance(light.color),
            unit_xyz: light.spectrum.unit_xyz(observer),
            spectrum: Spectrum::new(&light.spectrum, observer, step_nm),
            nesting,
        }
    }

    /// `None` where the light does not shine.
    pub(crate) fn incident(&self, point: DVec3) -> Option<Incident> {
        let (incident, range_m) = match self.shape {
            LightShape::Directional { direction } => {
                let incident = Incident {
                    towards: -direction.normalize(),
                    distance_m: f64::INFINITY,
                    lux: self.strength,
                };
                return (self.strength > 0.0).then_some(incident);
            }
            LightShape::Point { position_m, range_m } => (self.near(point, position_m), range_m),
            LightShape::Spot { position_m, range_m, .. } => (self.near(point, position_m), range_m),
        };
        (incident.lux > 0.0
            && incident.lux.is_finite()
            && incident.distance_m <= range_m.unwrap_or(f64::INFINITY))
        .then_some(incident)
    }

    fn near(&self, point: DVec3, position_m: DVec3) -> Incident {
        let distance_m = position_m.distance(point);
        let towards = (position_m - point) / distance_m;
        Incident { towards, distance_m, lux: self.candela(-towards) / (distance_m * distance_m) }
    }

    /// Intensity of a point or spot light in a direction of travel. The cone's edge is KHR_lights_punctual's: the
    /// square of the cosine's way from outer to inner cone.
    fn candela(&self, travel: DVec3) -> f64 {
        match self.shape {
            LightShape::Spot { direction, inner_cone_rad, outer_cone_rad, .. } => {
                let (inner, outer) = (inner_cone_rad.cos(), outer_cone_rad.cos());
                let way = (travel.dot(direction.normalize()) - outer) / (inner - outer).max(1e-3);
                self.strength * way.clamp(0.0, 1.0).powi(2)
            }
            _ => self.strength,
        }
    }
}

/// The paths from one light to the bounds of one refractor or mirror.
///
/// Bundles of several may overlap: a path counts only if its first surface is the object it was sent to, so every piece
/// of glass or metal is lit exactly once.
#[derive(Clone, Debug)]
pub(crate) struct Bundle {
    /// Into the lamps.
    pub(crate) lamp: usize,
    /// The index of the refractor or mirror into the scene's objects.
    pub(crate) target: u32,
    pub(crate) nesting: Nesting,
    /// Light ends here, metres from where paths start.
    pub(crate) range_m: f64,
    /// Flux within the bundle, lumens, by the nominal strength of the light.
    pub(crate) flux: f64,
    form: Form,
}

#[derive(Clone, Copy, Debug)]
enum Form {
    /// Parallel light through a rectangle perpendicular to it.
    Beam { corner: DVec3, u: DVec3, v: DVec3, direction: DVec3 },
    /// Light from a point within a cone.
    Cone { apex: DVec3, axis: DVec3, u: DVec3, v: DVec3, one_minus_cos: f64 },
}

impl Bundle {
    /// The bundles of all lights to all refractors and mirrors that can have any flux.
    pub(crate) fn all(scene: &Scene, world: &World, lamps: &[Lamp]) -> Vec<Self> {
        let targets: Vec<(u32, Vec<DVec3>)> = scene
            .casters()
            .map(|object| {
                let corners = world.faces.iter().zip(&world.corners);
                (
                    object as u32,
                    corners.filter(|(f, _)| f.object == object as u32).flat_map(|(_, c)| *c).collect(),
                )
            })
            .filter(|(_, corners): &(u32, Vec<DVec3>)| !corners.is_empty())
            .collect();
        let mut bundles = Vec::new();
        for (lamp, light) in lamps.iter().enumerate() {
            for (target, corners) in &targets {
                let bundle = Self::new(lamp, light, *target, corners, world);
                if bundle.flux > 0.0 && bundle.flux.is_finite() {
                    bundles.push(bundle);
                }
            }
        }
        bundles
    }

    fn new(index: usize, lamp: &Lamp, target: u32, corners: &[DVec3], world: &World) -> Self {
        let (form, range_m, flux) = match lamp.shape {
            LightShape::Directional { direction } => {
                let (form, area) = beam(direction.normalize(), corners, world);
                (form, None, lamp.strength * area)
            }
            LightShape::Point { position_m, range_m } | LightShape::Spot { position_m, range_m, .. } => {
                let (form, solid_angle) = cone(position_m, corners, lamp.nesting.contains(target));
                (form, range_m, lamp.strength * solid_angle)
            }
        };
        let range_m = range_m.unwrap_or(f64::INFINITY);
        Self { lamp: index, target, nesting: lamp.nesting, range_m, flux, form }
    }

    /// Origin, direction and flux of the path at a point of the unit square; the mean flux over the square is the
    /// bundle's.
    pub(crate) fn path(&self, lamp: &Lamp, [s, t]: [f64; 2]) -> (DVec3, DVec3, f64) {
        match self.form {
            Form::Beam { corner, u, v, direction } => (corner + u * s + v * t, direction, self.flux),
            Form::Cone { apex, axis, u, v, one_minus_cos } => {
                let disc = concentric(s, t);
                // r^2 (1 - cos) keeps equal areas of the disc at equal solid angles.
                let below = disc.length_squared() * one_minus_cos;
                let along = disc * (one_minus_cos * (2.0 - below)).max(0.0).sqrt();
                let direction = (axis * (1.0 - below) + u * along.x + v * along.y).normalize();
                (apex, direction, TAU * one_minus_cos * lamp.candela(direction))
            }
        }
    }
}

/// The smallest of some rectangles round the object's shadow, in front of everything, and its area.
fn beam(direction: DVec3, corners: &[DVec3], world: &World) -> (Form, f64) {
    const TURNS: u32 = 32;
    let (e1, e2) = direction.any_orthonormal_pair();
    let before = world.corners.iter().flatten().map(|p| p.dot(direction)).fold(f64::INFINITY, f64::min);
    let extent = corners.iter().fold(0.0, |m: f64, p| m.max((*p - corners[0]).abs().max_element()));
    let plane = before - extent.max(world.contact_m);
    let rectangle = |turn: u32| {
        let (sin, cos) = (FRAC_PI_2 * f64::from(turn) / f64::from(TURNS)).sin_cos();
        let (u, v) = (e1 * cos + e2 * sin, e2 * cos - e1 * sin);
        let (mut lo, mut hi) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for p in corners {
            let q = DVec2::new(p.dot(u), p.dot(v));
            (lo, hi) = (lo.min(q), hi.max(q));
        }
        // The shadow's rim belongs inside, and rounding must not cut it off.
        let rim = DVec2::splat(4.0 * world.contact_m);
        (u, v, lo - rim, hi + rim)
    };
    let area = |turn| {
        let (_, _, lo, hi) = rectangle(turn);
        (hi - lo).element_product()
    };
    let (best, area) = (0..TURNS)
        .map(|turn| (turn, area(turn)))
        .fold((0, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a });
    let (u, v, lo, hi) = rectangle(best);
    let (size, corner) = (hi - lo, direction * plane + u * lo.x + v * lo.y);
    (Form::Beam { corner, u: u * size.x, v: v * size.y, direction }, area)
}

/// The cone round the object seen from a light, and its solid angle; all directions if that is no narrow cone.
fn cone(apex: DVec3, corners: &[DVec3], inside: bool) -> (Form, f64) {
    const WIDEST_COS: f64 = 0.05;
    let lo = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let hi = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let axis = (0.5 * (lo + hi) - apex).normalize_or(DVec3::Y);
    // sin^2 / (1 + cos) instead of 1 - cos, which would cancel for a distant object.
    let one_minus_cos = corners
        .iter()
        .map(|p| {
            let d = *p - apex;
            let (cos, sin2) = (d.dot(axis) / d.length(), d.cross(axis).length_squared() / d.length_squared());
            if cos > WIDEST_COS { sin2 / (1.0 + cos) } else { 2.0 }
        })
        .fold(0.0, f64::max);
    let one_minus_cos = if inside || one_minus_cos >= 1.0 { 2.0 } else { one_minus_cos * (1.0 + 1e-9) };
    let (u, v) = axis.any_orthonormal_pair();
    (Form::Cone { apex, axis, u, v, one_minus_cos }, TAU * one_minus_cos)
}

/// The unit square onto the unit disc, preserving areas (Shirley & Chiu 1997).
fn concentric(s: f64, t: f64) -> DVec2 {
    let (a, b) = (2.0 * s - 1.0, 2.0 * t - 1.0);
    if a == 0.0 && b == 0.0 {
        return DVec2::ZERO;
    }
    let (radius, angle) =
        if a.abs() > b.abs() { (a, FRAC_PI_4 * b / a) } else { (b, FRAC_PI_2 - FRAC_PI_4 * a / b) };
    DVec2::from_angle(angle) * radius
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_disc_is_filled_evenly() {
        let n = 400;
        let mut inner = 0;
        for i in 0..n {
            for j in 0..n {
                let p = concentric((f64::from(i) + 0.5) / f64::from(n), (f64::from(j) + 0.5) / f64::from(n));
                assert!(p.length() <= 1.0);
                inner += u32::from(p.length() < 0.5);
            }
        }
        assert!((f64::from(inner) / f64::from(n * n) - 0.25).abs() < 2e-3, "{inner}");
    }
}
