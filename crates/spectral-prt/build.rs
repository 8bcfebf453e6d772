//! Compiles the WGSL of the passes to SPIR-V, where feature `spirv` asks for it.

#[cfg(feature = "spirv")]
#[path = "src/passes/wgsl.rs"]
mod wgsl;

#[cfg(feature = "spirv")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    use std::path::Path;

    use asm_core::passes::visibility::VISIBILITY;
    use frame_plan::PassSet;
    use frame_plan::spirv::{compile, compile_wgsl, write_modules};

    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=src/passes/wgsl.rs");
    println!("cargo::rerun-if-changed=../../shaders");
    // One more binding than the largest pass has.
    const MOST_BINDINGS: u32 = 11;
    const OF_ASM_CORE: PassSet = PassSet(&[&VISIBILITY]);
    let mut modules = compile(OF_ASM_CORE)?.modules.into_owned();
    for (name, sources) in wgsl::ALL {
        let entry_points = [(*name).to_owned()];
        modules.extend(compile_wgsl(name, &sources.concat(), MOST_BINDINGS, &entry_points)?);
    }
    write_modules(&modules, Path::new(&std::env::var("OUT_DIR")?), "prt_passes")?;
    Ok(())
}

#[cfg(not(feature = "spirv"))]
fn main() {
    println!("cargo::rerun-if-changed=build.rs");
}
