//! What glTF files of other programs may contain.

use glam::{DMat3, DVec3};
use serde_json::{Value, json};
use spectral_scene::{LightShape, Scene, Warning, load, load_bytes};

fn base64(bytes: &[u8]) -> String {
    use base64::Engine;
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

fn load_json(document: &Value) -> (Scene, Vec<Warning>) {
    load_bytes(document.to_string().as_bytes(), "test").unwrap_or_else(|e| panic!("{e}"))
}

/// Type, component type, count and bytes of an accessor.
type Data = (&'static str, u32, usize, Vec<u8>);

/// A document around accessors with a buffer each.
fn document(accessors: &[Data], nodes: Value, meshes: Value) -> Value {
    let accessor = |(i, (kind, component, count, _)): (usize, &Data)| json!({"bufferView": i, "componentType": component, "count": count, "type": kind});
    let view = |(i, (.., bytes)): (usize, &Data)| json!({"buffer": i, "byteLength": bytes.len()});
    let buffer = |(.., bytes): &Data| json!({"byteLength": bytes.len(), "uri": format!("data:;base64,{}", base64(bytes))});
    json!({
        "asset": {"version": "2.0"},
        "nodes": nodes,
        "meshes": meshes,
        "accessors": accessors.iter().enumerate().map(accessor).collect::<Vec<_>>(),
        "bufferViews": accessors.iter().enumerate().map(view).collect::<Vec<_>>(),
        "buffers": accessors.iter().map(buffer).collect::<Vec<_>>(),
    })
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// A quad in z = 0 facing +z: corners 0 to 3 counter-clockwise.
const QUAD: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];

fn facing(scene: &Scene, object: usize) -> Vec<DVec3> {
    let mesh = scene.world_mesh(object);
    let normal = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        (b - a).cross(c - a).normalize()
    };
    mesh.triangles.iter().map(normal).collect()
}

#[test]
fn every_way_of_indexing_gives_the_same_surface() {
    let list = [0, 1, 2, 0, 2, 3];
    let u8s = list.map(|i: u8| i).to_vec();
    let u16s: Vec<u8> = list.iter().flat_map(|&i| u16::from(i).to_le_bytes()).collect();
    let u32s: Vec<u8> = list.iter().flat_map(|&i| u32::from(i).to_le_bytes()).collect();
    let unindexed: Vec<f32> = list.iter().flat_map(|&i| QUAD[3 * i as usize..][..3].to_vec()).collect();
    let accessors = [
        ("VEC3", 5126, 4, floats(&QUAD)),
        ("SCALAR", 5121, 6, u8s),
        ("SCALAR", 5123, 6, u16s),
        ("SCALAR", 5125, 6, u32s),
        ("SCALAR", 5121, 4, vec![0, 1, 3, 2]),
        ("SCALAR", 5121, 4, vec![0, 1, 2, 3]),
        ("VEC3", 5126, 6, floats(&unindexed)),
    ];
    let primitive = |position: usize, indices: Option<usize>, mode: u32| {
        let mut primitive = json!({"attributes": {"POSITION": position}, "mode": mode});
        if let Some(indices) = indices {
            primitive["indices"] = json!(indices);
        }
        primitive
    };
    let primitives = json!([
        primitive(0, Some(1), 4),
        primitive(0, Some(2), 4),
        primitive(0, Some(3), 4),
        primitive(0, Some(4), 5),
        primitive(0, Some(5), 6),
        primitive(6, None, 4),
        primitive(0, None, 6),
    ]);
    let nodes = json!([{"name": "quad", "mesh": 0}]);
    let (scene, _) = load_json(&document(&accessors, nodes, json!([{"primitives": primitives}])));
    assert_eq!(scene.objects.len(), 7);
    assert_eq!(scene.objects[0].name, "quad");
    assert_eq!(scene.objects[6].name, "quad.6");
    for object in 0..7 {
        assert_eq!(facing(&scene, object), [DVec3::Z; 2], "primitive {object}");
        assert!(scene.meshes[scene.objects[object].mesh].normals.is_empty());
        let mesh = scene.world_mesh(object);
        let area: f64 = (mesh.triangles.iter())
            .map(|t| {
                let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
                (b - a).cross(c - a).length() / 2.0
            })
            .sum();
        assert_eq!(area, 1.0, "primitive {object}");
    }
}

#[test]
fn points_lines_skins_and_animations_are_left_out_with_a_warning() {
    let accessors = [("VEC3", 5126, 4, floats(&QUAD))];
    let primitives = json!([
        {"attributes": {"POSITION": 0}, "mode": 0},
        {"attributes": {"POSITION": 0}, "mode": 6, "targets": [{}]},
    ]);
    let mut source =
        document(&accessors, json!([{"mesh": 0, "skin": 0}]), json!([{"primitives": primitives}]));
    source["animations"] = json!([{}]);
    source["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    let (scene, warnings) = load_json(&source);
    assert_eq!(scene.objects.len(), 1);
    let text: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    for expected in [
        "points or lines",
        "skin",
        "animation",
        "morph targets",
        "EXT_mesh_gpu_instancing",
        "no perspective camera",
        "no KHR_lights_punctual",
    ] {
        assert!(text.iter().any(|t| t.contains(expected)), "{expected}: {text:?}");
    }
}

#[test]
fn hierarchies_multiply_and_mirrored_nodes_keep_facing_outwards() {
    let normals: Vec<f32> = [0.0, 0.6, 0.8].repeat(4);
    let accessors = [("VEC3", 5126, 4, floats(&QUAD)), ("VEC3", 5126, 4, floats(&normals))];
    let primitives = json!([{"attributes": {"POSITION": 0, "NORMAL": 1}, "mode": 6}]);
    let nodes = json!([
        {"translation": [10, 0, 0], "rotation": [0, 0, (0.5_f64.sqrt()), (0.5_f64.sqrt())], "children": [1, 2]},
        {"name": "straight", "mesh": 0, "scale": [1, 4, 2]},
        {"name": "mirrored", "mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]},
    ]);
    let (scene, _) = load_json(&document(&accessors, nodes, json!([{"primitives": primitives}])));
    let straight = scene.world_mesh(0);
    // A quarter turn about z takes corner (1, 4, 0) to (-4, 1, 0), then the parent moves it.
    assert!(straight.positions[2].distance(DVec3::new(6.0, 1.0, 0.0)) < 1e-12);
    // Normals go by the inverse transpose: (0, 0.6 / 4, 0.8 / 2) before the turn.
    let expected = DVec3::new(-0.15, 0.0, 0.4).normalize();
    assert!(straight.normals[0].distance(expected) < 1e-7, "{}", straight.normals[0]);

    // The mirror image of a face to +z still faces +z, seen from where glTF says its front is.
    let mirrored = scene.world_mesh(1);
    assert!(DMat3::from_mat4(scene.objects[1].world_from_mesh).determinant() < 0.0);
    assert!(facing(&scene, 1).iter().all(|n| n.distance(DVec3::Z) < 1e-12));
    assert!(mirrored.normals[0].dot(DVec3::Z) > 0.0);
    assert!(mirrored.positions[2].distance(DVec3::new(9.0, -1.0, 5.0)) < 1e-12, "{}", mirrored.positions[2]);
    assert_ne!(scene.objects[0].mesh, scene.objects[1].mesh);
}

#[test]
fn interleaved_sparse_and_normalised_accessors_are_read() {
    let interleaved: Vec<f32> = QUAD.chunks(3).flat_map(|p| [p[0], p[1], p[2], 9.0, 9.0]).collect();
    let accessors = [
        ("VEC3", 5126, 4, floats(&interleaved)),
        ("VEC2", 5121, 4, vec![0, 255, 51, 0, 255, 255, 0, 0]),
        ("SCALAR", 5121, 1, vec![2]),
        ("VEC3", 5126, 1, floats(&[5.0, 6.0, 7.0])),
    ];
    let primitives = json!([{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "mode": 6}]);
    let mut source = document(&accessors, json!([{"mesh": 0}]), json!([{"primitives": primitives}]));
    source["bufferViews"][0]["byteStride"] = json!(20);
    source["accessors"][1]["normalized"] = json!(true);
    source["accessors"][0]["sparse"] = json!({
        "count": 1,
        "indices": {"bufferView": 2, "componentType": 5121},
        "values": {"bufferView": 3},
    });
    let (scene, _) = load_json(&source);
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.positions, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [5.0, 6.0, 7.0], [0.0, 1.0, 0.0]]);
    assert_eq!(mesh.uvs[..2], [[0.0, 1.0], [0.2, 0.0]]);
    source["accessors"][0]["sparse"]["indices"]["bufferView"] = json!(0);
    source["accessors"][0]["sparse"]["indices"]["componentType"] = json!(5125);
    source["accessors"][0]["sparse"]["indices"]["byteOffset"] = json!(12);
    let message = load_bytes(source.to_string().as_bytes(), "x").expect_err("index 9.0f32").to_string();
    assert!(message.contains("accessors[0]") && message.contains("the accessor has 4"), "{message}");
}

#[test]
fn missing_values_take_the_defaults_of_the_specification() {
    let accessors = [("VEC3", 5126, 4, floats(&QUAD))];
    let nodes = json!([
        {"mesh": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"translation": [1, 2, 3], "scale": [2, 2, 2], "extensions": {"KHR_lights_punctual": {"light": 1}}},
        {"camera": 0, "scale": [3, -3, 3]},
    ]);
    let primitives = json!([{"attributes": {"POSITION": 0}, "mode": 6}]);
    let mut source = document(&accessors, nodes, json!([{"primitives": primitives}]));
    source["extensions"] =
        json!({"KHR_lights_punctual": {"lights": [{"type": "directional"}, {"type": "spot", "name": "s"}]}});
    source["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}]);
    let (scene, warnings) = load_json(&source);
    assert_eq!(warnings, []);
    let material = &scene.materials[0];
    assert_eq!((material.metallic, material.roughness, material.base_color), (1.0, 1.0, [1.0; 3]));
    assert_eq!(material.dispersion, spectral_core::dispersion::Dispersion::Constant { n: 1.5 });
    assert!(!material.is_refractor());
    assert_eq!(scene.lights[0].intensity, 1.0);
    assert_eq!(scene.lights[0].spectrum, spectral_core::light::LightSpectrum::default());
    assert_eq!(scene.lights[0].shape, LightShape::Directional { direction: DVec3::NEG_Z });
    assert_eq!(
        scene.lights[1].shape,
        LightShape::Spot {
            position_m: DVec3::new(1.0, 2.0, 3.0),
            direction: DVec3::NEG_Z,
            inner_cone_rad: 0.0,
            outer_cone_rad: std::f64::consts::FRAC_PI_4,
            range_m: None,
        }
    );
    // Scale and mirroring of a camera's node do not touch its picture; its up does turn over.
    let frame = DMat3::from_mat4(scene.cameras[0].world_from_camera);
    assert_eq!(frame.z_axis, DVec3::Z);
    assert_eq!(frame.y_axis, DVec3::NEG_Y);
    assert_eq!(frame.determinant(), 1.0);
}

#[test]
fn glass_that_is_simulated_differently_says_so() {
    let accessors = [("VEC3", 5126, 4, floats(&QUAD))];
    let primitives = json!([{"attributes": {"POSITION": 0}, "mode": 6, "material": 0}]);
    let mut source = document(&accessors, json!([{"mesh": 0}]), json!([{"primitives": primitives}]));
    source["materials"] = json!([
        {
            "name": "frosted", "alphaMode": "BLEND", "normalTexture": {"index": 0},
            "pbrMetallicRoughness": {"roughnessFactor": 0.4},
            "extensions": {
                "KHR_materials_ior": {"ior": 0}, "KHR_materials_transmission": {"transmissionFactor": 1},
                "KHR_materials_iridescence": {"iridescenceFactor": 1},
            },
        },
        {"name": "unused", "alphaMode": "BLEND"},
    ]);
    let (scene, warnings) = load_json(&source);
    let material = String::from("frosted");
    for expected in [
        Warning::RoughGlass { material: material.clone(), roughness: 0.4 },
        Warning::ThinWalled { material: material.clone() },
        Warning::IorZero { material: material.clone() },
        Warning::Iridescence { material: material.clone() },
        Warning::AlphaIgnored { material: material.clone(), alpha_mode: "BLEND".into() },
        Warning::TextureIgnored { material, texture: "normalTexture" },
    ] {
        assert!(warnings.contains(&expected), "{expected}: {warnings:?}");
    }
    assert!(!warnings.iter().any(|w| w.to_string().contains("unused")));
    assert_eq!(scene.materials[0].dispersion.n_d(), 1.5);
}

#[test]
fn metal_is_a_mirror_or_matt_and_what_is_rounded_says_so() {
    let accessors = [("VEC3", 5126, 4, floats(&QUAD))];
    let primitive = |material: usize| json!({"attributes": {"POSITION": 0}, "mode": 6, "material": material});
    let primitives: Vec<Value> = (0..5).map(primitive).collect();
    let mut source = document(&accessors, json!([{"mesh": 0}]), json!([{"primitives": primitives}]));
    let material = |name: &str, metallic: f64, roughness: f64| json!({"name": name, "pbrMetallicRoughness": {"metallicFactor": metallic, "roughnessFactor": roughness}});
    source["materials"] = json!([
        material("polished", 1.0, 0.0),
        material("brushed", 0.6, 0.24),
        material("cast", 1.0, 0.25),
        material("lacquer", 0.5, 0.0),
        {"name": "bare"},
    ]);
    let (scene, warnings) = load_json(&source);
    let metal: Vec<Warning> = warnings
        .into_iter()
        .filter(|w| matches!(w, Warning::NearlySmoothMetal { .. } | Warning::RoughMetal { .. }))
        .collect();
    assert_eq!(
        metal,
        [
            Warning::NearlySmoothMetal { material: "brushed".into(), roughness: 0.24 },
            Warning::RoughMetal { material: "cast".into(), roughness: 0.25 },
            // glTF's material of nothing but defaults is metal as rough as can be.
            Warning::RoughMetal { material: "bare".into(), roughness: 1.0 },
        ]
    );
    assert_eq!(scene.mirrors().collect::<Vec<_>>(), [0, 1]);
    assert_eq!(scene.casters().collect::<Vec<_>>(), [0, 1]);
    assert_eq!(scene.matt().collect::<Vec<_>>(), [2, 3, 4]);
    assert_eq!(scene.opaque().count(), 5);
}

/// A file made by other people's tools: see tests/assets/README.md at the root of the workspace.
#[test]
fn the_bunny_loads_with_all_it_says() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/assets/bunny-glass.glb");
    let (scene, warnings) = load(path).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(warnings, []);
    assert_eq!(scene.name, "bunny-glass");
    let refractors: Vec<usize> = scene.refractors().collect();
    let [bunny] = refractors[..] else { panic!("{refractors:?}") };
    let mesh = scene.world_mesh(bunny);
    assert_eq!((mesh.triangles.len(), mesh.positions.len(), mesh.normals.len()), (5648, 2826, 2826));
    let (low, high) = scene.bounds([bunny]).expect("not empty");
    assert!(low.y > 0.0 && (high.y - low.y - 0.2).abs() < 0.002, "{low} {high}");

    let glass = scene.material_of(bunny);
    assert!((glass.dispersion.n_d() - 1.5168).abs() < 1e-12);
    assert!((glass.dispersion.abbe_v_d() - 64.17).abs() < 1e-9);
    let attenuation = glass.attenuation.expect("it has a volume");
    assert_eq!((attenuation.color, attenuation.distance_m), ([0.8, 0.95, 0.85], 0.1));

    let floor = scene.receiver("floor").expect("it has UVs");
    assert_eq!(scene.world_mesh(floor).uvs.len(), 4);
    assert_eq!(scene.material_of(floor).base_color, [0.8; 3]);
    assert_eq!((scene.lights.len(), scene.cameras.len()), (1, 1));
    assert_eq!(scene.lights[0].intensity, 1.0);
    let LightShape::Directional { direction } = scene.lights[0].shape else { panic!("a sun") };
    assert!(direction.y < -0.5);
    assert_eq!(scene.cameras[0].yfov_rad, 0.8);
    let message = scene.receiver("receiver").expect_err("it has none").to_string();
    assert!(message.contains("receivers in the scene: floor"), "{message}");
    let message = scene.receiver("mesh").expect_err("glass").to_string();
    assert!(message.contains("refracting material `glass`"), "{message}");
}

#[test]
fn inside_out_glass_is_turned_with_a_warning() {
    let scene = spectral_scene::bundled("sphere").expect("bundled");
    let glass = scene.refractors().next().expect("the scene has glass");
    let mesh = scene.objects[glass].mesh;
    let mut inside_out = scene.clone();
    inside_out.meshes[mesh].triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let load = |scene: &Scene| {
        let bytes = spectral_scene::to_glb(scene).expect("the scene can be written");
        spectral_scene::load_bytes(&bytes, "scene").expect("what was written can be read")
    };
    let (expected, quiet) = load(&scene);
    let (turned, warnings) = load(&inside_out);
    assert_eq!(turned, expected);
    assert_eq!(quiet, []);
    assert_eq!(warnings, [Warning::InsideOut { object: scene.objects[glass].name.clone() }]);
}
