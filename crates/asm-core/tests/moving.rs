//! Moving frames on the CPU.

#![allow(clippy::unwrap_used, reason = "tests")]

#[path = "on_device/moving.rs"]
mod moving;

/// What tests on devices choose from: here the CPU, which is always there.
mod device {
    use frame_plan::PassSet;
    use frame_plan::cpu::CpuExecutor;

    pub(crate) fn executor(passes: PassSet) -> Option<CpuExecutor> {
        Some(CpuExecutor::new(passes, None).unwrap())
    }
}

/// A planner that has made other plans makes the same ones as one that has not.
#[test]
fn plans_of_a_moving_scene_are_those_made_alone() {
    use asm_core::{Method, Planner, Settings, moving::Motion, render_plan};
    use frame_plan::Limits;
    let start = spectral_scene::bundled("gem").unwrap();
    let (settings, limits) = (Settings::of(Method::CausticsMap), Limits::default());
    let motion = Motion::new(&start);
    let mut planner = Planner::default();
    let mut same = |scene: &spectral_scene::Scene| {
        let plan = planner.render(scene, 0, [32, 32], &settings, &limits).unwrap();
        assert!(plan == render_plan(scene, 0, [32, 32], &settings, &limits).unwrap());
    };
    let mut scene = start.clone();
    for phase in [0.0, 0.1, 0.2] {
        motion.move_to(phase, &mut scene);
        same(&scene);
    }
    // Only the camera, only the light.
    scene.cameras[0].world_from_camera.w_axis.x += 0.01;
    same(&scene);
    scene.lights[0].intensity *= 2.0;
    same(&scene);
    // Glass that is mirrored; whose mesh is inside out, and then open; that is no longer glass.
    let glass = scene.refractors().next().unwrap();
    scene.objects[glass].world_from_mesh *= glam::DMat4::from_scale(glam::DVec3::new(-1.0, 1.0, 1.0));
    same(&scene);
    let mesh = scene.objects[glass].mesh;
    scene.meshes[mesh].triangles.iter_mut().for_each(|t| t.swap(0, 1));
    same(&scene);
    scene.meshes[mesh].triangles.pop();
    same(&scene);
    let material = scene.objects[glass].material;
    scene.materials[material].transmission = 0.0;
    same(&scene);
}
