//! `spectral matrices`: a wavelength set with its K_n as a header.

use std::fmt::Write;

use spectral_core::header;
use spectral_core::matrices::SpectralMatrices;
use spectral_core::quality::EdgeReport;
use spectral_core::rgb::RgbSpace;
use spectral_core::wavelengths::{Scheme, WavelengthSet};

use crate::args::MatricesArgs;
use crate::error::CliError;
use crate::{messages, targets};

pub(crate) fn run(args: &MatricesArgs) -> Result<(), CliError> {
    let file = args.output.as_deref().map(targets::any).transpose()?;
    let count = args.wavelengths.unwrap_or(if args.scheme == Scheme::Fraunhofer { 3 } else { 7 });
    let range_nm = (args.range.low_nm, args.range.high_nm);
    let set = WavelengthSet::new(args.scheme, count, range_nm, args.cmf).map_err(CliError::usage)?;
    let matrices = SpectralMatrices::new(&set, &RgbSpace::SRGB).map_err(CliError::failed)?;
    let text = header::write(&set, &matrices, args.offsets, args.format);
    let Some(file) = file else { return messages::print(&text) };
    file.write(|content| content.write_all(text.as_bytes()))
        .map_err(|error| CliError::write(file.path(), &error))?;
    messages::print(&report(&set, &matrices))
}

/// What a set is worth, for people who look at the terminal and not into the file.
fn report(set: &WavelengthSet, matrices: &SpectralMatrices) -> String {
    let mut text = format!(
        "{} wavelengths, scheme {}, {}..{} nm, {}; f32 sum off the identity by {}\n\
         mean CIEDE2000 of a dispersed line against 1 nm sampling, by the distance of F and C:\n",
        set.len(),
        set.scheme,
        set.range_nm.0,
        set.range_nm.1,
        set.observer,
        matrices.sum_residual(),
    );
    for (spread_px, delta_e) in EdgeReport::new(set).iter() {
        writeln!(text, "  {spread_px:>4} px  {delta_e:.2}").expect("a String takes everything");
    }
    text
}
