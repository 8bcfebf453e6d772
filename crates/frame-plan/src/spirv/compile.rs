//! From WGSL to SPIR-V through naga, with the options that wgpu's Vulkan backend has: on one driver both give the same bits.

use std::borrow::Cow;
use std::fmt::Write;
use std::path::Path;
use std::{fs, io};

use naga::back::spv::{
    BindingInfo, BindingMap, Capability, Options, PipelineOptions, WriterFlags,
    ZeroInitializeWorkgroupMemoryMode,
};
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Module, ResourceBinding};

use super::{SpirvModule, SpirvPasses};
use crate::{PassInfo, PassSet};

/// A pass whose WGSL does not become SPIR-V.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{pass}: {problem}")]
pub struct SpirvError {
    /// Pass name.
    pub pass: String,
    /// What the compiler says.
    pub problem: String,
}

/// What every Vulkan 1.3 device can do.
const CAPABILITIES: [Capability; 7] = [
    Capability::Shader,
    Capability::Matrix,
    Capability::Sampled1D,
    Capability::Image1D,
    Capability::ImageQuery,
    Capability::DerivativeControl,
    Capability::StorageImageExtendedFormats,
];

/// Compile all entry points of all passes.
///
/// # Errors
/// The first pass whose WGSL is invalid, lacks an entry point or binds what the pass does not have.
pub fn compile(passes: PassSet) -> Result<SpirvPasses, SpirvError> {
    let mut modules = Vec::new();
    for info in passes.0 {
        modules.extend(compile_wgsl(info.name, &info.source(), bindings(info), &info.entry_points())?);
    }
    Ok(SpirvPasses { passes, modules: modules.into() })
}

/// Compile entry points of one WGSL module, whose bindings are `0..bindings` of group 0.
///
/// # Errors
/// If the WGSL is invalid, lacks an entry point or binds something else.
pub fn compile_wgsl(
    name: &str,
    source: &str,
    bindings: u32,
    entry_points: &[String],
) -> Result<Vec<SpirvModule>, SpirvError> {
    let failed = |problem| SpirvError { pass: name.into(), problem };
    let parsed = Parsed::new(source).map_err(failed)?;
    let module = |entry_point: &String| {
        let unchecked = parsed.spirv(entry_point, bindings, BoundsCheckPolicy::Unchecked)?;
        let restricted = parsed.spirv(entry_point, bindings, BoundsCheckPolicy::Restrict)?;
        let [unchecked, restricted] = [unchecked, restricted]
            .map(|words| Cow::Owned(words.into_iter().flat_map(u32::to_le_bytes).collect::<Vec<u8>>()));
        Ok(SpirvModule { entry_point: entry_point.clone().into(), unchecked, restricted })
    };
    entry_points.iter().map(module).collect::<Result<_, _>>().map_err(failed)
}

fn bindings(info: &PassInfo) -> u32 {
    info.binding_index(info.bindings.len() as u32)
}

/// Write the modules into `folder`, and beside them `NAME.rs`: an expression of type `&[SpirvModule]` for `include!`.
///
/// # Errors
/// If the folder cannot be written.
pub fn write_modules(modules: &[SpirvModule], folder: &Path, name: &str) -> io::Result<()> {
    let mut index = String::from("&[\n");
    for module in modules {
        let write = |variant: &str, bytes: &[u8]| {
            let file = format!("{name}_{}_{variant}.spv", module.entry_point);
            fs::write(folder.join(&file), bytes).map(|()| file)
        };
        let unchecked = write("unchecked", &module.unchecked)?;
        let restricted = write("restricted", &module.restricted)?;
        writeln!(
            index,
            "    ::frame_plan::spirv::SpirvModule {{\n        entry_point: ::std::borrow::Cow::Borrowed({:?}),\n        \
             unchecked: ::std::borrow::Cow::Borrowed(include_bytes!(concat!(env!(\"OUT_DIR\"), \"/{unchecked}\"))),\n        \
             restricted: ::std::borrow::Cow::Borrowed(include_bytes!(concat!(env!(\"OUT_DIR\"), \"/{restricted}\"))),\n    }},",
            module.entry_point
        )
        .expect("a String takes everything");
    }
    index.push(']');
    fs::write(folder.join(format!("{name}.rs")), index)
}

struct Parsed {
    module: Module,
    info: ModuleInfo,
}

impl Parsed {
    fn new(source: &str) -> Result<Self, String> {
        let module = naga::front::wgsl::parse_str(source).map_err(|e| e.emit_to_string(source))?;
        let info = Validator::new(ValidationFlags::all(), Capabilities::default())
            .validate(&module)
            .map_err(|e| e.emit_to_string(source))?;
        Ok(Self { module, info })
    }

    fn spirv(
        &self,
        entry_point: &str,
        bindings: u32,
        buffers: BoundsCheckPolicy,
    ) -> Result<Vec<u32>, String> {
        let found = self.module.entry_points.iter().find(|e| e.name == entry_point);
        let stage = found.ok_or_else(|| format!("the WGSL has no entry point {entry_point}"))?.stage;
        let binding = |binding| {
            let place = ResourceBinding { group: 0, binding };
            (place, BindingInfo { descriptor_set: 0, binding, binding_array_size: None })
        };
        let options = Options {
            lang_version: (1, 6),
            flags: WriterFlags::LABEL_VARYINGS | WriterFlags::FORCE_POINT_SIZE,
            fake_missing_bindings: false,
            binding_map: (0..bindings).map(binding).collect::<BindingMap>(),
            capabilities: Some(CAPABILITIES.into_iter().collect()),
            bounds_check_policies: BoundsCheckPolicies {
                index: BoundsCheckPolicy::Restrict,
                buffer: buffers,
                // Vulkan 1.3 devices keep accesses inside images themselves.
                image_load: BoundsCheckPolicy::Unchecked,
                binding_array: BoundsCheckPolicy::Unchecked,
            },
            zero_initialize_workgroup_memory: ZeroInitializeWorkgroupMemoryMode::Native,
            use_storage_input_output_16: false,
            debug_info: None,
            ..Options::default()
        };
        let (module, info) = naga::back::pipeline_constants::process_overrides(
            &self.module,
            &self.info,
            Some((stage, entry_point)),
            &naga::back::PipelineConstants::default(),
        )
        .map_err(|e| e.to_string())?;
        let pipeline = PipelineOptions { shader_stage: stage, entry_point: entry_point.into() };
        naga::back::spv::write_vec(&module, &info, &options, Some(&pipeline)).map_err(|e| e.to_string())
    }
}
