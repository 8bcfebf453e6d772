//! What steps read and write: no step writes what it also uses otherwise, no step reads what nobody has written.

use std::collections::HashSet;

use super::{Check, Checker};
use crate::{BindingKind, Lifetime, Load, PassStep, ResourceId, ResourceKind, Step, Subresource, Targets};

/// One buffer, or one level of one layer of a texture.
type Piece = (ResourceId, u32, u32);

/// One use of a piece by a step.
struct Use {
    piece: Piece,
    reads: bool,
    writes: bool,
}

impl Checker<'_> {
    pub(super) fn flow(&self) -> Check {
        let mut written = HashSet::new();
        for (id, resource) in (0..).map(ResourceId).zip(&self.plan.resources) {
            if resource.lifetime != Lifetime::Transient || resource.initial.is_some() {
                written.extend(self.pieces(id, None));
            }
        }
        self.follow(&self.plan.steps, &mut written)
    }

    fn follow(&self, steps: &[Step], written: &mut HashSet<Piece>) -> Check {
        for (i, step) in steps.iter().enumerate() {
            if let Step::Repeat { iterations, .. } = step {
                iterations.iter().try_for_each(|steps| self.follow(steps, written))?;
                continue;
            }
            let uses = self.uses(step);
            self.check(&uses, written)
                .map_err(|problem| format!("step {i}, {}: {problem}", self.plan.step_name(step)))?;
            written.extend(uses.iter().filter(|u| u.writes).map(|u| u.piece));
        }
        Ok(())
    }

    fn check(&self, uses: &[Use], written: &HashSet<Piece>) -> Check {
        for (i, a) in uses.iter().enumerate() {
            if uses[i + 1..].iter().any(|b| a.piece == b.piece && (a.writes || b.writes)) {
                return Err(format!("{} is written and used otherwise", self.describe(a.piece)));
            }
            if a.reads && !written.contains(&a.piece) {
                return Err(format!(
                    "{} is transient and read before any step has written it",
                    self.describe(a.piece)
                ));
            }
        }
        Ok(())
    }

    fn uses(&self, step: &Step) -> Vec<Use> {
        let mut uses = Vec::new();
        let mut add = |pieces: Vec<Piece>, reads, writes| {
            uses.extend(pieces.into_iter().map(|piece| Use { piece, reads, writes }));
        };
        match step {
            Step::Dispatch { pass, .. } => self.bound(pass, &mut add),
            Step::DispatchIndirect { pass, arguments, .. } => {
                self.bound(pass, &mut add);
                add(self.pieces(*arguments, None), true, false);
            }
            Step::Draw { pass, targets, .. } => {
                self.bound(pass, &mut add);
                drawn(targets, &mut add);
            }
            Step::DrawIndirect { pass, targets, arguments, .. } => {
                self.bound(pass, &mut add);
                drawn(targets, &mut add);
                add(self.pieces(*arguments, None), true, false);
            }
            Step::ClearBuffer { buffer } => add(self.pieces(*buffer, None), false, true),
            Step::CopyBuffer { source, target, .. } => {
                add(self.pieces(*source, None), true, false);
                add(self.pieces(*target, None), false, true);
            }
            Step::CopyTexture { source, source_part, target, target_part } => {
                add(self.pieces(*source, Some(*source_part)), true, false);
                add(self.pieces(*target, Some(*target_part)), false, true);
            }
            Step::Repeat { .. } => {}
        }
        uses
    }

    fn bound(&self, step: &PassStep, add: &mut impl FnMut(Vec<Piece>, bool, bool)) {
        let bindings = self.passes.get(&step.pass).map_or(&[][..], |p| p.bindings);
        for (binding, bound) in bindings.iter().zip(&step.bindings) {
            let (reads, writes) = match binding.kind {
                BindingKind::Read
                | BindingKind::ReadAtomic
                | BindingKind::Texture { .. }
                | BindingKind::DepthTexture => (true, false),
                BindingKind::Write | BindingKind::StorageTexture { .. } => (false, true),
                // Adding needs something to add to.
                BindingKind::Atomic => (true, true),
                BindingKind::Sampler { .. } => continue,
            };
            add(self.pieces(bound.resource, bound.part), reads, writes);
        }
    }

    fn pieces(&self, id: ResourceId, part: Option<Subresource>) -> Vec<Piece> {
        match self.plan.resources[id.0 as usize].kind {
            ResourceKind::Texture { layers, mips, .. } => {
                let part = part.unwrap_or(Subresource { base_mip: 0, mips, base_layer: 0, layers });
                (part.base_layer..part.base_layer + part.layers)
                    .flat_map(|layer| {
                        (part.base_mip..part.base_mip + part.mips).map(move |mip| (id, mip, layer))
                    })
                    .collect()
            }
            _ => vec![(id, 0, 0)],
        }
    }

    fn describe(&self, (id, mip, layer): Piece) -> String {
        let resource = &self.plan.resources[id.0 as usize];
        match resource.kind {
            ResourceKind::Texture { layers: 1, mips: 1, .. } | ResourceKind::Buffer { .. } => {
                format!("{:?}", resource.name)
            }
            _ => format!("level {mip} of layer {layer} of {:?}", resource.name),
        }
    }
}

fn drawn(targets: &Targets, add: &mut impl FnMut(Vec<Piece>, bool, bool)) {
    for target in targets.color.iter().chain(&targets.depth) {
        add(vec![(target.texture, target.mip, target.layer)], target.load == Load::Keep, true);
    }
}
