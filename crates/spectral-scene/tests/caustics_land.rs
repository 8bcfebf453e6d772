//! The bundled scenes show what they are for: refracted and mirrored light reaches their main receiver.
//!
//! A small tracer of its own follows single rays: through every surface that lets them pass, round total
//! reflections and mirrors, to the first matt object. No Fresnel, no accumulation; that is the oracle's business.

use glam::DVec3;
use spectral_core::optics::{Refraction, refract};
use spectral_scene::*;

struct Triangle {
    object: usize,
    corners: [DVec3; 3],
    /// One normal per corner: the vertices' or three times the facet's.
    normals: [DVec3; 3],
    uvs: [[f64; 2]; 3],
}

struct World<'a> {
    scene: &'a Scene,
    matt: Vec<Triangle>,
    casting: Vec<Triangle>,
    /// Bounds of the refractors and mirrors: most rays miss them on most of their segments.
    bounds: (DVec3, DVec3),
}

/// Where a ray ends.
#[derive(Debug, PartialEq)]
enum End {
    /// On a matt object, at these texture coordinates, after meeting glass or a mirror.
    Landed { object: usize, uv: [f64; 2] },
    /// Anywhere else after meeting glass or a mirror.
    Lost,
    /// Without having met either.
    Missed,
}

impl<'a> World<'a> {
    fn new(scene: &'a Scene) -> Self {
        let (mut matt, mut casting) = (Vec::new(), Vec::new());
        let is_matt: Vec<usize> = scene.matt().collect();
        for object in 0..scene.objects.len() {
            let mesh = scene.world_mesh(object);
            let list = if is_matt.contains(&object) { &mut matt } else { &mut casting };
            list.extend(mesh.triangles.iter().map(|t| {
                let corners @ [a, b, c] = t.map(|v| mesh.positions[v as usize]);
                let facet = (b - a).cross(c - a).normalize();
                let normals =
                    if mesh.normals.is_empty() { [facet; 3] } else { t.map(|v| mesh.normals[v as usize]) };
                let uv = |v: u32| mesh.uvs.get(v as usize).map_or([0.0; 2], |uv| uv.map(f64::from));
                Triangle { object, corners, normals, uvs: t.map(uv) }
            }));
        }
        let bounds = scene.bounds(scene.casters()).expect("glass or a mirror");
        Self { scene, matt, casting, bounds }
    }

    /// Nearest triangle ahead, with distance and barycentric weights.
    fn hit(&self, origin: DVec3, direction: DVec3) -> Option<(&Triangle, f64, DVec3)> {
        let near = {
            let (a, b) = ((self.bounds.0 - origin) / direction, (self.bounds.1 - origin) / direction);
            a.max(b).min_element() >= a.min(b).max_element().max(0.0) - 1e-6
        };
        let casting = if near { &self.casting[..] } else { &[] };
        let mut nearest: Option<(&Triangle, f64, DVec3)> = None;
        for triangle in self.matt.iter().chain(casting) {
            let [a, b, c] = triangle.corners;
            let (ab, ac) = (b - a, c - a);
            let p = direction.cross(ac);
            let determinant = ab.dot(p);
            let s = origin - a;
            let (v, q) = (s.dot(p) / determinant, s.cross(ab));
            let w = direction.dot(q) / determinant;
            let t = ac.dot(q) / determinant;
            if v >= 0.0 && w >= 0.0 && v + w <= 1.0 && t > 1e-7 && nearest.is_none_or(|n| t < n.1) {
                nearest = Some((triangle, t, DVec3::new(1.0 - v - w, v, w)));
            }
        }
        nearest
    }

    fn follow(&self, mut origin: DVec3, mut direction: DVec3, lambda_nm: f64) -> End {
        let (mut met, mut reflections) = (false, 0);
        while let Some((triangle, t, weights)) = self.hit(origin, direction) {
            let mix = |v: [DVec3; 3]| v[0] * weights.x + v[1] * weights.y + v[2] * weights.z;
            let material = self.scene.material_of(triangle.object);
            if !material.is_refractor() && !material.is_mirror() {
                let uv = [0, 1].map(|k| weights.dot(DVec3::from(triangle.uvs.map(|uv| uv[k]))));
                return if met { End::Landed { object: triangle.object, uv } } else { End::Missed };
            }
            let normal = mix(triangle.normals).normalize();
            origin += direction * t;
            met = true;
            if material.is_refractor() {
                let n = material.dispersion.ior(lambda_nm);
                let eta = if direction.dot(normal) < 0.0 { n } else { 1.0 / n };
                if let Refraction::Transmitted(onward, _) =
                    refract(direction.to_array(), normal.to_array(), eta)
                {
                    direction = DVec3::from(onward);
                    continue;
                }
            }
            if reflections == 3 {
                return End::Lost;
            }
            reflections += 1;
            direction -= normal * (2.0 * direction.dot(normal));
        }
        if met { End::Lost } else { End::Missed }
    }

    /// Rays of the scene's first light on a grid over a disc round refractors and mirrors; only those that meet them.
    fn ends(&self, lambda_nm: f64, side: usize) -> Vec<End> {
        let (low, high) = self.bounds;
        let (centre, radius) = ((low + high) / 2.0, low.distance(high) / 2.0);
        let shape = self.scene.lights[0].shape;
        let axis = match shape {
            LightShape::Directional { direction } => direction,
            LightShape::Point { position_m, .. } | LightShape::Spot { position_m, .. } => {
                (centre - position_m).normalize()
            }
        };
        let (x, y) = axis.any_orthonormal_pair();
        let coordinate = |i: usize| radius * (2.0 * (i as f64 + 0.5) / side as f64 - 1.0);
        let mut ends = Vec::new();
        for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
            let target = centre + x * coordinate(i) + y * coordinate(j);
            let (origin, direction) = match shape {
                LightShape::Directional { direction } => (target - direction * 2.0, direction),
                LightShape::Point { position_m, .. } | LightShape::Spot { position_m, .. } => {
                    (position_m, (target - position_m).normalize())
                }
            };
            ends.push(self.follow(origin, direction, lambda_nm));
        }
        ends.retain(|end| *end != End::Missed);
        ends
    }
}

#[test]
fn most_redirected_rays_land_on_the_main_receiver() {
    // Shares of the rays that met glass or a mirror: they tell a scene whose caustic has slipped off its floor. Gem and diamond
    // send part of the light back or round more than three times, a mirror ball everywhere; the water is wider than its
    // floor on purpose.
    let shares = [
        ("prism", 0.9, 400),
        ("sphere", 0.9, 24),
        ("ring", 0.8, 24),
        ("gem", 0.3, 48),
        ("diamond", 0.4, 64),
        ("glass", 0.8, 24),
        ("organic", 0.6, 24),
        ("water", 0.1, 24),
        ("metal-ring", 0.8, 64),
        ("underwater", 0.2, 32),
        ("lamps", 0.5, 64),
    ];
    for (name, least, side) in shares {
        let scene = bundled(name).expect("listed");
        let ends = World::new(&scene).ends(550.0, side);
        let receiver = scene.receiver("receiver").expect("main receiver");
        let landed = |end: &&End| matches!(end, End::Landed { object, .. } if *object == receiver);
        let share = ends.iter().filter(landed).count() as f64 / ends.len() as f64;
        println!("{name}: {} rays were redirected, {share:.2} landed", ends.len());
        assert!(ends.len() > 50, "{name}: only {} rays were redirected", ends.len());
        assert!(share >= least, "{name}: {share} of {} rays landed", ends.len());
    }
}

#[test]
fn the_prism_spreads_a_spectrum_from_red_to_violet() {
    let scene = bundled("prism").expect("listed");
    let world = World::new(&scene);
    let receiver = scene.receiver("receiver").expect("main receiver");
    let mean_u = |lambda_nm: f64| {
        let us: Vec<f64> = (world.ends(lambda_nm, 400).iter())
            .filter_map(|end| match end {
                End::Landed { object, uv } if *object == receiver => Some(uv[0]),
                _ => None,
            })
            .collect();
        assert!(us.len() > 50, "{lambda_nm} nm: {} rays landed", us.len());
        let mean = us.iter().sum::<f64>() / us.len() as f64;
        let width = us.iter().map(|u| (u - mean).abs()).fold(0.0, f64::max) * 2.0;
        (mean, width)
    };
    let lines = [700.0, 620.0, 550.0, 480.0, 430.0, 400.0].map(mean_u);
    // The most refracted light lands farthest along -x, and every line lies inside the receiver.
    for pair in lines.windows(2) {
        assert!(pair[1].0 < pair[0].0, "{lines:?}");
    }
    assert!(lines.iter().all(|(u, width)| u - width > 0.0 && u + width < 1.0), "{lines:?}");
    // The slit's image is thin against the spectrum: that makes it one.
    let spread = lines[0].0 - lines[5].0;
    assert!(lines.iter().all(|(_, width)| 4.0 * width < spread), "{lines:?}");
}

#[test]
fn refractors_and_mirrors_stand_clear_of_everything_else() {
    for &name in BUNDLED.iter().filter(|&&n| n != "sphere-fine") {
        let scene = bundled(name).expect("listed");
        for caster in scene.casters() {
            let (low, high) = scene.bounds([caster]).expect("not empty");
            for other in (0..scene.objects.len()).filter(|&other| other != caster) {
                let (other_low, other_high) = scene.bounds([other]).expect("not empty");
                let apart = (low - other_high).max(other_low - high).max_element();
                // The slit plate lies slantwise above the prism, so its box tells nothing.
                if scene.objects[other].name != "slit-plate" {
                    assert!(apart >= 4e-4, "{name}: `{}` is {apart} m off", scene.objects[other].name);
                }
            }
        }
    }
}
