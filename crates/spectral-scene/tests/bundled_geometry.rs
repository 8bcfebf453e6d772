//! The bundled meshes are what they claim to be: closed, outward, of the stated size and place.

use std::collections::HashMap;

use glam::DVec3;
use spectral_scene::{BUNDLED, Mesh, Scene, bundled};

fn scene(name: &str) -> Scene {
    bundled(name).unwrap_or_else(|| panic!("{name} is listed"))
}

fn refractor(scene: &Scene) -> usize {
    let refractors: Vec<usize> = scene.refractors().collect();
    assert_eq!(refractors.len(), 1, "{}", scene.name);
    refractors[0]
}

fn mesh_of(scene: &Scene, object: usize) -> &Mesh {
    &scene.meshes[scene.objects[object].mesh]
}

/// Vertices that differ only in their normal are one point of the surface.
fn welded(mesh: &Mesh) -> (usize, Vec<[usize; 3]>) {
    let mut points: HashMap<[u32; 3], usize> = HashMap::new();
    let ids: Vec<usize> = mesh
        .positions
        .iter()
        .map(|p| {
            let next = points.len();
            // Adding 0 turns -0 into +0.
            *points.entry(p.map(|c| (c + 0.0).to_bits())).or_insert(next)
        })
        .collect();
    let triangles = mesh.triangles.iter().map(|t| t.map(|v| ids[v as usize])).collect();
    (points.len(), triangles)
}

/// How often each directed edge is used.
fn edges(triangles: &[[usize; 3]]) -> HashMap<(usize, usize), usize> {
    let mut edges = HashMap::new();
    for &[a, b, c] in triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            *edges.entry(edge).or_insert(0) += 1;
        }
    }
    edges
}

fn assert_closed(mesh: &Mesh, euler_characteristic: isize) {
    let (points, triangles) = welded(mesh);
    let edges = edges(&triangles);
    for (&(a, b), &count) in &edges {
        assert_eq!(count, 1, "{}: edge {a}-{b} is used {count} times in one direction", mesh.name);
        assert!(edges.contains_key(&(b, a)), "{}: edge {a}-{b} has no neighbour", mesh.name);
    }
    let euler = points as isize - edges.len() as isize / 2 + triangles.len() as isize;
    assert_eq!(euler, euler_characteristic, "{}", mesh.name);
}

fn triangle(mesh: &Mesh, t: [u32; 3]) -> [DVec3; 3] {
    t.map(|v| DVec3::from(mesh.positions[v as usize].map(f64::from)))
}

/// Six times the enclosed volume, by the divergence theorem; positive if the faces point outwards.
fn volume(mesh: &Mesh) -> f64 {
    let six: f64 = mesh
        .triangles
        .iter()
        .map(|&t| {
            let [a, b, c] = triangle(mesh, t);
            a.dot(b.cross(c))
        })
        .sum();
    six / 6.0
}

#[test]
fn face_counts_are_those_of_the_paper() {
    // Table 2 of Blanchette & Agu 2013: sphere, ring and gem exactly, glass and bunny within 1 %.
    let faces = |name: &str| {
        let scene = scene(name);
        mesh_of(&scene, refractor(&scene)).triangles.len()
    };
    assert_eq!(faces("sphere"), 5120);
    assert_eq!(faces("sphere-fine"), 327_680);
    assert_eq!(faces("ring"), 65_536);
    // 16 crown and pavilion triangles and 8 girdle quadrilaterals: 24 faces, 32 triangles.
    assert_eq!(faces("gem"), 32);
    assert!(faces("glass").abs_diff(12_137) < 121, "{}", faces("glass"));
    assert!(faces("organic").abs_diff(138_902) < 1389, "{}", faces("organic"));
}

#[test]
fn solids_are_closed_and_face_outwards() {
    for &name in BUNDLED {
        let scene = scene(name);
        let solid = |&object: &usize| scene.objects[object].name != "water";
        for mesh in scene.casters().filter(solid).map(|object| mesh_of(&scene, object)) {
            assert_closed(mesh, if mesh.name == "ring" { 0 } else { 2 });
            assert!(volume(mesh) > 0.0, "{name}: {}", volume(mesh));
        }
    }
    // A plate with one hole is a torus.
    let prism = scene("prism");
    let plate = prism.meshes.iter().find(|m| m.name == "slit-plate").expect("the plate");
    assert_closed(plate, 0);
    assert!(volume(plate) > 0.0);
}

#[test]
fn closedness_check_notices_a_missing_and_a_flipped_triangle() {
    let gem = scene("gem").meshes.pop().expect("the gem is placed last");
    assert_closed(&gem, 2);
    let broken = |spoil: fn(&mut Mesh)| {
        let mut mesh = gem.clone();
        spoil(&mut mesh);
        std::panic::catch_unwind(|| assert_closed(&mesh, 2)).is_err()
    };
    assert!(broken(|m| m.triangles.truncate(31)));
    assert!(broken(|m| m.triangles[3].swap(0, 1)));
}

#[test]
fn volumes_are_those_of_the_ideal_bodies() {
    let volume_of = |name: &str| {
        let scene = scene(name);
        volume(mesh_of(&scene, refractor(&scene)))
    };
    let near = |got: f64, ideal: f64, relative: f64| {
        assert!((got / ideal - 1.0).abs() < relative, "{got} against {ideal}");
    };
    let pi = std::f64::consts::PI;
    // An inscribed mesh is short by about (edge / radius)^2 / 8 of each kind of curvature.
    near(volume_of("sphere"), 4.0 / 3.0 * pi * 0.05_f64.powi(3), 4e-3);
    near(volume_of("sphere-fine"), 4.0 / 3.0 * pi * 0.05_f64.powi(3), 6e-5);
    near(volume_of("ring"), 2.0 * pi * pi * 0.055 * 0.014 * 0.014, 1e-3);
    near(volume_of("prism"), 3_f64.sqrt() / 4.0 * 0.05 * 0.05 * 0.06, 1e-6);
    let metal_ring = scene("metal-ring");
    let band = mesh_of(&metal_ring, metal_ring.mirrors().next().expect("the ring"));
    near(volume(band), pi * (0.053 * 0.053 - 0.05 * 0.05) * 0.024, 2e-4);
    // Outer cone frustum less the cavity, which the fillet makes a little smaller.
    let glass = volume_of("glass");
    assert!((5.0e-5..9.5e-5).contains(&glass), "{glass}");
}

#[test]
fn water_is_an_open_sheet_facing_up() {
    for (name, cells) in [("water", 128), ("underwater", 192)] {
        let water = scene(name);
        let mesh = mesh_of(&water, refractor(&water));
        let (_, triangles) = welded(mesh);
        let edges = edges(&triangles);
        assert!(edges.values().all(|&count| count == 1), "inconsistent orientation");
        let border = edges.keys().filter(|&&(a, b)| !edges.contains_key(&(b, a))).count();
        assert_eq!(border, 4 * cells, "{name}");
        for &t in &mesh.triangles {
            let [a, b, c] = triangle(mesh, t);
            assert!((b - a).cross(c - a).y > 0.0, "{name}");
        }
    }
}

#[test]
fn the_eye_of_underwater_is_below_the_waves_and_everything_else_is_too() {
    let scene = scene("underwater");
    let (water_low, water_high) = scene.bounds(scene.refractors()).expect("water");
    let eye = scene.cameras[0].world_from_camera.w_axis.truncate();
    assert!(eye.y > 0.1 && eye.y < water_low.y - 0.1, "{eye}");
    for object in scene.opaque() {
        let (low, high) = scene.bounds([object]).expect("not empty");
        assert!(high.y < water_low.y, "{}", scene.objects[object].name);
        // No light passes beside the water, however it slants.
        assert!(low.x > water_low.x + 0.3 && high.x < water_high.x - 0.3, "{}", scene.objects[object].name);
        assert!(low.z > water_low.z + 0.3 && high.z < water_high.z - 0.3, "{}", scene.objects[object].name);
    }
}

#[test]
fn vertex_normals_agree_with_their_faces() {
    for &name in BUNDLED {
        for mesh in &scene(name).meshes {
            for &t in mesh.triangles.iter().filter(|_| !mesh.normals.is_empty()) {
                let [a, b, c] = triangle(mesh, t);
                let facet = (b - a).cross(c - a).normalize();
                for v in t {
                    let normal = DVec3::from(mesh.normals[v as usize].map(f64::from));
                    // The roundest place, the glass's rim, turns 15 degrees per face.
                    assert!(normal.dot(facet) > 0.95, "{name}, {}: {}", mesh.name, normal.dot(facet));
                }
            }
        }
    }
}

#[test]
fn scenes_are_valid_without_degenerate_triangles_and_repeatable() {
    for &name in BUNDLED.iter().filter(|&&n| n != "sphere-fine") {
        let scene = scene(name);
        let counts = scene.validate().unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(counts.zero_area_triangles, 0, "{name}");
        assert_eq!(scene, bundled(name).expect("listed"), "{name} differs from itself");
        assert_eq!(scene.name, name);
        let lights = if name == "lamps" { 3 } else { 1 };
        assert_eq!((scene.lights.len(), scene.cameras.len()), (lights, 1), "{name}");
        let receiver = scene.receiver("receiver").unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(mesh_of(&scene, receiver).uvs.len(), 4, "{name}");
    }
}

#[test]
fn brilliant_has_57_facets_and_a_girdle_and_is_convex() {
    let scene = scene("diamond");
    let mesh = mesh_of(&scene, refractor(&scene));
    let mut facets: Vec<(DVec3, f64)> = Vec::new();
    for &t in &mesh.triangles {
        let [a, b, c] = triangle(mesh, t);
        let normal = (b - a).cross(c - a).normalize();
        let plane = normal.dot(a);
        if !facets.iter().any(|(n, d)| n.dot(normal) > 1.0 - 1e-9 && (d - plane).abs() < 1e-6) {
            facets.push((normal, plane));
        }
        for p in &mesh.positions {
            let outside = normal.dot(DVec3::from(p.map(f64::from))) - plane;
            assert!(outside < 1e-6, "a corner stands {outside} outside a facet");
        }
    }
    assert_eq!(facets.len(), 57 + 16);
    let angle = |n: &DVec3| n.y.acos().to_degrees();
    let count = |degrees: f64| facets.iter().filter(|(n, _)| (angle(n) - degrees).abs() < 0.01).count();
    assert_eq!(count(0.0), 1, "table");
    assert_eq!(count(34.5), 8, "bezel facets at the crown angle");
    assert_eq!(count(180.0 - 40.75), 8, "pavilion mains at the pavilion angle");
    assert_eq!(count(90.0), 16, "girdle");
}

/// The conventions of the outside references, stated here a second time and independently.
#[test]
fn reference_scenes_match_the_outside_references() {
    for (name, half, count) in [("sphere", 0.08, 2562), ("sphere-fine", 0.08, 163_842), ("gem", 0.2, 18)] {
        let scene = scene(name);
        let floor = scene.world_mesh(scene.receiver("receiver").expect("receiver"));
        for (p, uv) in floor.positions.iter().zip(floor.uvs) {
            let expected = DVec3::new(
                0.024 + half * f64::from(2.0 * uv[0] - 1.0),
                0.0,
                0.016 + half * f64::from(2.0 * uv[1] - 1.0),
            );
            assert!(p.distance(expected) < 1e-8, "{name}: {p} at {uv:?}");
        }
        let light = &scene.lights[0];
        assert_eq!((light.intensity, light.color), (1.0, [1.0; 3]));
        let spectral_scene::LightShape::Directional { direction } = light.shape else {
            panic!("{name}: a sun")
        };
        assert!(direction.distance(DVec3::new(0.3, -1.0, 0.2).normalize()) < 1e-15);
        for nm in [400.0, 555.0, 700.0] {
            assert_eq!(
                light.spectrum.relative_power(nm),
                light.spectrum.relative_power(600.0),
                "equal energy"
            );
        }
        let object = refractor(&scene);
        let (a, b) = if name == "gem" { (2.3818, 0.0121) } else { (1.5046, 0.0042) };
        for um in [0.4_f64, 0.55, 0.7] {
            let n = scene.material_of(object).dispersion.ior(um * 1000.0);
            assert!((n - (a + b / (um * um))).abs() < 1e-12);
        }
        let glass = scene.world_mesh(object);
        assert_eq!(glass.positions.len(), count, "{name}");
        if name == "gem" {
            assert!(glass.normals.is_empty(), "flat");
            let corner = |degrees: f64, y: f64| {
                let (sin, cos) = degrees.to_radians().sin_cos();
                DVec3::new(0.05 * cos, y, 0.05 * sin)
            };
            for expected in [corner(29.5, 0.084), corner(344.5, 0.076), DVec3::Y * 0.102, DVec3::Y * 0.060] {
                assert!(glass.positions.iter().any(|p| p.distance(expected) < 1e-8), "{expected}");
            }
        } else {
            let centre = DVec3::new(0.0, 0.08, 0.0);
            for (p, n) in glass.positions.iter().zip(&glass.normals) {
                assert!((p.distance(centre) - 0.05).abs() < 1e-8);
                assert!(n.distance((p - centre) / 0.05) < 3e-7);
            }
        }
    }
}
