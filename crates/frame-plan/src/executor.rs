//! What runs plans.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::{ParamsId, Plan, ResourceId};

/// Who did the work.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DeviceInfo {
    /// Executor: `cpu`, `wgpu` or `vulkan`.
    pub executor: String,
    /// Device name as the driver states it.
    pub device: String,
    /// Driver name and version.
    pub driver: String,
    /// What it computes on.
    #[serde(default)]
    pub device_type: DeviceType,
    /// Draw passes snap vertices to 2^-this of a texel; none where the device does not say.
    #[serde(default)]
    pub subpixel_bits: Option<u32>,
}

impl DeviceInfo {
    /// Whether this is part of the device's or the driver's name, upper or lower case.
    #[must_use]
    pub fn is_named(&self, part: &str) -> bool {
        let part = part.to_lowercase();
        self.device.to_lowercase().contains(&part) || self.driver.to_lowercase().contains(&part)
    }
}

/// Names of device and driver.
impl fmt::Display for DeviceInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.device, self.driver)
    }
}

/// What a device is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceType {
    /// The processor: our own executor, or a software driver.
    Cpu,
    /// A GPU that shares the processor's memory.
    Integrated,
    /// A GPU with memory of its own.
    Discrete,
    /// A GPU that a virtual machine is given.
    Virtual,
    /// The driver does not say.
    #[default]
    Other,
}

/// What a device can hold and run; plans are built inside these.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Limits {
    /// Width and height of a 2-D texture.
    pub max_texture_size: u32,
    /// Bytes of one storage binding.
    pub max_storage_binding_bytes: u64,
    /// Bytes of one buffer.
    pub max_buffer_bytes: u64,
    /// Workgroups per dimension of a dispatch.
    pub max_groups_per_dimension: u32,
    /// Bytes of all resources of a plan together.
    pub max_total_bytes: u64,
}

/// WebGPU's guaranteed limits, and 4 GiB in all: what every device can do.
impl Default for Limits {
    fn default() -> Self {
        Self {
            max_texture_size: 8192,
            max_storage_binding_bytes: 128 << 20,
            max_buffer_bytes: 256 << 20,
            max_groups_per_dimension: 65_535,
            max_total_bytes: 4 << 30,
        }
    }
}

impl Limits {
    /// What both devices can do.
    #[must_use]
    pub fn common(self, other: Self) -> Self {
        Self {
            max_texture_size: self.max_texture_size.min(other.max_texture_size),
            max_storage_binding_bytes: self.max_storage_binding_bytes.min(other.max_storage_binding_bytes),
            max_buffer_bytes: self.max_buffer_bytes.min(other.max_buffer_bytes),
            max_groups_per_dimension: self.max_groups_per_dimension.min(other.max_groups_per_dimension),
            max_total_bytes: self.max_total_bytes.min(other.max_total_bytes),
        }
    }
}

/// Milliseconds of one top-level step of the last finished frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepTime {
    /// Pass name and label, or what else the step is; a repeat counts as one step.
    pub name: String,
    /// Device time, or CPU time on the CPU executor.
    pub milliseconds: f64,
}

/// What an executor has made since it was made itself, whether it is still there or not.
///
/// Two frames after a plan was prepared, frames make nothing: the counts stay as they are, however parameters and buffers are
/// written. What a host makes around them is not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Made {
    /// Compiled pipelines.
    pub pipelines: u64,
    /// Buffers, those that bring bytes to and from the host included.
    pub buffers: u64,
    /// Textures.
    pub textures: u64,
    /// What names them to passes: views, samplers, bind groups or descriptor pools.
    pub bindings: u64,
    /// Bytes of all of them.
    pub bytes: u64,
}

/// Runs plans. `prepare` allocates and compiles; `execute` only runs.
pub trait Executor {
    /// Who does the work.
    fn info(&self) -> &DeviceInfo;

    /// What plans must fit into.
    fn limits(&self) -> Limits;

    /// Check the plan against the device and allocate everything it needs; replaces an earlier plan.
    ///
    /// # Errors
    /// [`ExecuteError::InvalidPlan`] before anything is allocated; device errors after.
    fn prepare(&mut self, plan: &Plan) -> Result<(), ExecuteError>;

    /// Replace the bytes of a uniform block from the next frame on.
    ///
    /// # Errors
    /// If nothing is prepared, the id is unknown or the length differs from the plan's.
    fn set_params(&mut self, params: ParamsId, bytes: &[u8]) -> Result<(), ExecuteError>;

    /// Replace bytes of a buffer from the next frame on.
    ///
    /// # Errors
    /// If nothing is prepared, the id is unknown or the range is outside the buffer.
    fn write_buffer(
        &mut self,
        buffer: ResourceId,
        offset_bytes: u64,
        bytes: &[u8],
    ) -> Result<(), ExecuteError>;

    /// Run one frame: no allocation, no compilation, no read-back.
    ///
    /// # Errors
    /// Device errors; no plan prepared.
    fn execute(&mut self) -> Result<(), ExecuteError>;

    /// Wait for the last frame and read a whole `readable` resource: a buffer's bytes, or a texture's level 0 layer 0, tightly packed.
    ///
    /// # Errors
    /// Device errors; a resource that is not readable.
    fn read(&mut self, resource: ResourceId) -> Result<Vec<u8>, ExecuteError>;

    /// From the next frame on, bring what these readable resources of the prepared plan hold after each frame to the host, in the
    /// frame's own commands: for [`Executor::latest`]. Replaces what was watched before; ends with the plan.
    ///
    /// # Errors
    /// [`ExecuteError::Usage`] if nothing is prepared or a resource is not readable; device errors.
    fn watch(&mut self, resources: &[ResourceId]) -> Result<(), ExecuteError>;

    /// What a watched resource held after the last frame that is known to have finished, laid out as by [`Executor::read`]; none
    /// if there is no such frame yet. Never waits.
    fn latest(&mut self, resource: ResourceId) -> Option<&[u8]>;

    /// What was made so far.
    fn made(&self) -> Made;

    /// Times per step of the last finished frame; empty where the device cannot measure.
    fn step_times(&mut self) -> Vec<StepTime>;
}

/// Why a plan did not run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExecuteError {
    /// The plan contradicts itself, the pass set or the device's limits.
    #[error("plan {plan:?}: {problem}")]
    InvalidPlan {
        /// Plan name.
        plan: String,
        /// What is wrong, with the numbers.
        problem: String,
    },
    /// A pass's shader does not compile on the device.
    #[error("{executor} cannot compile pass {pass:?}: {reason}")]
    Shader {
        /// Executor id.
        executor: &'static str,
        /// Pass name.
        pass: String,
        /// What the compiler said.
        reason: String,
    },
    /// A call that does not fit the prepared plan.
    #[error("{0}")]
    Usage(String),
    /// No usable device.
    #[error("no {executor} device: {reason}")]
    NoDevice {
        /// Executor id.
        executor: &'static str,
        /// What the API said.
        reason: String,
    },
    /// The device failed or was lost.
    #[error("{executor} device failed: {reason}")]
    Device {
        /// Executor id.
        executor: &'static str,
        /// What the API said.
        reason: String,
    },
    /// Memory ran out.
    #[error("{executor} device is out of memory: {reason}")]
    OutOfMemory {
        /// Executor id.
        executor: &'static str,
        /// What was asked for.
        reason: String,
    },
}

impl ExecuteError {
    /// The error of a call that needs a prepared plan.
    #[must_use]
    pub fn nothing_prepared() -> Self {
        Self::Usage("no plan is prepared".into())
    }

    /// The error of asking for a device by a name that none of those that were found has.
    #[must_use]
    pub fn no_device_named(executor: &'static str, wanted: &str, found: &[DeviceInfo]) -> Self {
        let found: Vec<_> = found.iter().map(DeviceInfo::to_string).collect();
        let reason = match &*found {
            [] => format!("there is none at all, and so none named {wanted:?}"),
            found => format!("none is named {wanted:?}; there are: {}", found.join("; ")),
        };
        Self::NoDevice { executor, reason }
    }
}

#[cfg(test)]
mod tests {
    use super::{DeviceInfo, ExecuteError};

    fn info(device: &str, driver: &str) -> DeviceInfo {
        DeviceInfo { device: device.into(), driver: driver.into(), ..DeviceInfo::default() }
    }

    #[test]
    fn devices_are_named_by_part_of_a_name() {
        let lavapipe = info("llvmpipe (LLVM 15.0.6, 256 bits)", "llvmpipe Mesa 22.3.6 (vulkan)");
        assert!(lavapipe.is_named("LLVMpipe"));
        assert!(lavapipe.is_named("mesa"));
        assert!(!lavapipe.is_named("swiftshader"));
    }

    #[test]
    fn the_error_lists_what_there_is() {
        let text = |found: &[_]| ExecuteError::no_device_named("wgpu", "voodoo", found).to_string();
        let two = [info("A", "a 1"), info("B", "b 2")];
        assert_eq!(text(&two), "no wgpu device: none is named \"voodoo\"; there are: A, a 1; B, b 2");
        assert_eq!(text(&[]), "no wgpu device: there is none at all, and so none named \"voodoo\"");
    }
}
