//! Files that are wrong: each gives an error that says what and where, none a panic or a huge allocation.

use proptest::prelude::*;
use serde_json::{Value, json};
use spectral_scene::{LoadError, Scene, bundled, load, load_bytes, to_glb};

fn base64(bytes: &[u8]) -> String {
    use base64::Engine;
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

/// One triangle with indices: 36 bytes of positions, 6 of indices.
fn triangle() -> Value {
    let mut bytes: Vec<u8> =
        [0.0_f32, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0].iter().flat_map(|c| c.to_le_bytes()).collect();
    bytes.extend([0_u16, 1, 2].iter().flat_map(|i| i.to_le_bytes()));
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "children": [1]}, {}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 0, 1]},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 6},
        ],
        "buffers": [{"byteLength": 42, "uri": format!("data:application/octet-stream;base64,{}", base64(&bytes))}],
    })
}

fn load_json(document: &Value) -> Result<Scene, LoadError> {
    load_bytes(document.to_string().as_bytes(), "test").map(|(scene, _)| scene)
}

/// The triangle with the value at a JSON pointer replaced, or added to its object.
fn with(pointer: &str, value: Value) -> Value {
    let mut document = triangle();
    let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
    let parent = document.pointer_mut(parent).unwrap_or_else(|| panic!("{pointer}"));
    match parent {
        Value::Array(items) => items[key.parse::<usize>().expect("an index")] = value,
        other => drop(other.as_object_mut().expect("an object").insert(key.into(), value)),
    }
    document
}

#[test]
fn the_unspoilt_triangle_loads() {
    let scene = load_json(&triangle()).expect("valid");
    assert_eq!(scene.meshes[0].triangles, [[0, 1, 2]]);
    assert_eq!(scene.meshes[0].positions[1], [0.0, 0.0, 1.0]);
}

#[test]
fn wrong_documents_are_refused_with_what_and_where() {
    let huge = 10_u64 << 30;
    let cases: &[(&str, Value, &[&str])] = &[
        ("/accessors/0/count", json!(huge), &["accessors[0]", "10737418240"]),
        ("/accessors/0/count", json!(4), &["accessors[0]", "4 elements", "36 bytes"]),
        ("/accessors/0/count", json!(u64::MAX), &["accessors[0]"]),
        ("/accessors/0/byteOffset", json!(u64::MAX), &["accessors[0]", "bufferViews[0]"]),
        ("/accessors/0/bufferView", json!(7), &["bufferViews[7]", "there are 2"]),
        ("/accessors/0/bufferView", json!(1_u64 << 32), &["bufferViews[4294967296]"]),
        ("/accessors/0/bufferView", Value::Null, &["accessors[0]", "no bufferView"]),
        ("/accessors/0/componentType", json!(5130), &["5130"]),
        ("/accessors/0/componentType", json!(5122), &["KHR_mesh_quantization"]),
        ("/accessors/0/type", json!("VEC2"), &["VEC2", "must be VEC3"]),
        ("/accessors/1/componentType", json!(5126), &["accessors[1]", "5125"]),
        ("/accessors/1/count", json!(2), &["meshes[0].primitives[0]", "2 corners", "multiple of 3"]),
        ("/bufferViews/0/byteLength", json!(huge), &["bufferViews[0]", "buffers[0] has 42"]),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), &["bufferViews[0]"]),
        ("/bufferViews/0/byteStride", json!(4), &["byteStride", "12"]),
        ("/bufferViews/0/byteStride", json!(u64::MAX), &["accessors[0]"]),
        ("/bufferViews/0/buffer", json!(1), &["buffers[1]", "there are 1"]),
        ("/bufferViews/0/extensions", json!({"EXT_meshopt_compression": {}}), &["EXT_meshopt_compression"]),
        ("/buffers/0/byteLength", json!(huge), &["buffers[0]", "42 bytes", "10737418240"]),
        ("/buffers/0/uri", json!("data:;base64,@@@"), &["buffers[0].uri", "base64"]),
        ("/buffers/0/uri", json!("data:text/plain,abc"), &["buffers[0].uri", "base64"]),
        ("/buffers/0/uri", json!("other.bin"), &["other.bin", "from its folder"]),
        ("/buffers/0", json!({"byteLength": 42}), &["buffers[0]", "no uri"]),
        ("/meshes/0/primitives/0/attributes", json!({}), &["POSITION"]),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(9), &["accessors[9]"]),
        ("/meshes/0/primitives/0/attributes/NORMAL", json!(1), &["NORMAL", "VEC3"]),
        ("/meshes/0/primitives/0/indices", json!(9), &["accessors[9]"]),
        ("/meshes/0/primitives/0/material", json!(9), &["materials[9]"]),
        ("/meshes/0/primitives/0/mode", json!(7), &["mode", "0 to 6"]),
        (
            "/meshes/0/primitives/0/extensions",
            json!({"KHR_draco_mesh_compression": {}}),
            &["KHR_draco_mesh_compression"],
        ),
        ("/nodes/0/mesh", json!(3), &["meshes[3]"]),
        ("/nodes/0/camera", json!(3), &["cameras[3]"]),
        ("/nodes/0/children", json!([0]), &["nodes[0]", "twice"]),
        ("/nodes/1/children", json!([0]), &["nodes[0]", "tree"]),
        ("/nodes/0/children", json!([1, 1]), &["nodes[1]", "twice"]),
        ("/nodes/0/children", json!([5]), &["nodes[5]"]),
        ("/nodes/0/rotation", json!([0, 0, 0, 0]), &["nodes[0].rotation", "quaternion"]),
        ("/nodes/0/scale", json!([1e300, 1e300, 1e300]), &["objects[0].world_from_mesh", "finite"]),
        ("/nodes/0/scale", json!([1e10, 1, 1]), &["objects[0].world vertex", "within 1e9 m"]),
        ("/nodes/0/matrix", json!([1, 2]), &["line 1"]),
        (
            "/nodes/0/extensions",
            json!({"KHR_lights_punctual": {"light": 0}}),
            &["KHR_lights_punctual.lights[0]"],
        ),
        ("/scenes/0/nodes", json!([8]), &["nodes[8]"]),
        ("/scene", json!(2), &["scenes[2]"]),
        ("/asset/version", json!("1.0"), &["1.0", "2.0"]),
        ("/asset/minVersion", json!("2.1"), &["2.1"]),
        (
            "/extensionsRequired",
            json!(["KHR_draco_mesh_compression"]),
            &["KHR_draco_mesh_compression", "not supported"],
        ),
        ("/extensionsRequired", json!(["KHR_texture_basisu"]), &["KHR_texture_basisu"]),
        ("/extensionsRequired", json!(["KHR_mesh_quantization"]), &["KHR_mesh_quantization"]),
        (
            "/materials/0/pbrMetallicRoughness",
            json!({"baseColorFactor": [2, 0, 0, 1]}),
            &["materials[0].base_color", "is 2"],
        ),
        (
            "/materials/0/extensions",
            json!({"KHR_materials_ior": {"ior": 0.5}}),
            &["materials[0]", "at least 1"],
        ),
        (
            "/materials/0/extensions",
            json!({"KHR_materials_dispersion": {"dispersion": -1}}),
            &["materials[0]", "-1"],
        ),
        (
            "/materials/0/extensions",
            json!({"KHR_materials_volume": {"attenuationDistance": 0}}),
            &["distance_m", "above 0"],
        ),
        ("/materials/0/extras", json!({"spectral": {"glass": "N-XX9"}}), &["N-XX9", "N-BK7"]),
        ("/materials/0/extras", json!({"spectral": {"cauchy": [1.5]}}), &["2 or 3"]),
        ("/materials/0/extras", json!({"spectral": {"cauchy": [0.2, 0.1]}}), &["at least 1"]),
        ("/materials/0/extras", json!({"spectral": {"cauchi": [1.5, 0.1]}}), &["cauchi", "cauchy"]),
        ("/materials/0/extras", json!({"spectral": 3}), &["materials[0].extras.spectral"]),
    ];
    for (pointer, value, expected) in cases {
        let message = match load_json(&with(pointer, value.clone())) {
            Ok(_) => panic!("{pointer} = {value} was accepted"),
            Err(error) => error.to_string(),
        };
        for part in *expected {
            assert!(message.contains(part), "{pointer} = {value}: `{message}` lacks `{part}`");
        }
    }
}

#[test]
fn wrong_lights_are_refused() {
    let cases = [
        (json!({"type": "area"}), "area"),
        (json!({"type": "point", "intensity": -1}), "intensity"),
        (json!({"type": "point", "intensity": 1.1e30, "name": "flash"}), "lights[0].intensity of `flash`"),
        (json!({"type": "point", "color": [1e20, 1, 1], "intensity": 1e11}), "intensity x color"),
        (json!({"type": "point", "color": [1, 1, 1e31], "intensity": 0}), "lights[0].color"),
        (json!({"type": "point", "intensity": 1e31}), "from 0 to 1e30 lux or candela"),
        (json!({"type": "spot", "spot": {"innerConeAngle": 0.5, "outerConeAngle": 0.4}}), "inner < outer"),
        (json!({"type": "point", "extras": {"spectral": {"illuminant": "FL99"}}}), "FL99"),
        (json!({"type": "point", "extras": {"spectral": {"line_nm": 1000}}}), "380 to 780"),
        (json!({"type": "point", "extras": {"spectral": {"cct_k": 0}}}), r#"{"cct_k":0}"#),
        (json!({"type": "point", "extras": {"spectral": {"black_body_k": -5}}}), "-5"),
    ];
    for (light, expected) in cases {
        let mut document = with("/extensions", json!({"KHR_lights_punctual": {"lights": [light]}}));
        document["nodes"][1] = json!({"extensions": {"KHR_lights_punctual": {"light": 0}}});
        let message = load_json(&document).expect_err("a wrong light").to_string();
        assert!(message.contains(expected), "{light}: {message}");
    }
}

#[test]
fn indices_and_positions_are_checked() {
    let with_bytes = |positions: [f32; 9], indices: [u16; 3]| {
        let mut bytes: Vec<u8> = positions.iter().flat_map(|c| c.to_le_bytes()).collect();
        bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
        load_json(&with("/buffers/0/uri", json!(format!("data:;base64,{}", base64(&bytes)))))
    };
    let good = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0];
    with_bytes(good, [0, 1, 2]).expect("valid");
    let message = with_bytes(good, [0, 1, 3]).expect_err("out of range").to_string();
    assert!(message.contains("3 as index 2") && message.contains("3 vertices"), "{message}");
    for wrong in [f32::NAN, f32::INFINITY] {
        let mut positions = good;
        positions[4] = wrong;
        let message = with_bytes(positions, [0, 1, 2]).expect_err("not finite").to_string();
        assert!(
            message.contains("POSITION") && message.contains("element 1") && message.contains("finite"),
            "{message}"
        );
    }
}

#[test]
fn small_files_cannot_ask_for_unbounded_scenes() {
    // 2,000 nodes place a mesh of 2,000 primitives: four million objects from a few kilobytes of primitives.
    let mut document = triangle();
    let primitive = document["meshes"][0]["primitives"][0].clone();
    document["meshes"][0]["primitives"] = json!(vec![primitive; 2000]);
    document["nodes"] = json!(vec![json!({"mesh": 0}); 2000]);
    document["scenes"][0]["nodes"] = json!((0..2000).collect::<Vec<_>>());
    let message = load_json(&document).expect_err("too many objects").to_string();
    assert!(message.contains("at most 1048576"), "{message}");
}

#[test]
fn things_that_are_no_gltf_are_refused() {
    for (bytes, expected) in [
        (&b""[..], "empty"),
        (b"   ", "empty"),
        (b"\x89PNG\r\n", "begins neither"),
        (b"glTF", "4 bytes"),
        (b"{", "JSON"),
        (b"{\"asset\": 3}", "Asset at line 1 column 11"),
        (b"{\"asset\": {\"version\": \"2.0\"}, \"nodes\": [{\"mesh\": -1}]}", "-1"),
        (b"{\"asset\": {\"version\": \"2.0\"}, \"nodes\": [{\"scale\": [1e999, 1, 1]}]}", "range"),
        (b"{}", "version"),
    ] {
        let message = load_bytes(bytes, "x").expect_err("no glTF").to_string();
        assert!(message.contains(expected), "{message}");
    }
    let deep = format!("{{\"extras\": {}", "[".repeat(1_000_000));
    assert!(matches!(load_bytes(deep.as_bytes(), "x"), Err(LoadError::Json(_))));
    let message = load("/nonexistent/file.glb").expect_err("no file").to_string();
    assert!(message.contains("/nonexistent/file.glb"), "{message}");
}

#[test]
fn deep_node_chains_need_no_stack() {
    let count = 200_000;
    let mut nodes: Vec<Value> = (1..count).map(|child| json!({"children": [child]})).collect();
    nodes.push(json!({"mesh": 0}));
    let scene = load_json(&with("/nodes", json!(nodes))).expect("a legal tree");
    assert_eq!(scene.objects.len(), 1);
}

#[test]
fn external_buffers_are_read_from_the_folder_only() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("writable");
    std::fs::create_dir(folder.path().join("in")).expect("writable");
    write("secret.bin", &[0; 42]);
    write("in/a b.bin", &[0; 42]);
    write("in/short.bin", &[0; 41]);
    let load_with = |uri: &str| {
        write("in/scene.gltf", with("/buffers/0/uri", json!(uri)).to_string().as_bytes());
        load(folder.path().join("in/scene.gltf"))
    };
    let (scene, _) = load_with("a%20b.bin").expect("beside the document");
    assert_eq!(scene.name, "scene");
    assert_eq!(scene.meshes[0].positions, [[0.0; 3]; 3]);
    for (uri, expected) in [
        ("../secret.bin", "stay in the document's folder"),
        ("%2e%2e/secret.bin", "stay in the document's folder"),
        ("/etc/hostname", "stay in the document's folder"),
        ("file:///etc/hostname", "stay in the document's folder"),
        ("https://example.org/a.bin", "stay in the document's folder"),
        ("missing.bin", "missing.bin"),
        (".", "byteLength says 42"),
        ("short.bin", "41 bytes"),
    ] {
        let message = load_with(uri).expect_err(uri).to_string();
        assert!(message.contains(expected), "{uri}: {message}");
    }
}

fn valid_glb() -> Vec<u8> {
    to_glb(&bundled("diamond").expect("bundled")).expect("valid")
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever happens to the bytes: a scene that is valid, or an error.
    #[test]
    fn spoilt_files_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), any::<bool>()), 1..8),
        length in prop::option::weighted(0.2, any::<prop::sample::Index>()),
    ) {
        let mut glb = valid_glb();
        // The JSON is what a loader stumbles over: most changes go there.
        let json_end = 20 + u32::from_le_bytes(glb[12..16].try_into().expect("4 bytes")) as usize;
        for (place, byte, anywhere) in changes {
            let place = place.index(if anywhere { glb.len() } else { json_end });
            glb[place] = byte;
        }
        if let Some(length) = length {
            glb.truncate(length.index(glb.len()));
        }
        if let Ok((scene, _)) = load_bytes(&glb, "spoilt") {
            prop_assert!(scene.validate().is_ok());
        }
    }

    /// As above with the syntax of the JSON intact: any one number in it replaced.
    #[test]
    fn spoilt_numbers_never_panic(which in any::<prop::sample::Index>(), value in prop_oneof![
        Just("0".to_owned()), Just("-1".into()), Just("4294967296".into()), Just("18446744073709551615".into()),
        Just("1e308".into()), Just("-1e308".into()), Just("1e-320".into()), Just("null".into()), Just("[]".into()),
        any::<u32>().prop_map(|n| n.to_string()), (0_u32..9).prop_map(|n| n.to_string()), any::<f32>().prop_map(|x| format!("{x:?}")),
    ]) {
        let glb = valid_glb();
        let json_end = 20 + u32::from_le_bytes(glb[12..16].try_into().expect("4 bytes")) as usize;
        let text = std::str::from_utf8(&glb[20..json_end]).expect("JSON is UTF-8");
        let numbers = numbers(text);
        let (from, to) = numbers[which.index(numbers.len())];
        let mut json = [&text[..from], &value, &text[to..]].concat();
        json.extend(std::iter::repeat_n(' ', json.len().next_multiple_of(4) - json.len()));
        let mut spoilt = [b"glTF".as_slice(), &2_u32.to_le_bytes()].concat();
        spoilt.extend((20 + json.len() as u32 + (glb.len() - json_end) as u32).to_le_bytes());
        spoilt.extend((json.len() as u32).to_le_bytes());
        spoilt.extend(b"JSON");
        spoilt.extend(json.as_bytes());
        spoilt.extend(&glb[json_end..]);
        if let Ok((scene, _)) = load_bytes(&spoilt, "spoilt") {
            prop_assert!(scene.validate().is_ok());
        }
    }
}

/// Byte ranges of the numbers outside strings.
fn numbers(text: &str) -> Vec<(usize, usize)> {
    let (mut found, mut in_string, mut start) = (Vec::new(), false, None);
    for (i, c) in text.char_indices() {
        in_string ^= c == '"';
        let part_of_number = !in_string
            && (c.is_ascii_digit()
                || matches!(c, '-' | '+' | '.' | 'e' | 'E') && (start.is_some() || c == '-'));
        match (part_of_number, start) {
            (true, None) => start = Some(i),
            (false, Some(from)) => {
                found.push((from, i));
                start = None;
            }
            _ => {}
        }
    }
    found
}
