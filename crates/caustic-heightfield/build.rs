//! Compiles the WGSL of the pond's passes to SPIR-V, where feature `spirv` asks for it.

#[cfg(feature = "spirv")]
#[path = "src/passes/wgsl.rs"]
mod wgsl;

#[cfg(feature = "spirv")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    use std::path::Path;

    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=src/passes/wgsl.rs");
    println!("cargo::rerun-if-changed=../../shaders");
    // One more binding than the largest pass has.
    const MOST_BINDINGS: u32 = 9;
    let mut modules = Vec::new();
    for (name, sources) in wgsl::ALL {
        let entry_points = [(*name).to_owned()];
        modules.extend(frame_plan::spirv::compile_wgsl(
            name,
            &sources.concat(),
            MOST_BINDINGS,
            &entry_points,
        )?);
    }
    frame_plan::spirv::write_modules(&modules, Path::new(&std::env::var("OUT_DIR")?), "pond_passes")?;
    Ok(())
}

#[cfg(not(feature = "spirv"))]
fn main() {
    println!("cargo::rerun-if-changed=build.rs");
}
