//! Meshes whose indices have 8, 16 or 32 bits.

use asm_core::{BakePlan, Method, Settings};
use serde_json::{Value, json};
use spectral_scene::{Mesh, Scene, bundled, load_bytes, to_glb};

use crate::stage::*;

/// A glTF file whose indices, of 32 bits as we write them, have so many bytes instead.
fn with_indices(glb: &[u8], component_type: u32, bytes: usize) -> Vec<u8> {
    let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    let end = 20 + word(12);
    let mut document: Value = serde_json::from_slice(&glb[20..end]).unwrap();
    let mut binary = glb[end + 8..end + 8 + word(end)].to_vec();
    let meshes = document["meshes"].as_array().unwrap().clone();
    let primitives = meshes.iter().flat_map(|mesh| mesh["primitives"].as_array().unwrap());
    for accessor in primitives.map(|primitive| primitive["indices"].as_u64().unwrap() as usize) {
        let accessor = &mut document["accessors"][accessor];
        assert_eq!(accessor["componentType"], json!(5125));
        accessor["componentType"] = json!(component_type);
        let count = accessor["count"].as_u64().unwrap() as usize;
        let view = accessor["bufferView"].as_u64().unwrap() as usize;
        let view = &mut document["bufferViews"][view];
        let from = view["byteOffset"].as_u64().unwrap_or(0) as usize;
        view["byteOffset"] = json!(binary.len());
        view["byteLength"] = json!(count * bytes);
        for index in 0..count {
            let at = from + 4 * index;
            assert!(binary[at + bytes..at + 4].iter().all(|&b| b == 0), "the index fits");
            binary.extend_from_within(at..at + bytes);
        }
        binary.resize(binary.len().next_multiple_of(4), 0);
    }
    document["buffers"][0]["byteLength"] = json!(binary.len());
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let chunk =
        |kind: &[u8; 4], bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes(), kind.as_slice(), bytes].concat();
    let chunks = [chunk(b"JSON", &text), chunk(b"BIN\0", &binary)].concat();
    [b"glTF".as_slice(), &2_u32.to_le_bytes(), &(12 + chunks.len() as u32).to_le_bytes(), &chunks].concat()
}

/// So many vertices that no triangle has come first.
fn behind_unused_vertices(mesh: &mut Mesh, unused: usize) {
    fn before<T: Copy>(values: &mut Vec<T>, unused: usize) {
        if let Some(&first) = values.first() {
            values.splice(0..0, std::iter::repeat_n(first, unused));
        }
    }
    before(&mut mesh.positions, unused);
    before(&mut mesh.normals, unused);
    before(&mut mesh.uvs, unused);
    mesh.triangles.iter_mut().flatten().for_each(|index| *index += unused as u32);
}

fn bake_of(glb: &[u8]) -> BakePlan {
    let (scene, _): (Scene, _) = load_bytes(glb, "indices").unwrap();
    plan(
        &scene,
        32,
        &Settings { emission_size: 128, wavelengths: Some(3), ..Settings::of(Method::CausticsMap) },
    )
}

/// Executors get the same plan, so they make the same map of it.
#[test]
fn indices_of_8_16_and_32_bits_give_the_same_plan_and_map() {
    let mut scene = bundled("gem").unwrap();
    let glb = to_glb(&scene).unwrap();
    let wanted = bake_of(&glb);
    for (component_type, bytes) in [(5121, 1), (5123, 2), (5125, 4)] {
        assert!(bake_of(&with_indices(&glb, component_type, bytes)) == wanted, "{bytes} bytes");
    }
    // Indices that 16 bits do not hold.
    scene.meshes.iter_mut().for_each(|mesh| behind_unused_vertices(mesh, 70_000));
    assert!(scene.meshes.iter().all(|mesh| mesh.triangles.iter().flatten().all(|&i| i > 65_535)));
    let behind = bake_of(&to_glb(&scene).unwrap());
    assert!(behind == wanted);
    let (maps, _) = run(&behind);
    assert!(total(&maps.refracted)[1] > 0.0);
    // Negative control: another corner is another plan.
    scene.meshes[0].triangles[0] = [70_000; 3];
    assert!(bake_of(&to_glb(&scene).unwrap()) != wanted);
}
