//! Checks of a plan against itself, the passes and a device's limits, before anything is allocated.

mod bindings;
mod flow;
mod resources;
mod steps;

use crate::{
    ExecuteError, Limits, PassSet, Plan, Resource, ResourceId, ResourceKind, Subresource, TextureFormat,
};

/// What every check looks at. Checks return the problem in words.
struct Checker<'a> {
    plan: &'a Plan,
    passes: &'a PassSet,
    limits: &'a Limits,
}

type Check = Result<(), String>;

impl Plan {
    /// Check the plan against itself, `passes` and `limits`. Executors rely on it, and run it in `prepare`.
    ///
    /// # Errors
    /// [`ExecuteError::InvalidPlan`] with the first problem: duplicate names, sizes over the limits (one resource or their
    /// sum), unknown passes or ids, bindings, parameters or targets that do not fit their pass, ranges outside a resource,
    /// a resource written and read by one step, transient contents read before any step has written them.
    pub fn validate(&self, passes: &PassSet, limits: &Limits) -> Result<(), ExecuteError> {
        let checker = Checker { plan: self, passes, limits };
        checker
            .resources()
            .and_then(|()| checker.steps(&self.steps, None))
            .and_then(|()| checker.atomics())
            .and_then(|()| checker.flow())
            .map_err(|problem| ExecuteError::InvalidPlan { plan: self.name.clone(), problem })
    }
}

impl<'a> Checker<'a> {
    fn resource(&self, id: ResourceId) -> Result<&'a Resource, String> {
        self.plan.resources.get(id.0 as usize).ok_or_else(|| {
            format!("resource {} does not exist, the plan has {}", id.0, self.plan.resources.len())
        })
    }

    /// The size of a buffer.
    fn buffer(&self, id: ResourceId) -> Result<u64, String> {
        let resource = self.resource(id)?;
        match resource.kind {
            ResourceKind::Buffer { size_bytes } => Ok(size_bytes),
            _ => Err(format!("{:?} is not a buffer", resource.name)),
        }
    }

    fn texture(&self, id: ResourceId) -> Result<TextureShape<'a>, String> {
        let resource = self.resource(id)?;
        match resource.kind {
            ResourceKind::Texture { format, size, layers, mips } => {
                Ok(TextureShape { name: &resource.name, format, size, layers, mips })
            }
            _ => Err(format!("{:?} is not a texture", resource.name)),
        }
    }
}

/// A texture resource.
struct TextureShape<'a> {
    name: &'a str,
    format: TextureFormat,
    size: [u32; 2],
    layers: u32,
    mips: u32,
}

impl TextureShape<'_> {
    /// The part, or everything, if it lies in the texture.
    fn part(&self, part: Option<Subresource>) -> Result<Subresource, String> {
        let whole = Subresource { base_mip: 0, mips: self.mips, base_layer: 0, layers: self.layers };
        let part = part.unwrap_or(whole);
        let fits = |base: u32, count: u32, of: u32| {
            count > 0 && base.checked_add(count).is_some_and(|end| end <= of)
        };
        if !fits(part.base_mip, part.mips, self.mips) {
            return Err(format!(
                "{} levels from level {} of {:?}, which has {}",
                part.mips, part.base_mip, self.name, self.mips
            ));
        }
        if !fits(part.base_layer, part.layers, self.layers) {
            return Err(format!(
                "{} layers from layer {} of {:?}, which has {}",
                part.layers, part.base_layer, self.name, self.layers
            ));
        }
        Ok(part)
    }

    /// A part of one level of one layer.
    fn single(&self, part: Option<Subresource>) -> Result<Subresource, String> {
        let part = self.part(part)?;
        if part.mips != 1 || part.layers != 1 {
            return Err(format!(
                "{} levels and {} layers of {:?} where one of each is needed",
                part.mips, part.layers, self.name
            ));
        }
        Ok(part)
    }

    /// Width and height of a level.
    fn size_of(&self, mip: u32) -> [u32; 2] {
        self.size.map(|s| (s >> mip).max(1))
    }
}
