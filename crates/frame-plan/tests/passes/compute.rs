//! Compute passes.

use std::sync::atomic::Ordering;

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::MirrorArgs;
use frame_plan::{Binding, BindingKind, PassInfo, PassKind, TextureFormat};

const fn bind(name: &'static str, kind: BindingKind) -> Binding {
    Binding { name, kind }
}

const FLOAT: BindingKind = BindingKind::Texture { uint: false, filter: false, array: false };

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub struct Scale {
    pub factor: u32,
    pub offset: u32,
    pub count: u32,
    pub padding: u32,
}

pub const SCALE: PassInfo = PassInfo {
    name: "scale",
    wgsl: &[
        "struct Scale { factor: u32, offset: u32, count: u32 }
        @group(0) @binding(0) var<uniform> params: Scale;
        @group(0) @binding(1) var<storage, read> input: array<u32>;
        @group(0) @binding(2) var<storage, read_write> output: array<u32>;",
        "@compute @workgroup_size(64) fn scale(@builtin(global_invocation_id) id: vec3<u32>) {
            if id.x < params.count { output[id.x] = input[id.x] * params.factor + params.offset; }
        }",
    ],
    params_struct: "Scale",
    params_bytes: 16,
    bindings: &[bind("input", BindingKind::Read), bind("output", BindingKind::Write)],
    kind: PassKind::Compute { workgroup: [64, 1, 1], mirror: scale },
};

/// Shaders that are no shader of [`SCALE`], and what is said about them.
pub const BROKEN_SCALES: [(&[&str], &str); 3] = [
    (&["fn broken( {"], "expected"),
    (&["struct Scale { factor: u32 } @compute @workgroup_size(1) fn other() {}"], "entry point"),
    (
        &["@group(0) @binding(7) var<storage, read_write> extra: array<u32>;
        @compute @workgroup_size(64) fn scale() { extra[0] = 1u; }"],
        "binding",
    ),
];

fn scale(args: &MirrorArgs<'_>) {
    let params: Scale = args.params();
    let count = params.count.min(args.groups()[0] * 64) as usize;
    let (input, output) = (args.read::<u32>("input"), args.write::<u32>("output"));
    for (out, value) in output[..count].iter_mut().zip(input) {
        *out = value.wrapping_mul(params.factor).wrapping_add(params.offset);
    }
}

pub const HISTOGRAM: PassInfo = PassInfo {
    name: "histogram",
    wgsl: &["@group(0) @binding(0) var<storage, read> values: array<u32>;
        @group(0) @binding(1) var<storage, read_write> bins: array<atomic<u32>>;
        @compute @workgroup_size(64) fn histogram(@builtin(global_invocation_id) id: vec3<u32>) {
            if id.x < arrayLength(&values) { atomicAdd(&bins[values[id.x] % arrayLength(&bins)], 1u); }
        }"],
    params_struct: "",
    params_bytes: 0,
    bindings: &[bind("values", BindingKind::Read), bind("bins", BindingKind::Atomic)],
    kind: PassKind::Compute { workgroup: [64, 1, 1], mirror: histogram },
};

fn histogram(args: &MirrorArgs<'_>) {
    use rayon::prelude::*;
    let bins = args.atomics("bins");
    args.read::<u32>("values").par_iter().for_each(|value| {
        bins[*value as usize % bins.len()].fetch_add(1, Ordering::Relaxed);
    });
}

pub const PLAN_GROUPS: PassInfo = PassInfo {
    name: "plan_groups",
    wgsl: &["@group(0) @binding(0) var<storage, read> bins: array<u32>;
        @group(0) @binding(1) var<storage, read_write> arguments: array<u32>;
        @compute @workgroup_size(1) fn plan_groups() {
            arguments[0] = 999u;
            arguments[1] = (bins[0] + 63u) / 64u;
            arguments[2] = 1u;
            arguments[3] = 1u;
        }"],
    params_struct: "",
    params_bytes: 0,
    bindings: &[bind("bins", BindingKind::ReadAtomic), bind("arguments", BindingKind::Write)],
    kind: PassKind::Compute { workgroup: [1, 1, 1], mirror: plan_groups },
};

fn plan_groups(args: &MirrorArgs<'_>) {
    let count = args.atomics("bins")[0].load(Ordering::Relaxed);
    args.write("arguments").copy_from_slice(&[999, count.div_ceil(64), 1, 1]);
}

pub const INCREMENT: PassInfo = PassInfo {
    name: "increment",
    wgsl: &["@group(0) @binding(0) var<storage, read_write> state: array<u32>;
        @compute @workgroup_size(64) fn increment(@builtin(global_invocation_id) id: vec3<u32>) {
            if id.x < arrayLength(&state) { state[id.x] += 1u; }
        }"],
    params_struct: "",
    params_bytes: 0,
    bindings: &[bind("state", BindingKind::Write)],
    kind: PassKind::Compute { workgroup: [64, 1, 1], mirror: increment },
};

fn increment(args: &MirrorArgs<'_>) {
    let count = args.groups()[0] as usize * 64;
    args.write::<u32>("state").iter_mut().take(count).for_each(|word| *word += 1);
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub struct Halve {
    pub scale: f32,
    pub padding: [f32; 3],
}

pub const HALVE: PassInfo = PassInfo {
    name: "halve",
    wgsl: &["struct Halve { scale: f32 }
        @group(0) @binding(0) var<uniform> params: Halve;
        @group(0) @binding(1) var fine: texture_2d<f32>;
        @group(0) @binding(2) var coarse: texture_storage_2d<r32float, write>;
        @compute @workgroup_size(8, 8) fn halve(@builtin(global_invocation_id) id: vec3<u32>) {
            if any(id.xy >= textureDimensions(coarse)) { return; }
            var sum = 0.0;
            for (var i = 0u; i < 4u; i++) {
                sum += textureLoad(fine, id.xy * 2u + vec2(i % 2u, i / 2u), 0).x;
            }
            textureStore(coarse, id.xy, vec4(sum * params.scale));
        }"],
    params_struct: "Halve",
    params_bytes: 16,
    bindings: &[
        bind("fine", FLOAT),
        bind("coarse", BindingKind::StorageTexture { format: TextureFormat::R32Float }),
    ],
    kind: PassKind::Compute { workgroup: [8, 8, 1], mirror: halve },
};

fn halve(args: &MirrorArgs<'_>) {
    let scale = args.params::<Halve>().scale;
    let fine = args.texture("fine");
    args.storage_texture("coarse").par_store(|x, y| {
        let sum: f32 = (0..4).map(|i| fine.load(x * 2 + i % 2, y * 2 + i / 2)[0]).sum();
        [sum * scale; 4]
    });
}

pub const COPY_DEPTH: PassInfo = PassInfo {
    name: "copy_depth",
    wgsl: &["@group(0) @binding(0) var depth: texture_depth_2d;
        @group(0) @binding(1) var<storage, read_write> depths: array<f32>;
        @compute @workgroup_size(8, 8) fn copy_depth(@builtin(global_invocation_id) id: vec3<u32>) {
            let size = textureDimensions(depth);
            if all(id.xy < size) { depths[id.y * size.x + id.x] = textureLoad(depth, id.xy, 0); }
        }"],
    params_struct: "",
    params_bytes: 0,
    bindings: &[bind("depth", BindingKind::DepthTexture), bind("depths", BindingKind::Write)],
    kind: PassKind::Compute { workgroup: [8, 8, 1], mirror: copy_depth },
};

fn copy_depth(args: &MirrorArgs<'_>) {
    let depth = args.texture("depth");
    let width = depth.size()[0];
    for (i, out) in (0..).zip(args.write::<f32>("depths").iter_mut()) {
        *out = depth.load(i % width, i / width)[0];
    }
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub struct SampleLayers {
    pub layer: u32,
    pub level: u32,
    pub padding: [u32; 2],
}

pub const SAMPLE_LAYERS: PassInfo = PassInfo {
    name: "sample_layers",
    wgsl: &["struct SampleLayers { layer: u32, level: u32 }
        @group(0) @binding(0) var<uniform> params: SampleLayers;
        @group(0) @binding(1) var layers: texture_2d_array<f32>;
        @group(0) @binding(2) var bilinear: sampler;
        @group(0) @binding(3) var<storage, read_write> output: array<vec4<f32>>;
        @compute @workgroup_size(4, 4) fn sample_layers(@builtin(global_invocation_id) id: vec3<u32>) {
            let i = id.y * 4u + id.x;
            let inside = all(id.xy < textureDimensions(layers, params.level));
            output[i] = select(vec4(0.0), textureLoad(layers, id.xy, params.layer, params.level), inside);
            output[16u + i] = textureSampleLevel(layers, bilinear, vec2<f32>(id.xy) * 0.375 - 0.125, 0, 0.0);
        }"],
    params_struct: "SampleLayers",
    params_bytes: 16,
    bindings: &[
        bind("layers", BindingKind::Texture { uint: false, filter: true, array: true }),
        bind("bilinear", BindingKind::Sampler { filter: true }),
        bind("output", BindingKind::Write),
    ],
    kind: PassKind::Compute { workgroup: [4, 4, 1], mirror: sample_layers },
};

fn sample_layers(args: &MirrorArgs<'_>) {
    let params: SampleLayers = args.params();
    let layers = args.texture("layers");
    let output = args.write::<[f32; 4]>("output");
    for i in 0..16 {
        let (x, y) = (i % 4, i / 4);
        output[i as usize] = layers.load_at(x, y, params.layer, params.level);
        output[16 + i as usize] = layers.sample_linear(x as f32 * 0.375 - 0.125, y as f32 * 0.375 - 0.125);
    }
}

pub const FILL_UINT: PassInfo = PassInfo {
    name: "fill_uint",
    wgsl: &["@group(0) @binding(0) var image: texture_storage_2d<r32uint, write>;
        @compute @workgroup_size(8, 8) fn fill_uint(@builtin(global_invocation_id) id: vec3<u32>) {
            textureStore(image, id.xy, vec4((id.y * 19u + id.x) * 2654435761u));
        }"],
    params_struct: "",
    params_bytes: 0,
    bindings: &[bind("image", BindingKind::StorageTexture { format: TextureFormat::R32Uint })],
    kind: PassKind::Compute { workgroup: [8, 8, 1], mirror: fill_uint },
};

fn fill_uint(args: &MirrorArgs<'_>) {
    let mut image = args.storage_texture("image");
    for y in 0..8 {
        for x in 0..24_u32 {
            image.store_uint(x, y, (y * 19 + x).wrapping_mul(2_654_435_761));
        }
    }
}

pub const READ_UINT: PassInfo = PassInfo {
    name: "read_uint",
    wgsl: &["@group(0) @binding(0) var image: texture_2d<u32>;
        @group(0) @binding(1) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(8, 8) fn read_uint(@builtin(global_invocation_id) id: vec3<u32>) {
            let size = textureDimensions(image);
            if all(id.xy < size) { words[id.y * size.x + id.x] = textureLoad(image, id.xy, 0).x; }
        }"],
    params_struct: "",
    params_bytes: 0,
    bindings: &[
        bind("image", BindingKind::Texture { uint: true, filter: false, array: false }),
        bind("words", BindingKind::Write),
    ],
    kind: PassKind::Compute { workgroup: [8, 8, 1], mirror: read_uint },
};

fn read_uint(args: &MirrorArgs<'_>) {
    let image = args.texture("image");
    let width = image.size()[0];
    for (i, word) in (0..).zip(args.write::<u32>("words").iter_mut()) {
        *word = image.load_uint(i % width, i / width);
    }
}
