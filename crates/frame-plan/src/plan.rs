//! The plan: an ordered list of steps over named resources.

use serde::{Deserialize, Serialize};

use crate::device::ParamsLayout;
use crate::{ExecuteError, Lifetime, Resource, ResourceId, ResourceKind, Subresource};

/// Everything an executor needs to run a frame, as plain data.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Name for reports.
    pub name: String,
    /// Resources, referenced by [`ResourceId`].
    pub resources: Vec<Resource>,
    /// Uniform blocks, referenced by [`ParamsId`]; a frame may replace their bytes.
    pub params: Vec<Params>,
    /// What runs, in order. Executors put the barriers between steps.
    pub steps: Vec<Step>,
    /// Which passes were kept and which were left out, and why: one decision for each that the method could use.
    pub decisions: Vec<Decision>,
}

/// Index of a [`Params`] in [`Plan::params`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct ParamsId(pub u32);

/// The bytes of a pass's uniform struct: one block, or one per iteration of the innermost [`Step::Repeat`] around it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Params {
    /// Unique within the plan.
    pub name: String,
    /// Size of one block: the size of the pass's `#[repr(C)]` struct, a multiple of 16.
    pub stride_bytes: u32,
    /// One block, or one per iteration.
    pub bytes: Vec<u8>,
}

/// Why a pass is in the plan or not.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Decision {
    /// Pass name.
    pub pass: String,
    /// In the plan.
    pub kept: bool,
    /// In words a person reads: `dispersion: off, every material has dispersion 0`.
    pub reason: String,
    /// What else is worth knowing about it, such as the views that it draws and does not.
    #[serde(default)]
    pub notes: Vec<String>,
}

/// A resource bound to a pass, in the order of [`crate::PassInfo::bindings`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Bound {
    /// The resource.
    pub resource: ResourceId,
    /// Part of a texture; `None` means the whole resource.
    pub part: Option<Subresource>,
}

impl From<ResourceId> for Bound {
    fn from(resource: ResourceId) -> Self {
        Self { resource, part: None }
    }
}

/// A compute or draw pass with its resources.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassStep {
    /// Name in the [`crate::PassSet`].
    pub pass: String,
    /// Which use of the pass this is, for timings and messages: `light 0, back faces`.
    pub label: String,
    /// Uniform block, if the pass has one.
    pub params: Option<ParamsId>,
    /// One entry per binding of the pass, in its order.
    pub bindings: Vec<Bound>,
}

/// What a render target holds before the draw.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Load {
    /// Set every texel to this value (unsigned formats take the integer value of each component).
    Clear([f32; 4]),
    /// Keep what is there.
    Keep,
}

/// A texture that a draw writes, one mip level of one layer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// The texture.
    pub texture: ResourceId,
    /// Mip level.
    pub mip: u32,
    /// Layer.
    pub layer: u32,
    /// Contents before the draw.
    pub load: Load,
}

/// What a draw step draws into.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Targets {
    /// Colour targets, in the order of the pass's formats.
    pub color: Vec<Target>,
    /// Depth target, where the pass tests depth.
    pub depth: Option<Target>,
}

/// One step of a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Step {
    /// Run a compute pass over `groups` workgroups.
    Dispatch {
        /// The pass.
        pass: PassStep,
        /// Workgroups in x, y, z.
        groups: [u32; 3],
    },
    /// Run a compute pass over as many workgroups as an earlier pass wrote: three u32 at `offset_bytes`.
    DispatchIndirect {
        /// The pass.
        pass: PassStep,
        /// Buffer with the workgroup counts, already clamped to the device's limit.
        arguments: ResourceId,
        /// Offset of the first count, a multiple of 4.
        offset_bytes: u64,
    },
    /// Draw `vertices` x `instances` without vertex buffers: vertex shaders pull from storage buffers by index.
    Draw {
        /// The pass.
        pass: PassStep,
        /// Where it draws.
        targets: Targets,
        /// Vertices per instance, three per triangle.
        vertices: u32,
        /// Instances.
        instances: u32,
    },
    /// As [`Step::Draw`], with four u32 (vertices, instances, first vertex, first instance) at `offset_bytes`.
    DrawIndirect {
        /// The pass.
        pass: PassStep,
        /// Where it draws.
        targets: Targets,
        /// Buffer with the counts.
        arguments: ResourceId,
        /// Offset of the first count, a multiple of 4.
        offset_bytes: u64,
    },
    /// Set a whole buffer to zero.
    ClearBuffer {
        /// The buffer.
        buffer: ResourceId,
    },
    /// Copy bytes between buffers.
    CopyBuffer {
        /// Source buffer.
        source: ResourceId,
        /// Offset in the source, a multiple of 4.
        source_offset_bytes: u64,
        /// Target buffer.
        target: ResourceId,
        /// Offset in the target, a multiple of 4.
        target_offset_bytes: u64,
        /// Length, a multiple of 4.
        size_bytes: u64,
    },
    /// Copy one mip level of one layer between textures of equal format and size.
    CopyTexture {
        /// Source texture.
        source: ResourceId,
        /// Mip level and layer in the source.
        source_part: Subresource,
        /// Target texture.
        target: ResourceId,
        /// Mip level and layer in the target.
        target_part: Subresource,
    },
    /// Run `iterations` in order; each may bind other mip levels, and takes block `i` of its params.
    Repeat {
        /// For messages and timings.
        label: String,
        /// The steps of each iteration.
        iterations: Vec<Vec<Step>>,
    },
}

impl Plan {
    /// Look a resource up by name.
    #[must_use]
    pub fn resource(&self, name: &str) -> Option<ResourceId> {
        self.resources.iter().position(|r| r.name == name).map(|i| ResourceId(i as u32))
    }

    /// Look a uniform block up by name.
    #[must_use]
    pub fn params_id(&self, name: &str) -> Option<ParamsId> {
        self.params.iter().position(|p| p.name == name).map(|i| ParamsId(i as u32))
    }

    /// Add a resource and return its id.
    pub fn add_resource(&mut self, resource: Resource) -> ResourceId {
        self.resources.push(resource);
        ResourceId(self.resources.len() as u32 - 1)
    }

    /// Add a uniform block with one iteration and return its id.
    pub fn add_params<T: bytemuck::Pod>(&mut self, name: impl Into<String>, params: &T) -> ParamsId {
        self.add_params_per_iteration(name, std::slice::from_ref(params))
    }

    /// Add a uniform block with one entry per iteration of the repeat that uses it, and return its id.
    pub fn add_params_per_iteration<T: bytemuck::Pod>(
        &mut self,
        name: impl Into<String>,
        params: &[T],
    ) -> ParamsId {
        self.params.push(Params {
            name: name.into(),
            stride_bytes: size_of::<T>() as u32,
            bytes: bytemuck::cast_slice(params).to_vec(),
        });
        ParamsId(self.params.len() as u32 - 1)
    }

    /// The plan without what its resources start with, for executors to keep.
    #[must_use]
    pub fn without_contents(&self) -> Self {
        let empty = |r: &Resource| Resource {
            name: r.name.clone(),
            kind: r.kind.clone(),
            initial: None,
            lifetime: r.lifetime,
            readable: r.readable,
        };
        Self {
            name: self.name.clone(),
            resources: self.resources.iter().map(empty).collect(),
            params: self.params.clone(),
            steps: self.steps.clone(),
            decisions: self.decisions.clone(),
        }
    }

    /// Bytes of everything that has values from the start and may get others between frames: buffers with contents, and
    /// parameters whose blocks lie as `params` says.
    #[must_use]
    pub fn rewritable_bytes(&self, params: &ParamsLayout) -> u64 {
        let buffers = self.resources.iter().filter(|r| matches!(r.kind, ResourceKind::Buffer { .. }));
        let contents = buffers.filter_map(|r| r.initial.as_ref()).map(|bytes| bytes.len() as u64);
        contents.sum::<u64>() + params.size_bytes()
    }

    /// Call `visit` with every pass step, in order.
    pub fn for_each_pass<'a>(&'a self, visit: &mut impl FnMut(&'a PassStep)) {
        for_each_pass(&self.steps, visit);
    }

    /// Names of the top-level steps, as in [`crate::StepTime`].
    #[must_use]
    pub fn step_names(&self) -> Vec<String> {
        self.steps.iter().map(|s| self.step_name(s)).collect()
    }

    pub(crate) fn step_name(&self, step: &Step) -> String {
        let name = |id: &ResourceId| self.resources.get(id.0 as usize).map_or("?", |r| &r.name);
        match step {
            Step::Dispatch { pass, .. }
            | Step::DispatchIndirect { pass, .. }
            | Step::Draw { pass, .. }
            | Step::DrawIndirect { pass, .. } => pass.to_string(),
            Step::ClearBuffer { buffer } => format!("clear {}", name(buffer)),
            Step::CopyBuffer { source, target, .. } | Step::CopyTexture { source, target, .. } => {
                format!("copy {} to {}", name(source), name(target))
            }
            Step::Repeat { label, .. } => label.clone(),
        }
    }

    /// Check the arguments of [`crate::Executor::set_params`].
    ///
    /// # Errors
    /// [`ExecuteError::Usage`] if the id is unknown or the length differs.
    pub fn check_params_write(&self, params: ParamsId, bytes: &[u8]) -> Result<(), ExecuteError> {
        let Some(held) = self.params.get(params.0 as usize) else {
            return Err(ExecuteError::Usage(format!(
                "params {} of {}: no such uniform block",
                params.0,
                self.params.len()
            )));
        };
        if held.bytes.len() != bytes.len() {
            return Err(ExecuteError::Usage(format!(
                "params {:?} have {} bytes, got {}",
                held.name,
                held.bytes.len(),
                bytes.len()
            )));
        }
        Ok(())
    }

    /// Check the arguments of [`crate::Executor::write_buffer`].
    ///
    /// # Errors
    /// [`ExecuteError::Usage`] if the id is not a buffer's, the range is outside it or not a multiple of 4.
    pub fn check_buffer_write(
        &self,
        buffer: ResourceId,
        offset_bytes: u64,
        bytes: &[u8],
    ) -> Result<(), ExecuteError> {
        let resource = self.known(buffer)?;
        let ResourceKind::Buffer { size_bytes } = resource.kind else {
            return Err(ExecuteError::Usage(format!("{:?} is not a buffer", resource.name)));
        };
        let len = bytes.len() as u64;
        if !offset_bytes.is_multiple_of(4) || !len.is_multiple_of(4) {
            return Err(ExecuteError::Usage(format!(
                "writing {len} bytes at {offset_bytes} of {:?}: both must be multiples of 4",
                resource.name
            )));
        }
        if offset_bytes.checked_add(len).is_none_or(|end| end > size_bytes) {
            return Err(ExecuteError::Usage(format!(
                "writing {len} bytes at {offset_bytes} of {:?}, which has {size_bytes}",
                resource.name
            )));
        }
        Ok(())
    }

    /// Check the argument of [`crate::Executor::read`].
    ///
    /// # Errors
    /// [`ExecuteError::Usage`] if the id is unknown or the resource is not readable.
    pub fn check_readable(&self, resource: ResourceId) -> Result<&Resource, ExecuteError> {
        let resource = self.known(resource)?;
        if resource.readable {
            Ok(resource)
        } else {
            Err(ExecuteError::Usage(format!("{:?} is not readable", resource.name)))
        }
    }

    /// Look an imported resource up by name.
    #[must_use]
    pub fn imported(&self, name: &str) -> Option<ResourceId> {
        self.resource(name).filter(|id| self.resources[id.0 as usize].lifetime == Lifetime::Imported)
    }

    fn known(&self, id: ResourceId) -> Result<&Resource, ExecuteError> {
        self.resources.get(id.0 as usize).ok_or_else(|| {
            ExecuteError::Usage(format!("resource {} of {}: no such resource", id.0, self.resources.len()))
        })
    }
}

fn for_each_pass<'a>(steps: &'a [Step], visit: &mut impl FnMut(&'a PassStep)) {
    for step in steps {
        match step {
            Step::Dispatch { pass, .. }
            | Step::DispatchIndirect { pass, .. }
            | Step::Draw { pass, .. }
            | Step::DrawIndirect { pass, .. } => visit(pass),
            Step::Repeat { iterations, .. } => iterations.iter().for_each(|s| for_each_pass(s, visit)),
            Step::ClearBuffer { .. } | Step::CopyBuffer { .. } | Step::CopyTexture { .. } => {}
        }
    }
}

/// Pass name, with the label in parentheses if there is one.
impl std::fmt::Display for PassStep {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.label.is_empty() {
            f.write_str(&self.pass)
        } else {
            write!(f, "{} ({})", self.pass, self.label)
        }
    }
}
