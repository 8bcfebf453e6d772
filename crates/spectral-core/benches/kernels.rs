//! What light transport calls most: Snell and Fresnel, spectra of colours, matrices, colour differences.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use spectral_core::color::{delta_e_2000, lab_from_xyz};
use spectral_core::matrices::SpectralMatrices;
use spectral_core::observer::{Observer, VISIBLE_NM};
use spectral_core::optics::{fresnel_dielectric, refract};
use spectral_core::rgb::{D65_WHITE_XYZ, RgbSpace};
use spectral_core::upsample::SmoothSpectrum;
use spectral_core::wavelengths::{Scheme, WavelengthSet};

/// Directions onto a surface that faces up, from perpendicular to almost grazing.
const DIRECTIONS: usize = 1024;
const UP: [f64; 3] = [0.0, 1.0, 0.0];

fn each<D: Copy, R>(directions: &[D], kernel: impl Fn(D) -> R) {
    for &direction in directions {
        black_box(kernel(direction));
    }
}

fn optics(criterion: &mut Criterion) {
    let sines = (0..DIRECTIONS).map(|i| i as f64 / DIRECTIONS as f64);
    let f64s: Vec<[f64; 3]> = sines.map(|s| [s, -(1.0 - s * s).sqrt(), 0.0]).collect();
    let f32s: Vec<[f32; 3]> = f64s.iter().map(|d| d.map(|c| c as f32)).collect();
    let mut group = criterion.benchmark_group("optics");
    group.throughput(Throughput::Elements(DIRECTIONS as u64));
    // Into glass, and out of it: half of the directions then reflect totally.
    for (name, eta) in [("into glass", 1.5), ("out of glass", 1.0 / 1.5)] {
        group.bench_function(format!("refract f64, {name}"), |b| {
            b.iter(|| each(&f64s, |d| refract(d, UP, black_box(eta))));
        });
        group.bench_function(format!("refract f32, {name}"), |b| {
            b.iter(|| each(&f32s, |d| refract(d, UP.map(|c| c as f32), black_box(eta as f32))));
        });
        group.bench_function(format!("fresnel f64, {name}"), |b| {
            b.iter(|| each(&f64s, |d| fresnel_dielectric(-d[1], black_box(eta))));
        });
    }
    group.finish();
}

fn spectra(criterion: &mut Criterion) {
    let color = [0.8, 0.2, 0.05];
    criterion
        .bench_function("spectrum of a colour", |b| b.iter(|| SmoothSpectrum::reflectance(black_box(color))));
    let spectrum = SmoothSpectrum::reflectance(color);
    criterion.bench_function("spectrum at a wavelength", |b| b.iter(|| spectrum.at(black_box(546.1))));
}

fn matrices(criterion: &mut Criterion) {
    for n in [7, 21] {
        let set = WavelengthSet::new(Scheme::Uniform, n, VISIBLE_NM, Observer::Cie1931)
            .expect("a set of that size exists");
        criterion.bench_function(&format!("{n} matrices K_n"), |b| {
            b.iter(|| SpectralMatrices::new(black_box(&set), &RgbSpace::SRGB));
        });
    }
}

fn color_difference(criterion: &mut Criterion) {
    let [a, b] = [[0.2, 0.3, 0.4], [0.25, 0.28, 0.45]].map(|xyz| lab_from_xyz(xyz, D65_WHITE_XYZ));
    criterion
        .bench_function("CIEDE2000", |bencher| bencher.iter(|| delta_e_2000(black_box(a), black_box(b))));
}

criterion_group!(kernels, optics, spectra, matrices, color_difference);
criterion_main!(kernels);
