//! Moving what a plan shows, without building it anew on the device.

use frame_plan::{ExecuteError, Executor, Params, ParamsId, Plan, Resource, ResourceId};

/// Why a prepared plan could not be moved on to another one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum UpdateError {
    /// The plans differ in more than numbers: prepare the new one.
    #[error("the plan's structure changed ({what}): it must be prepared anew")]
    StructureChanged {
        /// What differs first.
        what: String,
    },
    /// The executor failed.
    #[error(transparent)]
    Execute(#[from] ExecuteError),
}

/// Brings an executor that has `current` prepared to `next`: parameters and buffer contents that differ are written, nothing is
/// allocated or compiled on the device. For lights, cameras and objects that move, and materials that change their colour.
///
/// `current` becomes `next`, unless there is an error.
///
/// # Errors
/// [`UpdateError::StructureChanged`] before anything is written.
pub(crate) fn update(executor: &mut dyn Executor, current: &mut Plan, next: Plan) -> Result<(), UpdateError> {
    if let Some(what) = structure_change(current, &next) {
        return Err(UpdateError::StructureChanged { what });
    }
    Ok(write_changes(executor, current, next)?)
}

/// What differs first between two plans apart from their numbers: such plans cannot be moved on to each other.
pub(crate) fn structure_change(current: &Plan, next: &Plan) -> Option<String> {
    if current.steps != next.steps {
        let same = current.steps.iter().zip(&next.steps).take_while(|(a, b)| a == b).count();
        return Some(format!("step {same}"));
    }
    if current.resources.len() != next.resources.len() || current.params.len() != next.params.len() {
        return Some("number of resources".into());
    }
    let filled = |r: &Resource| r.initial.as_ref().map(Vec::len);
    let resource_differs = |(a, b): &(&Resource, &Resource)| {
        (&a.name, &a.kind, a.lifetime, a.readable, filled(a))
            != (&b.name, &b.kind, b.lifetime, b.readable, filled(b))
    };
    if let Some((_, b)) = current.resources.iter().zip(&next.resources).find(resource_differs) {
        return Some(format!("resource {}", b.name));
    }
    let params_differ = |(a, b): &(&Params, &Params)| {
        (&a.name, a.stride_bytes, a.bytes.len()) != (&b.name, b.stride_bytes, b.bytes.len())
    };
    let (_, b) = current.params.iter().zip(&next.params).find(params_differ)?;
    Some(format!("params {}", b.name))
}

/// As [`update`], between plans of one structure.
pub(crate) fn write_changes(
    executor: &mut dyn Executor,
    current: &mut Plan,
    next: Plan,
) -> Result<(), ExecuteError> {
    for (i, (a, b)) in current.params.iter().zip(&next.params).enumerate() {
        if a.bytes != b.bytes {
            executor.set_params(ParamsId(i as u32), &b.bytes)?;
        }
    }
    for (i, (a, b)) in current.resources.iter().zip(&next.resources).enumerate() {
        if let (Some(a), Some(b)) = (&a.initial, &b.initial)
            && let Some(range) = differing_words(a, b)
        {
            executor.write_buffer(ResourceId(i as u32), range.start as u64, &b[range])?;
        }
    }
    *current = next;
    Ok(())
}

/// The shortest range of whole words outside of which equally long contents agree.
fn differing_words(a: &[u8], b: &[u8]) -> Option<std::ops::Range<usize>> {
    let first = a.iter().zip(b).position(|(a, b)| a != b)?;
    let last = a.iter().zip(b).rposition(|(a, b)| a != b)?;
    Some(first / 4 * 4..(last / 4 + 1) * 4)
}
