//! Scenes made by hand, and what the tests do with them.

use asm_core::{
    BakePlan, Method, PASSES, Picture, Planner, Settings, Splat, Statistics, bake_plan, render_plan,
};
use frame_plan::cpu::CpuExecutor;
use frame_plan::{Executor, Limits, Plan};
use glam::{DMat4, DVec3};
use spectral_core::dispersion::Dispersion;
use spectral_core::light::LightSpectrum;
use spectral_scene::{IrradianceMaps, Light, LightShape, Material, Mesh, Object, Scene};

pub(crate) fn opaque(base_color: [f64; 3]) -> Material {
    Material::matt("matt", base_color)
}

pub(crate) fn glass(n: f64) -> Material {
    Material::glass("glass", Dispersion::Constant { n })
}

pub(crate) fn tinted(n: f64, color: [f64; 3], distance_m: f64) -> Material {
    glass(n).attenuating(color, distance_m)
}

/// A flat mesh of side `size` round the origin, facing up, u along x and v along z.
pub(crate) fn quad(size: f32) -> Mesh {
    let h = 0.5 * size;
    Mesh {
        name: "quad".into(),
        positions: vec![[-h, 0.0, -h], [-h, 0.0, h], [h, 0.0, h], [h, 0.0, -h]],
        normals: Vec::new(),
        uvs: vec![[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// A box with its middle at the origin, faces outwards.
pub(crate) fn cuboid(size: [f32; 3]) -> Mesh {
    let corner = |i: usize| -> [f32; 3] {
        std::array::from_fn(|a| size[a] * if i >> a & 1 == 1 { 0.5 } else { -0.5 })
    };
    Mesh {
        name: "box".into(),
        positions: (0..8).map(corner).collect(),
        triangles: vec![
            [0, 4, 6],
            [0, 6, 2],
            [1, 3, 7],
            [1, 7, 5],
            [0, 1, 5],
            [0, 5, 4],
            [2, 6, 7],
            [2, 7, 3],
            [0, 2, 3],
            [0, 3, 1],
            [4, 5, 7],
            [4, 7, 6],
        ],
        ..Mesh::default()
    }
}

pub(crate) fn place(scene: &mut Scene, name: &str, mesh: Mesh, material: Material, at: DVec3) {
    scene.meshes.push(mesh);
    scene.materials.push(material);
    scene.objects.push(Object {
        name: name.into(),
        mesh: scene.meshes.len() - 1,
        material: scene.materials.len() - 1,
        world_from_mesh: DMat4::from_translation(at),
    });
}

pub(crate) fn light(shape: LightShape, intensity: f64) -> Light {
    Light { name: "light".into(), color: [1.0; 3], intensity, spectrum: LightSpectrum::default(), shape }
}

pub(crate) fn sun(direction: DVec3) -> Light {
    light(LightShape::Directional { direction: direction.normalize() }, 1.0)
}

/// A floor of side 1 as `receiver` at y = 0 and a plate of `glass` of side `size`, 0.1 thick, its middle at y = 0.2.
pub(crate) fn plate_over_floor(glass: Material, size: f32, light: Light) -> Scene {
    let mut scene = Scene { name: "plate".into(), ..Scene::default() };
    place(&mut scene, "receiver", quad(1.0), opaque([1.0; 3]), DVec3::ZERO);
    place(&mut scene, "plate", cuboid([size, 0.1, size]), glass, DVec3::Y * 0.2);
    scene.lights.push(light);
    scene
}

/// Point splats on a map whose texels are the emission view's where both see the same square.
pub(crate) fn aligned(size: u32) -> Settings {
    Settings {
        emission_size: size,
        map_size: Some(size),
        splat: Splat::Point,
        ..Settings::of(Method::CausticsMap)
    }
}

pub(crate) fn cpu() -> CpuExecutor {
    CpuExecutor::new(PASSES, None).unwrap()
}

pub(crate) fn plan(scene: &Scene, size: u32, settings: &Settings) -> BakePlan {
    bake_plan(scene, scene.receiver("receiver").unwrap(), [size; 2], settings, &cpu().limits()).unwrap()
}

/// Plans of one scene under one setting after the other, whose geometry is made once.
pub(crate) struct Planners<'a> {
    scene: &'a Scene,
    bake: Planner,
    picture: Planner,
}

impl<'a> Planners<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Self {
        Self { scene, bake: Planner::default(), picture: Planner::default() }
    }

    /// Of a bake on the receiver called `receiver`.
    pub(crate) fn bake(&mut self, size: u32, settings: &Settings) -> Plan {
        let receiver = self.scene.receiver("receiver").unwrap();
        self.bake.bake(self.scene, receiver, [size; 2], settings, &Limits::default()).unwrap().plan
    }

    /// Of what the first camera sees.
    pub(crate) fn picture(&mut self, size: u32, settings: &Settings) -> Plan {
        self.picture.render(self.scene, 0, [size; 2], settings, &Limits::default()).unwrap().plan
    }
}

pub(crate) fn run(plan: &BakePlan) -> (IrradianceMaps, Statistics) {
    let mut cpu = cpu();
    cpu.prepare(&plan.plan).unwrap();
    cpu.execute().unwrap();
    let (maps, statistics) = plan.read(&mut cpu).unwrap();
    for light in &statistics.lights {
        assert!(light.ledgers.iter().chain(&light.reflected).all(|ledger| ledger.balances()), "{light:?}");
    }
    for layer in [&maps.direct, &maps.refracted, &maps.reflected] {
        assert!(layer.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
    }
    (maps, statistics)
}

pub(crate) fn bake(scene: &Scene, size: u32, settings: &Settings) -> (IrradianceMaps, Statistics) {
    run(&plan(scene, size, settings))
}

/// Sum over all texels.
pub(crate) fn total(layer: &[[f32; 3]]) -> [f64; 3] {
    layer.iter().fold([0.0; 3], |sum, t| std::array::from_fn(|c| sum[c] + f64::from(t[c])))
}

/// RMS of the difference over RMS of `b`, channel Y, after binning square maps to `bins` along each side.
pub(crate) fn relative_rms(a: &[[f32; 3]], b: &[[f32; 3]], bins: usize) -> f64 {
    let size = a.len().isqrt();
    let binned = |m: &[[f32; 3]]| {
        let mut sums = vec![0.0; bins * bins];
        for (i, t) in m.iter().enumerate() {
            sums[i / size * bins / size * bins + i % size * bins / size] += f64::from(t[1]);
        }
        sums
    };
    let (a, b) = (binned(a), binned(b));
    let squares = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>();
    (squares(&mut a.iter().zip(&b).map(|(a, b)| a - b)) / squares(&mut b.iter().copied())).sqrt()
}

pub(crate) const D65: [f64; 3] = [0.95047, 1.0, 1.08883];

pub(crate) fn picture_of(scene: &Scene, size: [u32; 2], settings: &Settings) -> Picture {
    seen(scene, size, settings).0
}

pub(crate) fn seen(scene: &Scene, size: [u32; 2], settings: &Settings) -> (Picture, Statistics) {
    let mut cpu = cpu();
    let plan = render_plan(scene, 0, size, settings, &cpu.limits()).unwrap();
    cpu.prepare(&plan.plan).unwrap();
    cpu.execute().unwrap();
    let (picture, statistics) = plan.read(&mut cpu).unwrap();
    for light in &statistics.lights {
        assert!(light.ledgers.iter().chain(&light.reflected).all(|ledger| ledger.balances()), "{light:?}");
    }
    assert!(picture.xyz.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
    (picture, statistics)
}

pub(crate) fn picture(scene: &Scene, settings: &Settings) -> Picture {
    picture_of(scene, [64, 48], settings)
}
