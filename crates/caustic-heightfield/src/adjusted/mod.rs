//! Adjusted functions: arithmetic in frame buffers that hold numbers from 0 to 1 (sections 3.2 and 6 of the paper).
//!
//! Hardware of the year 2000 stored a few bits per pixel and clamped them to 0..1. A function f that leaves this range is stored
//! *adjusted*, f~ = alpha f + beta, and every sum and product has to be rewritten in terms of f~. The paper does so by hand and
//! wishes for "an expression compiler which, given the types and ranges of the components of an expression, automatically
//! computes the appropriate scale and bias". This is one:
//!
//! ```text
//! Expressions   sums, differences, products, multiples and tables of inputs of known range
//!      |  compiled for a Format: Fixed (4 to 16 bits), Float<f16>, Float<f32>
//!      v
//! Program       passes over the frame buffer, each with its range, alpha, beta and a bound on its error
//! ```
//!
//! | expression | pass | in the paper |
//! |---|---|---|
//! | sum of c_k f_k + c | sum of s_k f_k~ + b | `f + c`, `f + g`, `c f` of section 3.2; differences are sums with c = -1 |
//! | f g, g nowhere negative | g~ f~ + (1 - g~) beta: one blend | `f g` with unadjusted g |
//! | f g, both with either sign | f~ g~, then beta_g f~ + beta_f g~, then their difference: three passes | product of adjusted functions |
//! | any function of one or two | a table with an entry for each code | colour tables and pixel textures |
//!
//! What is rounded and clamped is what a pass stores, and tables are read at the nearest entry. Within a pass numbers are f64: of the
//! width of the pipeline's registers the paper says nothing. Ranges follow from those of the inputs by interval arithmetic, so no pass
//! can clamp as long as inputs keep theirs; a narrower range may be asked for where one is known.
//!
//! Bounds are worst cases that add up the worst of every pass; measured errors are some ten times smaller. Range and steepness of a
//! table are those of samples of its function (513 of one argument, 65 x 65 of two) with a margin for how curved it is there, so a bound
//! holds for functions that do nothing between samples that these do not show.

mod compile;
mod expression;
mod format;
mod interval;
mod program;
mod table;

pub use compile::Adjust;
pub use expression::{Expressions, Node};
pub use format::{F16, Fixed, Float, FloatCell, Format};
pub use interval::Interval;
pub use program::{PassReport, Program, Values};
