//! Adding resources to a plan within a device's limits.

use frame_plan::{Lifetime, Limits, Load, Plan, Resource, ResourceId, ResourceKind, Target, TextureFormat};

use crate::PlanError;

/// A plan under construction and the limits that it must keep.
pub(crate) struct Resources<'a> {
    pub(crate) plan: Plan,
    limits: &'a Limits,
    total_bytes: u64,
}

impl<'a> Resources<'a> {
    pub(crate) fn new(name: String, limits: &'a Limits) -> Self {
        Self { plan: Plan { name, ..Plan::default() }, limits, total_bytes: 0 }
    }

    /// A buffer with contents; empty ones get 16 zero bytes, since no buffer may be empty.
    pub(crate) fn filled<T: bytemuck::Pod>(
        &mut self,
        name: &str,
        data: &[T],
    ) -> Result<ResourceId, PlanError> {
        let mut bytes = bytemuck::cast_slice(data).to_vec();
        if bytes.is_empty() {
            bytes.resize(size_of::<T>().max(16), 0);
        }
        let kind = ResourceKind::Buffer { size_bytes: bytes.len() as u64 };
        self.add(name, kind, bytes.len() as u64, Some(bytes), "the number of triangles")
    }

    /// A buffer that starts as zeros every frame or is written whole.
    pub(crate) fn buffer(
        &mut self,
        name: &str,
        size_bytes: u64,
        remedy: &'static str,
    ) -> Result<ResourceId, PlanError> {
        self.add(name, ResourceKind::Buffer { size_bytes }, size_bytes, None, remedy)
    }

    pub(crate) fn texture(
        &mut self,
        name: &str,
        format: TextureFormat,
        size: [u32; 2],
        layers: u32,
        remedy: &'static str,
    ) -> Result<ResourceId, PlanError> {
        self.texture_of(name, ResourceKind::Texture { format, size, layers, mips: 1 }, size, remedy)
    }

    /// A texture of one layer with mip levels.
    pub(crate) fn mip_texture(
        &mut self,
        name: &str,
        format: TextureFormat,
        size: [u32; 2],
        mips: u32,
        remedy: &'static str,
    ) -> Result<ResourceId, PlanError> {
        self.texture_of(name, ResourceKind::Texture { format, size, layers: 1, mips }, size, remedy)
    }

    fn texture_of(
        &mut self,
        name: &str,
        kind: ResourceKind,
        size: [u32; 2],
        remedy: &'static str,
    ) -> Result<ResourceId, PlanError> {
        let side = size[0].max(size[1]);
        if side > self.limits.max_texture_size {
            return Err(PlanError::Limit {
                what: format!("texture {name}"),
                needed: side.into(),
                unit: "texels along a side",
                max: self.limits.max_texture_size.into(),
                remedy,
            });
        }
        let bytes = kind.bytes();
        self.add(name, kind, bytes, None, remedy)
    }

    /// A texture of one texel that shows nothing, for bindings of passes that do not look.
    pub(crate) fn nothing(&mut self) -> ResourceId {
        if let Some(id) = self.plan.resource("nothing") {
            return id;
        }
        self.plan.add_resource(Resource {
            name: "nothing".into(),
            kind: ResourceKind::Texture { format: TextureFormat::R32Uint, size: [1; 2], layers: 1, mips: 1 },
            lifetime: Lifetime::Persistent,
            initial: Some(vec![0; 4]),
            readable: false,
        })
    }

    fn add(
        &mut self,
        name: &str,
        kind: ResourceKind,
        bytes: u64,
        initial: Option<Vec<u8>>,
        remedy: &'static str,
    ) -> Result<ResourceId, PlanError> {
        let limit = |what: String, needed, max| {
            if needed <= max {
                Ok(())
            } else {
                Err(PlanError::Limit { what, needed, unit: "bytes", max, remedy })
            }
        };
        if matches!(kind, ResourceKind::Buffer { .. }) {
            let max = self.limits.max_storage_binding_bytes.min(self.limits.max_buffer_bytes);
            limit(format!("buffer {name}"), bytes, max)?;
        }
        self.total_bytes += bytes;
        limit(format!("the plan up to {name}"), self.total_bytes, self.limits.max_total_bytes)?;
        let lifetime = if initial.is_some() { Lifetime::Persistent } else { Lifetime::Transient };
        Ok(self.plan.add_resource(Resource { name: name.into(), kind, lifetime, initial, readable: false }))
    }

    /// Most workgroups along a dimension.
    pub(crate) fn max_groups(&self) -> u32 {
        self.limits.max_groups_per_dimension
    }

    /// The host reads this back.
    pub(crate) fn make_readable(&mut self, id: ResourceId) {
        self.plan.resources[id.0 as usize].readable = true;
    }

    /// Workgroups of 8 x 8 over `size`, checked.
    pub(crate) fn groups(&self, size: [u32; 2], z: u32, remedy: &'static str) -> Result<[u32; 3], PlanError> {
        let groups = [size[0].div_ceil(8), size[1].div_ceil(8), z];
        let most = groups.into_iter().fold(0, u32::max);
        if most > self.limits.max_groups_per_dimension {
            return Err(PlanError::Limit {
                what: "a dispatch".into(),
                needed: most.into(),
                unit: "workgroups along a dimension",
                max: self.limits.max_groups_per_dimension.into(),
                remedy,
            });
        }
        Ok(groups)
    }
}

/// One layer, cleared to nothing before the draw; so is depth, whose farthest is 0.
pub(crate) fn cleared(texture: ResourceId, layer: u32) -> Target {
    Target { texture, mip: 0, layer, load: Load::Clear([0.0; 4]) }
}
