//! SPIR-V of the test passes.

#![allow(clippy::unwrap_used, reason = "tests")]

mod passes;

use frame_plan::spirv::{compile, write_modules};
use frame_plan::{PassInfo, PassSet};
use passes::*;

const MAGIC: [u8; 4] = 0x0723_0203_u32.to_le_bytes();
/// Version 1.6 in the second word.
const VERSION: [u8; 4] = [0, 6, 1, 0];

#[test]
fn every_entry_point_becomes_a_module() {
    let compiled = compile(PASSES).unwrap();
    let wanted: Vec<_> = PASSES.0.iter().flat_map(|p| p.entry_points()).collect();
    assert_eq!(wanted.len(), PASSES.0.len() + 3, "three passes draw");
    for entry_point in &wanted {
        let module = compiled.module(entry_point).unwrap();
        for bytes in [&module.unchecked, &module.restricted] {
            assert_eq!((&bytes[..4], &bytes[4..8]), (&MAGIC[..], &VERSION[..]), "{entry_point}");
            assert_eq!(bytes.len() % 4, 0);
        }
    }
    assert_eq!(compiled.modules.len(), wanted.len());
    let scale = compiled.module("scale").unwrap();
    assert!(scale.restricted.len() > scale.unchecked.len(), "clamping takes instructions");
    assert!(compiled.module("nothing").is_none());
}

#[test]
fn what_does_not_compile_is_an_error_that_names_the_pass() {
    for (wgsl, says) in BROKEN_SCALES {
        let passes = PassSet(vec![&*Box::leak(Box::new(PassInfo { wgsl, ..SCALE }))].leak());
        let error = compile(passes).err().unwrap();
        assert_eq!(error.pass, "scale");
        assert!(error.problem.contains(says), "{error}");
    }
}

#[test]
fn modules_are_written_with_an_index() {
    let folder = std::env::temp_dir().join(format!("frame-plan-spirv-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let compiled = compile(PassSet(&[&VISIBILITY])).unwrap();
    write_modules(&compiled.modules, &folder, "test").unwrap();
    let index = std::fs::read_to_string(folder.join("test.rs")).unwrap();
    for module in &*compiled.modules {
        let file = format!("test_{}_unchecked.spv", module.entry_point);
        assert!(index.contains(&file), "{index}");
        assert_eq!(std::fs::read(folder.join(file)).unwrap(), *module.unchecked);
    }
    std::fs::remove_dir_all(folder).unwrap();
}
