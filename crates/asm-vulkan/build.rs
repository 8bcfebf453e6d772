//! Compiles the WGSL of asm-core's passes to SPIR-V.

use std::path::Path;

use frame_plan::spirv::{compile, write_modules};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The WGSL is part of asm-core, which this script is built with: it need not run again for anything else.
    println!("cargo::rerun-if-changed=build.rs");
    let folder = std::env::var("OUT_DIR")?;
    let compiled = compile(asm_core::PASSES)?;
    write_modules(&compiled.modules, Path::new(&folder), "asm_passes")?;
    Ok(())
}
