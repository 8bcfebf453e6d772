use crate::{ExecuteError, Limits, PassSet, Plan};
impl Plan {
    /// Check.
    pub fn validate(&self, _: &PassSet, _: &Limits) -> Result<(), ExecuteError> { Ok(()) }
}
