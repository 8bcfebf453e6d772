//! A glass ball, a tinted prism and a mirror ball under three lamps: the sun, a warm spot and a blue point light.

use glam::{DMat4, DVec3};
use spectral_core::light::LightSpectrum;

use super::catalogue;
use super::facets::equilateral_prism;
use super::stage::{GREY, Stage, clear, matte, quad};
use super::surfaces::SphereGrid;
use crate::{Light, LightShape, Material, Scene};

const SILVER: [f64; 3] = [0.97, 0.96, 0.92];
const BLUE: [f64; 3] = [0.25, 0.5, 1.0];
const GLASS_RADIUS_M: f64 = 0.035;
const MIRROR_RADIUS_M: f64 = 0.03;

pub(super) fn scene() -> Scene {
    let mut stage = Stage::new("lamps");
    stage.floor(0.0, 0.0, 0.2);
    let wall = quad("wall-back", DVec3::new(-0.2, 0.2, -0.2), DVec3::X * 0.4, DVec3::NEG_Y * 0.2);
    stage.place(wall, matte("grey", GREY), DMat4::IDENTITY);

    let ball = |name: &str, radius: f64| SphereGrid::geodesic(12).surface(name, |d| (d * radius, d));
    let glass = clear("N-BK7", catalogue("N-BK7"), 2.0 * GLASS_RADIUS_M);
    let at = |x: f64, y: f64, z: f64| DMat4::from_translation(DVec3::new(x, y, z));
    stage.place(ball("ball", GLASS_RADIUS_M), glass, at(-0.075, 0.045, 0.02));
    let green = clear("green glass", catalogue("N-SF11"), 0.03).attenuating([0.45, 0.9, 0.5], 0.03);
    // Lying on one side, turned a little.
    let lying = at(0.015, 0.022, 0.055)
        * DMat4::from_rotation_y(0.5)
        * DMat4::from_rotation_z(0.5 * std::f64::consts::PI);
    stage.place(equilateral_prism(0.05, 0.06), green, lying);
    stage.place(
        ball("mirror-ball", MIRROR_RADIUS_M),
        Material::mirror("silver", SILVER),
        at(0.09, 0.031, -0.02),
    );

    stage.sun(DVec3::new(0.5, -1.0, -0.25), 400.0, LightSpectrum::default());
    let spot_m = DVec3::new(0.35, 0.45, 0.25);
    let mut lamp = |name: &str, color, intensity, spectrum, shape| {
        stage.0.lights.push(Light { name: String::from(name), color, intensity, spectrum, shape });
    };
    let shape = LightShape::Spot {
        position_m: spot_m,
        direction: (DVec3::new(0.03, 0.0, 0.02) - spot_m).normalize(),
        inner_cone_rad: 0.2,
        outer_cone_rad: 0.4,
        range_m: None,
    };
    let warm = LightSpectrum::cct(3000.0).expect("a black body has this temperature");
    lamp("spot", [1.0; 3], 150.0, warm, shape);
    let shape = LightShape::Point { position_m: DVec3::new(-0.22, 0.25, 0.18), range_m: None };
    lamp("point", BLUE, 60.0, LightSpectrum::d65_upsampled(BLUE), shape);
    stage.camera(DVec3::new(0.0, 0.19, 0.20), DVec3::new(0.005, 0.012, 0.017));
    stage.0
}
