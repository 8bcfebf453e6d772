//! What the steps of a plan do with its resources, and what that asks of a device.

use crate::{
    BindingKind, ExecuteError, PassKind, PassSet, Plan, ResourceId, ResourceKind, Step, Targets,
    TextureFormat,
};

/// What the steps of a plan do with one of its resources, beyond binding buffers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uses {
    /// A pass loads or samples it.
    pub sampled: bool,
    /// A pass stores texels into it.
    pub stored: bool,
    /// A draw's target.
    pub target: bool,
    /// Holds arguments of indirect steps.
    pub indirect: bool,
    /// Copied from, or read back.
    pub copy_source: bool,
    /// Copied to, or filled when the plan is prepared.
    pub copy_target: bool,
}

impl Uses {
    /// Of each resource of a validated plan.
    #[must_use]
    pub fn of(plan: &Plan, passes: &PassSet) -> Vec<Self> {
        let start = |r: &crate::Resource| Self {
            copy_source: r.readable,
            copy_target: r.initial.is_some(),
            ..Self::default()
        };
        let mut uses: Vec<_> = plan.resources.iter().map(start).collect();
        plan.for_each_pass(&mut |step| {
            let bindings = passes.get(&step.pass).map_or(&[][..], |p| p.bindings);
            for (binding, bound) in bindings.iter().zip(&step.bindings) {
                let uses = &mut uses[bound.resource.0 as usize];
                match binding.kind {
                    BindingKind::Texture { .. } | BindingKind::DepthTexture => uses.sampled = true,
                    BindingKind::StorageTexture { .. } => uses.stored = true,
                    _ => {}
                }
            }
        });
        add(&mut uses, &plan.steps);
        uses
    }

    /// Whether passes bind it as a texture, rather than only draw into it or copy it.
    #[must_use]
    pub const fn binds_texture(self) -> bool {
        self.sampled || self.stored
    }
}

fn add(uses: &mut [Uses], steps: &[Step]) {
    fn of(uses: &mut [Uses], id: ResourceId) -> &mut Uses {
        &mut uses[id.0 as usize]
    }
    let targets = |uses: &mut [Uses], targets: &Targets| {
        targets.color.iter().chain(&targets.depth).for_each(|t| of(uses, t.texture).target = true);
    };
    for step in steps {
        match step {
            Step::Dispatch { .. } | Step::ClearBuffer { .. } => {}
            Step::DispatchIndirect { arguments, .. } => of(uses, *arguments).indirect = true,
            Step::Draw { targets: drawn, .. } => targets(uses, drawn),
            Step::DrawIndirect { targets: drawn, arguments, .. } => {
                targets(uses, drawn);
                of(uses, *arguments).indirect = true;
            }
            Step::CopyBuffer { source, target, .. } | Step::CopyTexture { source, target, .. } => {
                of(uses, *source).copy_source = true;
                of(uses, *target).copy_target = true;
            }
            Step::Repeat { iterations, .. } => iterations.iter().for_each(|steps| add(uses, steps)),
        }
    }
}

/// What only some devices can do with textures of 32-bit floats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Float32 {
    /// Draws that add to them.
    Blend,
    /// Bilinear samples of them.
    Filter,
}

impl Float32 {
    /// Refuse a plan that asks for what the device cannot do with a format.
    ///
    /// # Errors
    /// [`ExecuteError::InvalidPlan`] that names the step.
    pub fn check(
        plan: &Plan,
        passes: &PassSet,
        can: impl Fn(Self, TextureFormat) -> bool,
    ) -> Result<(), ExecuteError> {
        let lacks = |what, format| {
            matches!(format, TextureFormat::R32Float | TextureFormat::Rgba32Float) && !can(what, format)
        };
        let mut problem = None;
        plan.for_each_pass(&mut |step| {
            let Some(info) = passes.get(&step.pass) else { return };
            if let PassKind::Draw { targets, additive: true, .. } = info.kind
                && targets.iter().any(|&format| lacks(Self::Blend, format))
            {
                problem = Some(format!("{step}: the device cannot blend 32-bit floats"));
            }
            for (binding, bound) in info.bindings.iter().zip(&step.bindings) {
                if let BindingKind::Texture { filter: true, .. } = binding.kind
                    && let ResourceKind::Texture { format, .. } =
                        plan.resources[bound.resource.0 as usize].kind
                    && lacks(Self::Filter, format)
                {
                    problem =
                        Some(format!("{step}: the device cannot filter 32-bit floats ({})", binding.name));
                }
            }
        });
        match problem {
            None => Ok(()),
            Some(problem) => Err(ExecuteError::InvalidPlan { plan: plan.name.clone(), problem }),
        }
    }
}
