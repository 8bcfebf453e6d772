//! Comparing passes with their WGSL through naga (feature `reflect`, for tests).
//!
//! ```text
//! reflect::check_pass(&PHOTON_TRACE)?;
//! reflect::check_layout(&PHOTON_TRACE, &layout!(PhotonTraceParams as "PhotonTrace" { extent_m, map_size }))?;
//! ```

use naga::proc::{GlobalCtx, Layouter};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{
    AddressSpace, GlobalVariable, ImageClass, Module, ShaderStage, StorageAccess, StorageFormat, TypeInner,
};

use crate::{BindingKind, PassInfo, PassKind, TextureFormat};

/// Storage buffers per stage that every device has.
const MAX_STORAGE_BUFFERS: usize = 8;
/// Colour targets that a fragment mirror returns.
const MAX_TARGETS: usize = 4;
/// Invocations per workgroup that every device has.
const MAX_INVOCATIONS: u32 = 256;

/// The host's side of a struct that shaders read; made by [`crate::layout!`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HostLayout {
    /// Name of the WGSL struct.
    pub wgsl_name: &'static str,
    /// Size in bytes.
    pub size: usize,
    /// Names and offsets of the fields that the WGSL struct has: all but the host's padding.
    pub fields: Vec<(&'static str, usize)>,
}

/// [`reflect::HostLayout`](crate::reflect::HostLayout) of a `#[repr(C)]` struct: `layout!(HostType as "WgslName" { field, field })`.
#[macro_export]
macro_rules! layout {
    ($host:ty as $wgsl:literal { $($field:ident),* $(,)? }) => {
        $crate::reflect::HostLayout {
            wgsl_name: $wgsl,
            size: ::core::mem::size_of::<$host>(),
            fields: vec![$((stringify!($field), ::core::mem::offset_of!($host, $field))),*],
        }
    };
}

/// Where a pass and its WGSL differ.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{pass}: {problem}")]
pub struct ReflectError {
    /// Pass name.
    pub pass: &'static str,
    /// What differs, with both sides.
    pub problem: String,
}

/// Check that a pass's WGSL is valid and has its entry points, workgroup size, bindings and parameter struct, and stays within
/// the 8 storage buffers and 256 invocations that every device has.
///
/// # Errors
/// The first difference.
pub fn check_pass(info: &PassInfo) -> Result<(), ReflectError> {
    Reflection::new(info).and_then(|r| r.pass()).map_err(|problem| ReflectError { pass: info.name, problem })
}

/// Check that a struct of a pass's WGSL has exactly the fields and the size of the host's.
///
/// # Errors
/// The first difference.
pub fn check_layout(info: &PassInfo, host: &HostLayout) -> Result<(), ReflectError> {
    Reflection::new(info)
        .and_then(|r| r.layout(host))
        .map_err(|problem| ReflectError { pass: info.name, problem })
}

/// Name and offset.
type Member<'a> = (&'a str, u32);

struct Reflection<'a> {
    info: &'a PassInfo,
    module: Module,
}

impl<'a> Reflection<'a> {
    fn new(info: &'a PassInfo) -> Result<Self, String> {
        let source = info.source();
        let module = naga::front::wgsl::parse_str(&source).map_err(|e| e.emit_to_string(&source))?;
        Validator::new(ValidationFlags::all(), Capabilities::default())
            .validate(&module)
            .map_err(|e| e.emit_to_string(&source))?;
        Ok(Self { info, module })
    }

    fn pass(&self) -> Result<(), String> {
        self.entry_points()?;
        self.bindings()?;
        if self.info.params_bytes == 0 {
            return Ok(());
        }
        let (size, _) = self.members(self.info.params_struct)?;
        if size != self.info.params_bytes {
            return Err(format!(
                "{} has {size} bytes, the pass says {}",
                self.info.params_struct, self.info.params_bytes
            ));
        }
        Ok(())
    }

    fn entry_points(&self) -> Result<(), String> {
        let name = self.info.name;
        match self.info.kind {
            PassKind::Compute { workgroup, .. } => {
                let found = self.entry_point(name, ShaderStage::Compute)?.workgroup_size;
                if found != workgroup {
                    return Err(format!("workgroup size {found:?}, the pass says {workgroup:?}"));
                }
                if found.iter().product::<u32>() > MAX_INVOCATIONS {
                    return Err(format!("workgroup size {found:?} is over {MAX_INVOCATIONS} invocations"));
                }
            }
            PassKind::Draw { targets, .. } => {
                self.entry_point(&format!("{name}_vertex"), ShaderStage::Vertex)?;
                let fragment = self.entry_point(&format!("{name}_fragment"), ShaderStage::Fragment)?;
                self.targets(fragment, targets)?;
            }
        }
        Ok(())
    }

    fn entry_point(&self, name: &str, stage: ShaderStage) -> Result<&naga::EntryPoint, String> {
        self.module
            .entry_points
            .iter()
            .find(|e| e.name == name && e.stage == stage)
            .ok_or_else(|| format!("no {stage:?} entry point is named {name}"))
    }

    /// Compare what the fragment shader returns with the pass's targets.
    fn targets(&self, fragment: &naga::EntryPoint, targets: &[TextureFormat]) -> Result<(), String> {
        let outputs: Vec<_> = match &fragment.function.result {
            None => Vec::new(),
            Some(result) => match &self.module.types[result.ty].inner {
                TypeInner::Struct { members, .. } => {
                    members.iter().map(|m| (m.binding.as_ref(), m.ty)).collect()
                }
                _ => vec![(result.binding.as_ref(), result.ty)],
            },
        };
        if targets.len() > MAX_TARGETS {
            return Err(format!("{} targets, mirrors return {MAX_TARGETS}", targets.len()));
        }
        let mut kinds = vec![None; targets.len()];
        for (binding, ty) in outputs {
            let Some(naga::Binding::Location { location, .. }) = binding else { continue };
            let kind = self.module.types[ty].inner.scalar_kind();
            *kinds
                .get_mut(*location as usize)
                .ok_or_else(|| format!("output {location}, the pass has {} targets", targets.len()))? = kind;
        }
        for (location, (found, target)) in kinds.iter().zip(targets).enumerate() {
            let wanted = match target {
                TextureFormat::R32Uint => naga::ScalarKind::Uint,
                _ => naga::ScalarKind::Float,
            };
            if *found != Some(wanted) {
                return Err(format!("output {location} is {found:?}, target {target:?} needs {wanted:?}"));
            }
        }
        Ok(())
    }

    fn bindings(&self) -> Result<(), String> {
        let mut expected = Vec::new();
        if self.info.params_bytes > 0 {
            expected.push((0, None));
        }
        for (i, binding) in (0..).zip(self.info.bindings) {
            expected.push((self.info.binding_index(i), Some(binding)));
        }
        let globals: Vec<_> =
            self.module.global_variables.iter().map(|(_, g)| g).filter(|g| g.binding.is_some()).collect();
        if let Some(extra) = globals.iter().find(|g| {
            g.binding
                .as_ref()
                .is_some_and(|b| b.group != 0 || expected.iter().all(|(index, _)| *index != b.binding))
        }) {
            return Err(format!("variable {:?} at {:?} is not in the pass", extra.name, extra.binding));
        }
        for (index, binding) in expected {
            let global = globals
                .iter()
                .find(|g| g.binding.as_ref().is_some_and(|b| b.binding == index))
                .ok_or_else(|| format!("nothing is bound at {index}, where the pass has {binding:?}"))?;
            match binding {
                None => self.uniform(global)?,
                Some(binding) if global.name.as_deref() != Some(binding.name) => {
                    return Err(format!(
                        "binding {index} is named {:?}, in the pass {:?}",
                        global.name, binding.name
                    ));
                }
                Some(binding) => self.binding(global, binding.kind).map_err(|found| {
                    format!("{} is {found}, the pass says {:?}", binding.name, binding.kind)
                })?,
            }
        }
        let is_storage = |g: &&&GlobalVariable| matches!(g.space, AddressSpace::Storage { .. });
        let buffers = globals.iter().filter(is_storage).count();
        if buffers > MAX_STORAGE_BUFFERS {
            return Err(format!("{buffers} storage buffers, devices guarantee {MAX_STORAGE_BUFFERS}"));
        }
        Ok(())
    }

    fn uniform(&self, global: &GlobalVariable) -> Result<(), String> {
        let name = self.module.types[global.ty].name.as_deref();
        if global.space != AddressSpace::Uniform || name != Some(self.info.params_struct) {
            return Err(format!(
                "binding 0 is {:?} of {name:?}, the pass says uniform {}",
                global.space, self.info.params_struct
            ));
        }
        Ok(())
    }

    /// Compare a variable with a binding kind; the error says what it is.
    fn binding(&self, global: &GlobalVariable, kind: BindingKind) -> Result<(), String> {
        let inner = &self.module.types[global.ty].inner;
        let matches = match (kind, inner) {
            (BindingKind::Read | BindingKind::ReadAtomic, _) => {
                global.space == AddressSpace::Storage { access: StorageAccess::LOAD }
            }
            (BindingKind::Write | BindingKind::Atomic, _) => {
                let access = StorageAccess::LOAD | StorageAccess::STORE;
                global.space == AddressSpace::Storage { access }
                    && self.is_atomic(global.ty) == (kind == BindingKind::Atomic)
            }
            (
                BindingKind::Texture { uint, array, .. },
                TypeInner::Image {
                    dim: naga::ImageDimension::D2,
                    arrayed,
                    class: ImageClass::Sampled { kind, multi: false },
                },
            ) => {
                let wanted = if uint { naga::ScalarKind::Uint } else { naga::ScalarKind::Float };
                *arrayed == array && *kind == wanted
            }
            (
                BindingKind::DepthTexture,
                TypeInner::Image {
                    dim: naga::ImageDimension::D2,
                    arrayed: false,
                    class: ImageClass::Depth { multi: false },
                },
            ) => true,
            (
                BindingKind::StorageTexture { format },
                TypeInner::Image {
                    dim: naga::ImageDimension::D2,
                    arrayed: false,
                    class: ImageClass::Storage { format: found, access: StorageAccess::STORE },
                },
            ) => storage_format(format) == Some(*found),
            (BindingKind::Sampler { .. }, TypeInner::Sampler { comparison: false }) => true,
            _ => false,
        };
        if matches { Ok(()) } else { Err(format!("{:?} {inner:?}", global.space)) }
    }

    fn is_atomic(&self, ty: naga::Handle<naga::Type>) -> bool {
        match &self.module.types[ty].inner {
            TypeInner::Atomic(_) => true,
            TypeInner::Array { base, .. } => self.is_atomic(*base),
            TypeInner::Struct { members, .. } => members.iter().any(|m| self.is_atomic(m.ty)),
            _ => false,
        }
    }

    fn layout(&self, host: &HostLayout) -> Result<(), String> {
        let name = host.wgsl_name;
        let (size, members) = self.members(name)?;
        if size as usize != host.size {
            return Err(format!("{name} has {size} bytes in WGSL, {} on the host", host.size));
        }
        for (member, offset) in &members {
            match host.fields.iter().find(|(field, _)| field == member) {
                None => return Err(format!("{name}.{member} is not among the host's fields")),
                Some((_, found)) if *found != *offset as usize => {
                    return Err(format!("{name}.{member} is at {offset} in WGSL, at {found} on the host"));
                }
                Some(_) => {}
            }
        }
        match host.fields.iter().find(|(field, _)| members.iter().all(|(member, _)| member != field)) {
            Some((field, _)) => Err(format!("{name}.{field} is not in the WGSL")),
            None => Ok(()),
        }
    }

    /// Size of a struct as an array element, or as a uniform block in units of 16, and its members with offsets.
    fn members(&self, name: &str) -> Result<(u32, Vec<Member<'_>>), String> {
        let (handle, ty) = self
            .module
            .types
            .iter()
            .find(|(_, t)| t.name.as_deref() == Some(name))
            .ok_or_else(|| format!("the WGSL has no struct {name}"))?;
        let TypeInner::Struct { members, .. } = &ty.inner else {
            return Err(format!("{name} is not a struct"));
        };
        let mut layouter = Layouter::default();
        let context: GlobalCtx<'_> = self.module.to_ctx();
        layouter.update(context).map_err(|e| e.to_string())?;
        let members = members.iter().map(|m| (m.name.as_deref().unwrap_or(""), m.offset)).collect();
        let stride = layouter[handle].to_stride();
        let uniform = name == self.info.params_struct;
        Ok((if uniform { stride.next_multiple_of(16) } else { stride }, members))
    }
}

fn storage_format(format: TextureFormat) -> Option<StorageFormat> {
    match format {
        TextureFormat::R32Uint => Some(StorageFormat::R32Uint),
        TextureFormat::R32Float => Some(StorageFormat::R32Float),
        TextureFormat::Rgba16Float => Some(StorageFormat::Rgba16Float),
        TextureFormat::Rgba32Float => Some(StorageFormat::Rgba32Float),
        TextureFormat::Rgba8Unorm => Some(StorageFormat::Rgba8Unorm),
        TextureFormat::Depth32Float => None,
    }
}
