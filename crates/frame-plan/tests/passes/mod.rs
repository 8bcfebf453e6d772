//! Small passes that exercise every step and binding kind; shared with the executors' own tests.
#![allow(dead_code, unreachable_pub, reason = "every test binary includes this module and uses some of it")]

mod compute;
mod draw;

pub use compute::*;
pub use draw::*;

use frame_plan::{
    Bound, Lifetime, Load, ParamsId, PassSet, PassStep, Plan, Resource, ResourceId, Step, Subresource,
    Target, Targets, TextureFormat,
};

pub const PASSES: PassSet = PassSet(&[
    &SCALE,
    &HISTOGRAM,
    &PLAN_GROUPS,
    &INCREMENT,
    &HALVE,
    &COPY_DEPTH,
    &SAMPLE_LAYERS,
    &FILL_UINT,
    &READ_UINT,
    &VISIBILITY,
    &SHADED,
    &GLOW,
]);

/// A pass step without params or label.
pub fn pass(name: &str, params: Option<ParamsId>, bindings: &[Bound]) -> PassStep {
    PassStep { pass: name.into(), label: String::new(), params, bindings: bindings.to_vec() }
}

pub fn dispatch(name: &str, params: Option<ParamsId>, bindings: &[Bound], groups: u32) -> Step {
    Step::Dispatch { pass: pass(name, params, bindings), groups: [groups, 1, 1] }
}

pub fn mip(resource: ResourceId, base_mip: u32) -> Bound {
    Bound { resource, part: Some(Subresource { base_mip, ..Subresource::FIRST }) }
}

pub fn target(texture: ResourceId, load: Load) -> Target {
    Target { texture, mip: 0, layer: 0, load }
}

pub fn buffer(plan: &mut Plan, name: &str, bytes: u64) -> ResourceId {
    plan.add_resource(Resource::buffer(name, bytes).readable())
}

pub fn texture(plan: &mut Plan, name: &str, format: TextureFormat, size: [u32; 2]) -> ResourceId {
    plan.add_resource(Resource::texture(name, format, size).readable())
}

/// A plan that multiplies 1000 numbers by 3 and adds 7.
pub fn scale_plan() -> Plan {
    let mut plan = Plan { name: "scale".into(), ..Plan::default() };
    let numbers: Vec<u32> = (0..1000).collect();
    let input = plan.add_resource(Resource::buffer_with("input", &numbers));
    let output = buffer(&mut plan, "output", 4000);
    let params = plan.add_params("scale", &Scale { factor: 3, offset: 7, count: 1000, padding: 0 });
    plan.steps.push(dispatch("scale", Some(params), &[input.into(), output.into()], 16));
    plan
}

/// A histogram of 5000 numbers in 7 bins; `plan_groups` then asks for as many groups as bin 0 has entries, over 64, and
/// `increment` adds 1 to so many words of a persistent buffer.
pub fn indirect_plan() -> Plan {
    let mut plan = Plan { name: "indirect".into(), ..Plan::default() };
    let numbers: Vec<u32> = (0..5000_u32).map(|i| i.wrapping_mul(2_654_435_761) >> 7).collect();
    let values = plan.add_resource(Resource::buffer_with("values", &numbers));
    let bins = buffer(&mut plan, "bins", 28);
    let arguments = buffer(&mut plan, "arguments", 16);
    let state =
        plan.add_resource(Resource::buffer("state", 4096 * 4).readable().with_lifetime(Lifetime::Persistent));
    plan.steps = vec![
        Step::ClearBuffer { buffer: bins },
        dispatch("histogram", None, &[values.into(), bins.into()], 79),
        dispatch("plan_groups", None, &[bins.into(), arguments.into()], 1),
        Step::DispatchIndirect { pass: pass("increment", None, &[state.into()]), arguments, offset_bytes: 4 },
    ];
    plan
}

/// A 16 x 16 texture in five levels, each the mean of the one above, by a repeat; the last three are copied out.
pub fn mips_plan() -> Plan {
    let mut plan = Plan { name: "mips".into(), ..Plan::default() };
    let mut contents: Vec<f32> = (0..256).map(|i| (i * i % 61) as f32).collect();
    contents.resize(256 + 64 + 16 + 4 + 1, -1.0);
    let mut pyramid = Resource::texture("pyramid", TextureFormat::R32Float, [16, 16]);
    pyramid.kind = frame_plan::ResourceKind::Texture {
        format: TextureFormat::R32Float,
        size: [16, 16],
        layers: 1,
        mips: 5,
    };
    pyramid.initial = Some(bytemuck::cast_slice(&contents).to_vec());
    let pyramid = plan.add_resource(pyramid.readable());
    let scales: Vec<_> =
        (0..4).map(|i| Halve { scale: 0.25 * f32::from(1_u8 << i), padding: [0.0; 3] }).collect();
    let params = plan.add_params_per_iteration("halve", &scales);
    let iterations = (0..4)
        .map(|i| vec![dispatch("halve", Some(params), &[mip(pyramid, i), mip(pyramid, i + 1)], 1)])
        .collect();
    plan.steps.push(Step::Repeat { label: "pyramid".into(), iterations });
    for (level, size) in [(1, 8), (2, 4), (4, 1)] {
        let copy = texture(&mut plan, &format!("level {level}"), TextureFormat::R32Float, [size, size]);
        plan.steps.push(Step::CopyTexture {
            source: pyramid,
            source_part: Subresource { base_mip: level, ..Subresource::FIRST },
            target: copy,
            target_part: Subresource::FIRST,
        });
    }
    plan
}

/// Draw `triangles` (clip space) twice, the second instance nearer and shifted, into an integer target with depth.
pub fn visibility_plan(size: [u32; 2], corners: &[[f32; 4]], instances: u32) -> Plan {
    let mut plan = Plan { name: "visibility".into(), ..Plan::default() };
    let positions = plan.add_resource(Resource::buffer_with("positions", corners));
    let ids = texture(&mut plan, "ids", TextureFormat::R32Uint, size);
    let depth = plan.add_resource(Resource::texture("depth", TextureFormat::Depth32Float, size).readable());
    let depths = buffer(&mut plan, "depths", u64::from(size[0] * size[1]) * 4);
    plan.steps = vec![
        Step::Draw {
            pass: pass("visibility", None, &[positions.into()]),
            targets: Targets {
                color: vec![target(ids, Load::Clear([0.0; 4]))],
                depth: Some(target(depth, Load::Clear([1.0; 4]))),
            },
            vertices: corners.len() as u32,
            instances,
        },
        Step::Dispatch {
            pass: pass("copy_depth", None, &[depth.into(), depths.into()]),
            groups: [size[0].div_ceil(8), size[1].div_ceil(8), 1],
        },
    ];
    plan
}

/// Draw triangles with `pass_name`, `shaded` or `glow`, into one float target.
pub fn color_plan(pass_name: &str, format: TextureFormat, size: [u32; 2], corners: &[[f32; 4]]) -> Plan {
    let mut plan = Plan { name: pass_name.into(), ..Plan::default() };
    let positions = plan.add_resource(Resource::buffer_with("positions", corners));
    let picture = texture(&mut plan, "picture", format, size);
    plan.steps.push(Step::Draw {
        pass: pass(pass_name, None, &[positions.into()]),
        targets: Targets { color: vec![target(picture, Load::Clear([0.0; 4]))], depth: None },
        vertices: corners.len() as u32,
        instances: 1,
    });
    plan
}

/// Three layers of a 4 x 4 texture with two levels, loaded and sampled.
pub fn layers_plan(layer: u32, level: u32) -> Plan {
    let mut plan = Plan { name: "layers".into(), ..Plan::default() };
    let contents: Vec<u16> =
        (0..3 * 20 * 4_u16).map(|i| half::f16::from_f32(f32::from(i) * 0.5).to_bits()).collect();
    let mut layers = Resource::texture("layers", TextureFormat::Rgba16Float, [4, 4]);
    layers.kind = frame_plan::ResourceKind::Texture {
        format: TextureFormat::Rgba16Float,
        size: [4, 4],
        layers: 3,
        mips: 2,
    };
    layers.initial = Some(bytemuck::cast_slice(&contents).to_vec());
    let layers = plan.add_resource(layers);
    let sampler = plan.add_resource(Resource {
        name: "bilinear".into(),
        kind: frame_plan::ResourceKind::Sampler { linear: true, repeat: false },
        lifetime: Lifetime::Persistent,
        initial: None,
        readable: false,
    });
    let output = buffer(&mut plan, "output", 32 * 16);
    let params = plan.add_params("sample", &SampleLayers { layer, level, padding: [0; 2] });
    plan.steps.push(dispatch(
        "sample_layers",
        Some(params),
        &[layers.into(), sampler.into(), output.into()],
        1,
    ));
    plan
}

/// Fill an unsigned texture and read it back through a buffer and a buffer copy.
pub fn uint_plan() -> Plan {
    let mut plan = Plan { name: "uint".into(), ..Plan::default() };
    let image = texture(&mut plan, "image", TextureFormat::R32Uint, [19, 5]);
    let words = buffer(&mut plan, "words", 19 * 5 * 4);
    let copy = buffer(&mut plan, "copy", 400);
    plan.steps = vec![
        Step::Dispatch { pass: pass("fill_uint", None, &[image.into()]), groups: [3, 1, 1] },
        Step::Dispatch { pass: pass("read_uint", None, &[image.into(), words.into()]), groups: [3, 1, 1] },
        Step::CopyBuffer {
            source: words,
            source_offset_bytes: 76,
            target: copy,
            target_offset_bytes: 8,
            size_bytes: 152,
        },
    ];
    plan
}

/// A corner of a triangle in clip space.
pub fn corner(x: f32, y: f32, z: f32) -> [f32; 4] {
    [x, y, z, 1.0]
}

/// Counter-clockwise triangles of a bumpy fan around the picture's middle, in front of a square; some leave the picture.
pub fn fan() -> Vec<[f32; 4]> {
    let rim = |i: usize| {
        let angle = i as f32 * 0.61;
        let radius = 0.5 + 0.9 * ((i * 7 % 5) as f32 / 5.0);
        let w = 1.0 + 0.5 * ((i % 3) as f32);
        [radius * angle.cos() * w, radius * angle.sin() * w, (0.2 + 0.05 * (i % 4) as f32) * w, w]
    };
    let mut corners = vec![
        corner(-1.0, -1.0, 0.9),
        corner(1.0, -1.0, 0.9),
        corner(1.0, 1.0, 0.9),
        corner(-1.0, -1.0, 0.9),
        corner(1.0, 1.0, 0.9),
        corner(-1.0, 1.0, 0.9),
    ];
    for i in 0..9 {
        corners.extend([corner(0.05, -0.03, 0.3), rim(i), rim(i + 1)]);
    }
    corners
}
