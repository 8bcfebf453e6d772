//! Steps: passes, counts, targets, copies.

use super::{Check, Checker};
use crate::{
    DepthTest, Load, PassInfo, PassKind, PassStep, ResourceId, Step, Subresource, Target, Targets,
    TextureFormat,
};

impl Checker<'_> {
    /// Check steps inside a repeat of so many iterations, or outside any.
    pub(super) fn steps(&self, steps: &[Step], iterations: Option<usize>) -> Check {
        for (i, step) in steps.iter().enumerate() {
            self.step(step, iterations)
                .map_err(|problem| format!("step {i}, {}: {problem}", self.plan.step_name(step)))?;
        }
        Ok(())
    }

    fn step(&self, step: &Step, iterations: Option<usize>) -> Check {
        match step {
            Step::Dispatch { pass, groups } => {
                self.compute(pass, iterations)?;
                let max = self.limits.max_groups_per_dimension;
                if groups.iter().any(|&g| g > max) {
                    return Err(format!("{groups:?} workgroups, the limit is {max} per dimension"));
                }
                Ok(())
            }
            Step::DispatchIndirect { pass, arguments, offset_bytes } => {
                self.compute(pass, iterations)?;
                self.arguments(*arguments, *offset_bytes, 3)
            }
            Step::Draw { pass, targets, vertices, .. } => {
                self.draw(pass, targets, iterations)?;
                if vertices % 3 != 0 {
                    return Err(format!("{vertices} vertices are not whole triangles"));
                }
                Ok(())
            }
            Step::DrawIndirect { pass, targets, arguments, offset_bytes } => {
                self.draw(pass, targets, iterations)?;
                self.arguments(*arguments, *offset_bytes, 4)
            }
            Step::ClearBuffer { buffer } => self.buffer(*buffer).map(drop),
            Step::CopyBuffer { source, source_offset_bytes, target, target_offset_bytes, size_bytes } => {
                if source == target {
                    return Err("copies within one buffer are not possible".into());
                }
                self.range(*source, *source_offset_bytes, *size_bytes)?;
                self.range(*target, *target_offset_bytes, *size_bytes)
            }
            Step::CopyTexture { source, source_part, target, target_part } => {
                self.copy_texture((*source, *source_part), (*target, *target_part))
            }
            Step::Repeat { iterations, .. } => {
                let count = iterations.len();
                iterations.iter().enumerate().try_for_each(|(i, steps)| {
                    self.steps(steps, Some(count)).map_err(|problem| format!("iteration {i}, {problem}"))
                })
            }
        }
    }

    fn compute(&self, step: &PassStep, iterations: Option<usize>) -> Check {
        let info = self.pass(step, iterations)?;
        match info.kind {
            PassKind::Compute { .. } => Ok(()),
            PassKind::Draw { .. } => Err(format!("pass {:?} draws and cannot be dispatched", info.name)),
        }
    }

    fn pass(&self, step: &PassStep, iterations: Option<usize>) -> Result<&'static PassInfo, String> {
        let info = self.passes.get(&step.pass).ok_or_else(|| format!("no pass is named {:?}", step.pass))?;
        self.params(info, step, iterations)?;
        self.bindings(info, step)?;
        Ok(info)
    }

    fn params(&self, info: &PassInfo, step: &PassStep, iterations: Option<usize>) -> Check {
        let id = match (step.params, info.params_bytes) {
            (None, 0) => return Ok(()),
            (Some(_), 0) => return Err(format!("pass {:?} has no params", info.name)),
            (None, _) => return Err(format!("pass {:?} needs params {}", info.name, info.params_struct)),
            (Some(id), _) => id,
        };
        let params = self.plan.params.get(id.0 as usize).ok_or_else(|| {
            format!("params {} do not exist, the plan has {}", id.0, self.plan.params.len())
        })?;
        if params.stride_bytes != info.params_bytes {
            return Err(format!(
                "params {:?} have {} bytes, {} has {}",
                params.name, params.stride_bytes, info.params_struct, info.params_bytes
            ));
        }
        let blocks = params.bytes.len() / params.stride_bytes as usize;
        let wanted = iterations.unwrap_or(1);
        if blocks != 1 && blocks != wanted {
            return Err(format!("params {:?} have {blocks} blocks for {wanted} iterations", params.name));
        }
        Ok(())
    }

    fn draw(&self, step: &PassStep, targets: &Targets, iterations: Option<usize>) -> Check {
        let info = self.pass(step, iterations)?;
        let PassKind::Draw { targets: formats, depth, .. } = info.kind else {
            return Err(format!("pass {:?} is dispatched and cannot draw", info.name));
        };
        if targets.color.len() != formats.len() {
            return Err(format!("{} colour targets, the pass writes {}", targets.color.len(), formats.len()));
        }
        let mut size = None;
        for (target, &format) in targets.color.iter().zip(formats) {
            self.target(target, format, &mut size)?;
        }
        match (&targets.depth, depth) {
            (None, None) => {}
            (Some(target), Some(test)) => {
                self.target(target, TextureFormat::Depth32Float, &mut size)?;
                cleared_depth(target.load, test)?;
            }
            (None, Some(_)) => return Err("the pass tests depth, but there is no depth target".into()),
            (Some(_), None) => return Err("there is a depth target, but the pass tests no depth".into()),
        }
        if size.is_none() {
            return Err("a draw without targets".into());
        }
        Ok(())
    }

    /// Check a target; all targets must have the `size` of the first.
    fn target(&self, target: &Target, format: TextureFormat, size: &mut Option<[u32; 2]>) -> Check {
        let texture = self.texture(target.texture)?;
        if texture.format != format {
            return Err(format!(
                "target {:?} is {:?}, the pass writes {format:?}",
                texture.name, texture.format
            ));
        }
        texture.part(Some(Subresource {
            base_mip: target.mip,
            mips: 1,
            base_layer: target.layer,
            layers: 1,
        }))?;
        let [width, height] = texture.size_of(target.mip);
        let [first_width, first_height] = *size.get_or_insert([width, height]);
        if [width, height] != [first_width, first_height] {
            return Err(format!(
                "target {:?} is {width} x {height}, the first one {first_width} x {first_height}",
                texture.name
            ));
        }
        Ok(())
    }

    fn arguments(&self, buffer: ResourceId, offset_bytes: u64, words: u64) -> Check {
        self.range(buffer, offset_bytes, words * 4)
    }

    fn range(&self, buffer: ResourceId, offset_bytes: u64, bytes: u64) -> Check {
        let size = self.buffer(buffer)?;
        if !offset_bytes.is_multiple_of(4) || !bytes.is_multiple_of(4) {
            return Err(format!("{bytes} bytes at {offset_bytes}: both must be multiples of 4"));
        }
        if offset_bytes.checked_add(bytes).is_none_or(|end| end > size) {
            let name = &self.resource(buffer)?.name;
            return Err(format!("{bytes} bytes at {offset_bytes} of {name:?}, which has {size}"));
        }
        Ok(())
    }

    fn copy_texture(&self, source: (ResourceId, Subresource), target: (ResourceId, Subresource)) -> Check {
        let (from, to) = (self.texture(source.0)?, self.texture(target.0)?);
        let (from_part, to_part) = (from.single(Some(source.1))?, to.single(Some(target.1))?);
        if from.format != to.format {
            return Err(format!("{:?} cannot be copied to {:?}", from.format, to.format));
        }
        let (a, b) = (from.size_of(from_part.base_mip), to.size_of(to_part.base_mip));
        if a != b {
            return Err(format!("{} x {} texels cannot be copied to {} x {}", a[0], a[1], b[0], b[1]));
        }
        if source == target {
            return Err(format!("{:?} is copied to itself", from.name));
        }
        Ok(())
    }
}

/// A depth target must be cleared to the loser's depth, or every fragment fails.
fn cleared_depth(load: Load, test: DepthTest) -> Check {
    let Load::Clear([depth, ..]) = load else { return Ok(()) };
    let loser = match test {
        DepthTest::Less => 1.0,
        DepthTest::Greater => 0.0,
    };
    if depth != loser {
        return Err(format!("depth is cleared to {depth}, but {test:?} needs {loser}"));
    }
    Ok(())
}
