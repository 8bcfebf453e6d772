//! Passes against their WGSL; each rule with a pass that breaks it.
#![allow(clippy::unwrap_used, reason = "tests")]

mod passes;

use frame_plan::reflect::{check_layout, check_pass};
use frame_plan::{Binding, BindingKind, PassInfo, PassKind, TextureFormat, layout};
use passes::{FILL_UINT, HISTOGRAM, Halve, PASSES, SCALE, SHADED, SampleLayers, Scale, VISIBILITY};

#[test]
fn passes_match_their_wgsl() {
    for pass in PASSES.0 {
        check_pass(pass).unwrap();
    }
}

#[test]
fn layouts_match_their_wgsl() {
    check_layout(&SCALE, &layout!(Scale as "Scale" { factor, offset, count })).unwrap();
    check_layout(&passes::HALVE, &layout!(Halve as "Halve" { scale })).unwrap();
    check_layout(&passes::SAMPLE_LAYERS, &layout!(SampleLayers as "SampleLayers" { layer, level })).unwrap();
}

#[track_caller]
fn refused(pass: &PassInfo, words: &str) {
    let error = check_pass(pass).unwrap_err().to_string();
    assert!(error.contains(words), "{error}");
}

#[test]
fn wrong_layouts_are_refused() {
    #[track_caller]
    fn refused(layout: &frame_plan::reflect::HostLayout, words: &str) {
        let error = check_layout(&SCALE, layout).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let mut swapped = layout!(Scale as "Scale" { factor, offset, count });
    swapped.fields[0].1 = 4;
    refused(&swapped, "Scale.factor is at 0 in WGSL, at 4 on the host");
    refused(&layout!(Scale as "Scale" { factor, offset }), "Scale.count is not among the host's fields");
    refused(
        &layout!(Scale as "Scale" { factor, offset, count, padding }),
        "Scale.padding is not in the WGSL",
    );
    refused(&layout!(Scale as "Scales" { factor }), "no struct Scales");
    let mut large = layout!(Scale as "Scale" { factor, offset, count });
    large.size = 32;
    refused(&large, "16 bytes in WGSL, 32 on the host");
}

#[test]
fn wrong_bindings_are_refused() {
    const READ: Binding = Binding { name: "values", kind: BindingKind::Read };
    refused(&PassInfo { bindings: &[READ], ..HISTOGRAM }, "not in the pass");
    let bins = Binding { name: "bins", kind: BindingKind::Write };
    refused(&PassInfo { bindings: Vec::leak(vec![READ, bins]), ..HISTOGRAM }, "the pass says Write");
    let misnamed = Binding { name: "bin", kind: BindingKind::Atomic };
    refused(&PassInfo { bindings: Vec::leak(vec![READ, misnamed]), ..HISTOGRAM }, "in the pass \"bin\"");
    const FLOAT: Binding =
        Binding { name: "image", kind: BindingKind::StorageTexture { format: TextureFormat::R32Float } };
    refused(&PassInfo { bindings: &[FLOAT], ..FILL_UINT }, "the pass says StorageTexture");
}

#[test]
fn wrong_entry_points_are_refused() {
    let PassKind::Compute { mirror, .. } = SCALE.kind else { unreachable!() };
    let kind = || PassKind::Compute { workgroup: [32, 1, 1], mirror };
    refused(&PassInfo { kind: kind(), ..SCALE }, "workgroup size [64, 1, 1], the pass says [32, 1, 1]");
    refused(&PassInfo { name: "scales", ..SCALE }, "no Compute entry point is named scales");
    refused(&PassInfo { params_bytes: 32, ..SCALE }, "Scale has 16 bytes, the pass says 32");
    refused(&PassInfo { params_struct: "Params", ..SCALE }, "the pass says uniform Params");
    refused(&PassInfo { kind: SHADED.kind, ..VISIBILITY }, "target Rgba32Float needs Float");
    refused(&PassInfo { wgsl: &["fn broken( {"], ..SCALE }, "expected");
}
