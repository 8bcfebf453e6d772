//! The oracle: f64 light tracing and eye rays through exact meshes.
