//! A plan is plain data: it survives being written down, and what comes back draws the same picture.

use asm_core::BakePlan;
use workspace_tests::{executors, small_bake, subject};
use xtask::executors::bake;
use xtask::sabotage::Sabotage;

fn written_and_read(plan: &BakePlan) -> BakePlan {
    let text = serde_json::to_string(plan).expect("a plan can be written");
    serde_json::from_str(&text).expect("what was written can be read")
}

#[test]
fn plans_survive_being_written_down() {
    for name in ["prism", "sphere", "gem", "water"] {
        let plan = small_bake(&subject(name));
        assert!(written_and_read(&plan) == plan, "{name}");
    }
}

#[test]
fn a_plan_that_was_read_gives_the_same_bits() {
    let plan = small_bake(&subject("gem"));
    for (id, mut executor) in executors() {
        let (original, _) = bake(&plan, executor.as_mut()).expect(id);
        let (read, _) = bake(&written_and_read(&plan), executor.as_mut()).expect(id);
        assert!(original == read, "{id}");
        // The comparison itself can fail.
        let (spoiled, _) = bake(&Sabotage::Ior.spoil(&plan), executor.as_mut()).expect(id);
        assert!(original != spoiled, "{id}: an index of refraction went unnoticed");
    }
}
