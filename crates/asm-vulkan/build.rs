//! Compiles the WGSL of asm-core's passes, and of the display, to SPIR-V.

use std::path::Path;

use asm_core::display::DISPLAY_WGSL;
use frame_plan::spirv::{compile, compile_wgsl, write_modules};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The WGSL is part of asm-core, which this script is built with: it need not run again for anything else.
    println!("cargo::rerun-if-changed=build.rs");
    let folder = std::env::var("OUT_DIR")?;
    let compiled = compile(asm_core::PASSES)?;
    write_modules(&compiled.modules, Path::new(&folder), "asm_passes")?;
    let entry_points = ["display_vertex".into(), "display_fragment".into()];
    let display = compile_wgsl("display", DISPLAY_WGSL, 2, &entry_points)?;
    write_modules(&display, Path::new(&folder), "display")?;
    Ok(())
}
