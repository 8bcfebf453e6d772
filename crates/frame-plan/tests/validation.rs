//! Plans that must be refused, each next to the plan that is not.
#![allow(clippy::unwrap_used, reason = "tests")]

mod passes;

use frame_plan::{
    Bound, ExecuteError, Lifetime, Limits, Load, ParamsId, Plan, Resource, ResourceId, ResourceKind, Step,
    Subresource, TextureFormat,
};
use passes::*;

/// Check that `plan` is accepted, and after `change` refused with `words` in the message.
#[track_caller]
fn refused(mut plan: Plan, change: impl FnOnce(&mut Plan), words: &str) {
    plan.validate(&PASSES, &Limits::default()).unwrap();
    change(&mut plan);
    match plan.validate(&PASSES, &Limits::default()).unwrap_err() {
        ExecuteError::InvalidPlan { plan: name, problem } => {
            assert_eq!(name, plan.name);
            assert!(problem.contains(words), "{problem}");
        }
        other => panic!("{other}"),
    }
}

fn visibility() -> Plan {
    visibility_plan([8, 8], &fan(), 1)
}

/// The pass of a step.
fn pass_of(plan: &mut Plan, step: usize) -> &mut frame_plan::PassStep {
    match &mut plan.steps[step] {
        Step::Dispatch { pass, .. } | Step::DispatchIndirect { pass, .. } | Step::Draw { pass, .. } => pass,
        _ => unreachable!(),
    }
}

fn targets_of(plan: &mut Plan) -> &mut frame_plan::Targets {
    let Step::Draw { targets, .. } = &mut plan.steps[0] else { unreachable!() };
    targets
}

#[test]
fn names() {
    refused(
        scale_plan(),
        |p| p.resources[1].name = "input".into(),
        "two resource entries are named \"input\"",
    );
    refused(scale_plan(), |p| p.resources[1].name = String::new(), "a resource has no name");
    refused(scale_plan(), |p| p.params.push(p.params[0].clone()), "two params entries are named \"scale\"");
    refused(scale_plan(), |p| pass_of(p, 0).pass = "scales".into(), "no pass is named \"scales\"");
}

#[test]
fn sizes() {
    let size = |bytes| move |p: &mut Plan| p.resources[1].kind = ResourceKind::Buffer { size_bytes: bytes };
    refused(scale_plan(), size(0), "\"output\" has 0 bytes");
    refused(scale_plan(), size(4002), "\"output\" has 4002 bytes, not a multiple of 4");
    refused(scale_plan(), size(1 << 40), "has 1099511627776 bytes, the limit is 268435456");
    refused(scale_plan(), size(200 << 20), "has 209715200 bytes, a binding takes 134217728");
    let shape = |size, layers, mips| {
        move |p: &mut Plan| {
            p.resources[1].kind =
                ResourceKind::Texture { format: TextureFormat::R32Uint, size, layers, mips };
        }
    };
    refused(visibility(), shape([8, 0], 1, 1), "8 x 0, allowed are 1 to 8192");
    refused(visibility(), shape([8193, 8], 1, 1), "8193 x 8, allowed are 1 to 8192");
    refused(visibility(), shape([8, 8], 257, 1), "257 layers, allowed are 1 to 256");
    refused(visibility(), shape([8, 8], 1, 5), "5 mip levels, allowed are 1 to 4");
    refused(
        scale_plan(),
        |p| {
            let kind = ResourceKind::Texture {
                format: TextureFormat::Rgba32Float,
                size: [8192; 2],
                layers: 256,
                mips: 1,
            };
            p.resources.push(Resource { kind, ..Resource::buffer("large", 4) });
        },
        "all resources together have 274877914944 bytes, the limit is 4294967296",
    );
    refused(
        scale_plan(),
        |p| p.resources[0].initial = Some(vec![0; 12]),
        "starts with 12 bytes, but has 4000",
    );
    refused(
        scale_plan(),
        |p| p.resources[0].lifetime = Lifetime::Imported,
        "is imported and cannot have contents",
    );
    refused(visibility(), |p| p.resources[2].initial = Some(vec![0; 256]), "cannot start with contents");
    refused(layers_plan(0, 0), |p| p.resources[1].readable = true, "cannot be read back");
}

#[test]
fn params() {
    refused(scale_plan(), |p| pass_of(p, 0).params = None, "needs params Scale");
    refused(
        scale_plan(),
        |p| pass_of(p, 0).params = Some(ParamsId(3)),
        "params 3 do not exist, the plan has 1",
    );
    refused(scale_plan(), |p| p.params[0].bytes.truncate(12), "12 bytes, not a multiple of the block's 16");
    refused(scale_plan(), |p| p.params[0].stride_bytes = 20, "blocks of 20 bytes");
    refused(scale_plan(), |p| p.params[0].bytes.resize(32, 0), "2 blocks for 1 iterations");
    refused(
        scale_plan(),
        |p| {
            p.params[0].stride_bytes = 32;
            p.params[0].bytes.resize(32, 0);
        },
        "have 32 bytes, Scale has 16",
    );
    refused(mips_plan(), |p| p.params[0].bytes.truncate(48), "3 blocks for 4 iterations");
    refused(
        indirect_plan(),
        |p| pass_of(p, 1).params = Some(ParamsId(0)),
        "pass \"histogram\" has no params",
    );
}

#[test]
fn bindings() {
    refused(scale_plan(), |p| pass_of(p, 0).bindings.truncate(1), "1 bindings, the pass has 2");
    refused(
        scale_plan(),
        |p| pass_of(p, 0).bindings[0] = ResourceId(5).into(),
        "resource 5 does not exist, the plan has 2",
    );
    refused(
        scale_plan(),
        |p| pass_of(p, 0).bindings[0].part = Some(Subresource::FIRST),
        "a buffer has no parts",
    );
    refused(visibility(), |p| pass_of(p, 0).bindings[0] = ResourceId(1).into(), "\"ids\" is not a buffer");
    refused(
        visibility(),
        |p| pass_of(p, 1).bindings[0] = ResourceId(1).into(),
        "\"ids\" is R32Uint, not depth",
    );
    refused(uint_plan(), |p| pass_of(p, 0).bindings[0] = ResourceId(1).into(), "\"words\" is not a texture");
    let float = |p: &mut Plan| {
        p.resources.push(Resource::texture("float", TextureFormat::Rgba16Float, [19, 5]));
        Bound::from(ResourceId(3))
    };
    refused(uint_plan(), |p| pass_of(p, 0).bindings[0] = float(p), "is Rgba16Float, not R32Uint");
    refused(uint_plan(), |p| pass_of(p, 1).bindings[0] = float(p), "is Rgba16Float, not unsigned");
    refused(layers_plan(0, 0), |p| pass_of(p, 0).bindings[1] = ResourceId(0).into(), "is not a sampler");
    let part = |base_mip, mips, base_layer, layers| Some(Subresource { base_mip, mips, base_layer, layers });
    let first_layers = |part| move |p: &mut Plan| pass_of(p, 0).bindings[0].part = part;
    refused(
        layers_plan(0, 0),
        first_layers(part(1, 2, 0, 3)),
        "2 levels from level 1 of \"layers\", which has 2",
    );
    refused(layers_plan(0, 0), first_layers(part(0, 0, 0, 3)), "0 levels from level 0");
    refused(layers_plan(0, 0), first_layers(part(0, 1, u32::MAX, 2)), "2 layers from layer 4294967295");
    refused(
        mips_plan(),
        |p| {
            let Step::Repeat { iterations, .. } = &mut p.steps[0] else { unreachable!() };
            let Step::Dispatch { pass, .. } = &mut iterations[2][0] else { unreachable!() };
            pass.bindings[1].part = None;
        },
        "iteration 2, step 0, halve: binding \"coarse\": 5 levels and 1 layers of \"pyramid\" where one of each",
    );
}

#[test]
fn counts() {
    let groups = |g| {
        move |p: &mut Plan| {
            let Step::Dispatch { groups, .. } = &mut p.steps[0] else { unreachable!() };
            *groups = g;
        }
    };
    refused(scale_plan(), groups([16, 65_536, 1]), "[16, 65536, 1] workgroups, the limit is 65535");
    refused(
        visibility(),
        |p| {
            let Step::Draw { vertices, .. } = &mut p.steps[0] else { unreachable!() };
            *vertices = 4;
        },
        "4 vertices are not whole triangles",
    );
    let offset = |bytes| {
        move |p: &mut Plan| {
            let Some(Step::DispatchIndirect { offset_bytes, .. }) = p.steps.last_mut() else {
                unreachable!()
            };
            *offset_bytes = bytes;
        }
    };
    refused(indirect_plan(), offset(8), "12 bytes at 8 of \"arguments\", which has 16");
    refused(indirect_plan(), offset(2), "12 bytes at 2: both must be multiples of 4");
}

#[test]
fn kinds_of_pass() {
    refused(
        visibility(),
        |p| {
            let Step::Draw { pass, .. } = p.steps[0].clone() else { unreachable!() };
            p.steps[0] = Step::Dispatch { pass, groups: [1; 3] };
        },
        "pass \"visibility\" draws and cannot be dispatched",
    );
    refused(
        visibility(),
        |p| {
            let bindings = pass_of(p, 1).bindings.clone();
            *pass_of(p, 0) = pass("copy_depth", None, &bindings);
        },
        "pass \"copy_depth\" is dispatched and cannot draw",
    );
}

#[test]
fn targets() {
    refused(visibility(), |p| targets_of(p).color.clear(), "0 colour targets, the pass writes 1");
    refused(
        visibility(),
        |p| targets_of(p).color[0].texture = ResourceId(2),
        "\"depth\" is Depth32Float, the pass writes R32Uint",
    );
    refused(visibility(), |p| targets_of(p).depth = None, "there is no depth target");
    refused(
        visibility(),
        |p| targets_of(p).depth.as_mut().unwrap().load = Load::Clear([0.0; 4]),
        "depth is cleared to 0, but Less needs 1",
    );
    refused(visibility(), |p| targets_of(p).color[0].mip = 1, "1 levels from level 1 of \"ids\"");
    refused(
        visibility(),
        |p| {
            p.resources.push(Resource::texture("wide", TextureFormat::R32Uint, [16, 8]));
            targets_of(p).color[0].texture = ResourceId(4);
        },
        "target \"depth\" is 8 x 8, the first one 16 x 8",
    );
}

#[test]
fn copies() {
    let copy = |change: fn(&mut Step)| move |p: &mut Plan| change(p.steps.last_mut().unwrap());
    refused(
        uint_plan(),
        copy(|s| {
            let Step::CopyBuffer { size_bytes, .. } = s else { unreachable!() };
            *size_bytes = 396;
        }),
        "396 bytes at 76 of \"words\", which has 380",
    );
    refused(
        uint_plan(),
        copy(|s| {
            let Step::CopyBuffer { source, target, .. } = s else { unreachable!() };
            *source = *target;
        }),
        "copies within one buffer",
    );
    refused(
        mips_plan(),
        copy(|s| {
            let Step::CopyTexture { source_part, .. } = s else { unreachable!() };
            source_part.base_mip = 3;
        }),
        "2 x 2 texels cannot be copied to 1 x 1",
    );
    refused(
        mips_plan(),
        copy(|s| {
            let Step::CopyTexture { source, source_part, target, target_part } = s else { unreachable!() };
            (*target, *target_part) = (*source, *source_part);
        }),
        "\"pyramid\" is copied to itself",
    );
}

#[test]
fn one_step_cannot_write_what_it_uses_otherwise() {
    refused(
        scale_plan(),
        |p| pass_of(p, 0).bindings[1] = ResourceId(0).into(),
        "step 0, scale: \"input\" is written and used otherwise",
    );
    refused(
        mips_plan(),
        |p| {
            let Step::Repeat { iterations, .. } = &mut p.steps[0] else { unreachable!() };
            let Step::Dispatch { pass, .. } = &mut iterations[1][0] else { unreachable!() };
            pass.bindings[0] = pass.bindings[1];
        },
        "level 2 of layer 0 of \"pyramid\" is written and used otherwise",
    );
}

#[test]
fn atomic_buffers_are_atomic_everywhere() {
    refused(
        indirect_plan(),
        |p| {
            let bins = pass_of(p, 1).bindings[1];
            *pass_of(p, 2) = pass("increment", None, &[bins]);
        },
        "buffer \"bins\" is bound as atomics by histogram and as plain words by increment",
    );
}

#[test]
fn transient_contents_must_be_written_first() {
    refused(
        scale_plan(),
        |p| {
            p.resources[0].lifetime = Lifetime::Transient;
            p.resources[0].initial = None;
        },
        "\"input\" is transient and read before any step has written it",
    );
    refused(indirect_plan(), |p| drop(p.steps.remove(0)), "step 0, histogram: \"bins\" is transient");
    refused(indirect_plan(), |p| drop(p.steps.remove(2)), "\"arguments\" is transient");
    refused(visibility(), |p| targets_of(p).color[0].load = Load::Keep, "\"ids\" is transient");
    refused(mips_plan(), |p| p.resources[0].initial = None, "level 0 of layer 0 of \"pyramid\" is transient");
}
