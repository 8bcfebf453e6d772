//! Reflectances that match under one light and differ under another, as METACOW's halves do (Fairchild & Johnson 2004).

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, ZeroConeT,
};
use spectral_core::color::{delta_e_2000, lab_jacobian};
use spectral_core::grid::SpectralGrid;
use spectral_core::mat3;
use spectral_core::observer::Observer;
use spectral_core::patch::{Shown, light_xyz, sampled_xyz};
use spectral_core::rgb::D65_WHITE_XYZ;

/// Directions of CIELAB in which a metamer is sought, and their opposites: axes and diagonals.
const DIRECTIONS: [[f64; 3]; 13] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
    [0.0, 1.0, -1.0],
    [1.0, 1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 0.0, 1.0],
    [1.0, 0.0, -1.0],
    [1.0, 1.0, 1.0],
    [1.0, 1.0, -1.0],
    [1.0, -1.0, 1.0],
    [1.0, -1.0, -1.0],
];

/// What a metamer may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetamerSettings {
    /// Least and most reflectance; where the standard is beyond, its own is the bound.
    pub reflectances: [f64; 2],
    /// Most that its difference from the standard bends: second derivative by the wavelength, 1/nm^2.
    pub most_bend_per_nm2: f64,
}

impl Default for MetamerSettings {
    /// 0.01 to 0.95, as paints have them, and bends of 2e-4 / nm^2: a bump of 0.1 is 60 nm wide or wider.
    fn default() -> Self {
        Self { reflectances: [0.01, 0.95], most_bend_per_nm2: 2e-4 }
    }
}

/// A reflectance that matches another one.
#[derive(Clone, Debug, PartialEq)]
pub struct Metamer {
    /// 0 to 1, at each wavelength of the grid.
    pub reflectance: Vec<f64>,
    /// CIEDE2000 from the standard where it matches: rounding.
    pub matched_delta_e: f64,
    /// CIEDE2000 from the standard under the light in which it shows.
    pub shown_delta_e: f64,
}

/// Why there is no metamer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MetamerError {
    /// A spectrum is on another grid.
    #[error("{what} has {got} values, the grid {samples} wavelengths")]
    Samples {
        /// Which spectrum.
        what: &'static str,
        /// Its values.
        got: usize,
        /// Wavelengths of the grid.
        samples: usize,
    },
    /// A light is dark, or of no colour that the display's white can be made of.
    #[error("the {0} light has no white: it needs luminance, and finite cone responses other than 0")]
    Light(&'static str),
    /// The standard is no reflectance.
    #[error("the standard reflects {value} at {lambda_nm} nm; reflectances are 0 to 1")]
    Standard {
        /// What it has, not from 0 to 1.
        value: f64,
        /// Where, nm.
        lambda_nm: f64,
    },
    /// The limit on bends is no positive number.
    #[error("bends up to {0} / nm^2 make no sense; the limit is a positive number")]
    Bend(f64),
    /// The optimiser gave up.
    #[error("the optimiser found no metamer: {0}")]
    Unsolved(String),
}

/// The reflectance that has the standard's XYZ under the light `matched` and is seen to differ most under `shown`, among
/// smooth ones with values in bounds.
///
/// The difference in a direction of CIELAB, linear about the standard, is maximised for 26 directions, each a linear
/// program; of the answers the one with the largest CIEDE2000 is taken, both sides white-balanced by Bradford to D65.
///
/// # Errors
/// [`MetamerError`] for spectra that are none. A standard that has no smooth metamer is not an error: it is its own.
pub fn metamer(
    grid: &SpectralGrid,
    observer: Observer,
    standard: &[f64],
    matched: &[f64],
    shown: &[f64],
    settings: MetamerSettings,
) -> Result<Metamer, MetamerError> {
    check(grid, standard, matched, shown, settings)?;
    let balanced =
        |light: &[f64], name| Shown::under(light_xyz(grid, observer, light)).ok_or(MetamerError::Light(name));
    let (match_shown, other_shown) = (balanced(matched, "matched")?, balanced(shown, "shown")?);
    let difference = |balance: &Shown, light: &[f64], reflectance: &[f64]| {
        let lab = |r: &[f64]| balance.lab(sampled_xyz(grid, observer, r, light));
        delta_e_2000(lab(standard), lab(reflectance))
    };

    let program = Program::new(grid, standard, &responses(grid, observer, matched, &match_shown), settings);
    let displayed = responses(grid, observer, shown, &other_shown);
    let seen = mat3::apply(&other_shown.display_from_light(), sampled_xyz(grid, observer, standard, shown));
    let lab_from_xyz = lab_jacobian(seen, D65_WHITE_XYZ);
    let mut best: Option<(f64, Vec<f64>)> = None;
    for direction in DIRECTIONS {
        // Row of CIELAB's change by the reflectance at each wavelength.
        let weights: [f64; 3] =
            [0, 1, 2].map(|c| (0..3).map(|lab| direction[lab] * lab_from_xyz[lab][c]).sum());
        let gain: Vec<f64> = displayed.iter().map(|xyz| (0..3).map(|c| weights[c] * xyz[c]).sum()).collect();
        for sign in [1.0, -1.0] {
            let reflectance = program.most(&gain, sign)?;
            let delta_e = difference(&other_shown, shown, &reflectance);
            if best.as_ref().is_none_or(|(most, _)| delta_e > *most) {
                best = Some((delta_e, reflectance));
            }
        }
    }
    let (shown_delta_e, reflectance) = best.expect("there are directions");
    Ok(Metamer {
        matched_delta_e: difference(&match_shown, matched, &reflectance),
        shown_delta_e,
        reflectance,
    })
}

fn check(
    grid: &SpectralGrid,
    standard: &[f64],
    matched: &[f64],
    shown: &[f64],
    settings: MetamerSettings,
) -> Result<(), MetamerError> {
    for (what, spectrum) in
        [("the standard", standard), ("the matched light", matched), ("the shown light", shown)]
    {
        if spectrum.len() != grid.samples() {
            return Err(MetamerError::Samples { what, got: spectrum.len(), samples: grid.samples() });
        }
    }
    if let Some(i) = standard.iter().position(|r| !(0.0..=1.0).contains(r)) {
        return Err(MetamerError::Standard { value: standard[i], lambda_nm: grid.lambda_nm(i) });
    }
    if !(settings.most_bend_per_nm2.is_finite() && settings.most_bend_per_nm2 > 0.0) {
        return Err(MetamerError::Bend(settings.most_bend_per_nm2));
    }
    Ok(())
}

/// XYZ as displayed, white at Y = 1, of a reflectance of 1 at each wavelength alone.
fn responses(grid: &SpectralGrid, observer: Observer, light: &[f64], shown: &Shown) -> Vec<[f64; 3]> {
    (0..grid.samples())
        .map(|i| {
            let power = light[i] * grid.step_nm();
            let xyz = observer.xyz_bar(grid.lambda_nm(i)).map(|bar| bar * power);
            mat3::apply(&shown.display_from_light(), xyz)
        })
        .collect()
}

/// The linear program over differences from the standard: A d + s = b with s = 0 in the first three rows, s >= 0 below.
struct Program<'a> {
    standard: &'a [f64],
    constraints: CscMatrix<f64>,
    bounds: Vec<f64>,
}

impl<'a> Program<'a> {
    fn new(
        grid: &SpectralGrid,
        standard: &'a [f64],
        matched: &[[f64; 3]],
        settings: MetamerSettings,
    ) -> Self {
        let samples = grid.samples();
        let (mut entries, mut bounds) = (Vec::new(), vec![0.0; 3]);
        for (i, xyz) in matched.iter().enumerate() {
            entries.extend(xyz.iter().enumerate().map(|(c, v)| (c, i, *v)));
        }
        let [least, most] = settings.reflectances;
        for (i, r) in standard.iter().enumerate() {
            for (sign, room) in [(1.0, most - r), (-1.0, r - least)] {
                entries.push((bounds.len(), i, sign));
                bounds.push(room.max(0.0));
            }
        }
        let bend = settings.most_bend_per_nm2 * grid.step_nm().powi(2);
        for i in 1..samples - 1 {
            for sign in [1.0, -1.0] {
                let row = bounds.len();
                entries.extend([(row, i - 1, sign), (row, i, -2.0 * sign), (row, i + 1, sign)]);
                bounds.push(bend);
            }
        }
        let (rows, columns, values): (Vec<_>, Vec<_>, Vec<_>) = entries.into_iter().collect();
        let constraints = CscMatrix::new_from_triplets(bounds.len(), samples, rows, columns, values);
        Self { standard, constraints, bounds }
    }

    /// The reflectance with the most of `sign` times the sum of gain and difference.
    fn most(&self, gain: &[f64], sign: f64) -> Result<Vec<f64>, MetamerError> {
        let unsolved = |why: &dyn std::fmt::Display| MetamerError::Unsolved(why.to_string());
        let samples = gain.len();
        let cost: Vec<f64> = gain.iter().map(|g| -sign * g).collect();
        let cones = [ZeroConeT(3), NonnegativeConeT(self.bounds.len() - 3)];
        let settings = DefaultSettingsBuilder::default()
            .verbose(false)
            .tol_feas(1e-12)
            .build()
            .map_err(|error| unsolved(&error))?;
        let mut solver = DefaultSolver::new(
            &CscMatrix::zeros((samples, samples)),
            &cost,
            &self.constraints,
            &self.bounds,
            &cones,
            settings,
        )
        .map_err(|error| unsolved(&error))?;
        solver.solve();
        match solver.solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved => {}
            status => return Err(unsolved(&format!("{status:?}"))),
        }
        let difference = &solver.solution.x;
        Ok(self.standard.iter().zip(difference).map(|(r, d)| (r + d).clamp(0.0, 1.0)).collect())
    }
}
