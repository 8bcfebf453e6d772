//! Gap filling: what the paper's rules do to the light, and what exchange within a disc does.

use std::sync::atomic::{AtomicU32, Ordering};

use asm_core::passes::gap_fill::{ENERGY_ROWS, ENERGY_WORDS, GapFill, Inputs, gap_fill};
use asm_core::shared::gap::{
    GAP_DISC, GAP_PAPER, GAP_PAPER_LITERAL, MASK_BESIDE, MASK_DARK, MASK_GAP, MASK_LIT,
};
use asm_core::{GapEnergy, GapFilling, Method, Settings};
use glam::{DVec3, IVec2, UVec2};
use spectral_core::color::{delta_e_2000, lab_from_xyz};
use spectral_core::wavelengths::Scheme;
use spectral_scene::{IrradianceMaps, bundled};

use crate::stage::*;

/// A small map, run through the rule with radius 2.
struct Small {
    size: UVec2,
    rows: u32,
    texels: Vec<[u64; 3]>,
    mask: Vec<u32>,
}

impl Small {
    fn new(size: UVec2, faces: u32, texel: impl Fn(UVec2) -> u64) -> Self {
        let rows = size.y * faces;
        let at = (0..rows).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y)));
        let texels: Vec<[u64; 3]> = at.map(|at| [texel(at), 2 * texel(at), texel(at) / 3]).collect();
        let mask = texels.iter().map(|t| if *t == [0; 3] { MASK_DARK } else { MASK_LIT }).collect();
        Self { size, rows, texels, mask }
    }

    fn fill(&self, rule: u32, samples: u32, threshold: u32) -> Vec<[u64; 3]> {
        // All that is lit takes part, gap or not.
        let beside = |&m: &u32| if m == MASK_LIT && rule == GAP_DISC { MASK_BESIDE } else { m };
        let mask: Vec<u32> = self.mask.iter().map(beside).collect();
        let words = |t: &u64| [AtomicU32::new(*t as u32), AtomicU32::new((*t >> 32) as u32)];
        let map: Vec<AtomicU32> = self.texels.iter().flatten().flat_map(words).collect();
        let offsets: Vec<IVec2> = (-2..=2)
            .flat_map(|y| (-2..=2).map(move |x| IVec2::new(x, y)))
            .filter(|d| *d != IVec2::ZERO && d.length_squared() <= 4)
            .collect();
        let params = GapFill {
            size: self.size,
            rows: self.rows,
            rule,
            samples,
            threshold,
            offsets: offsets.len() as u32,
            share: 65_536 / (offsets.len() as u32 + 1),
            first_row: 0,
            reserved0: 0,
            reserved1: 0,
            reserved2: 0,
        };
        let zeros = |n: usize| -> Vec<AtomicU32> { (0..n).map(|_| AtomicU32::new(0)).collect() };
        let (filled, energy) = (zeros(map.len()), zeros(ENERGY_ROWS * ENERGY_WORDS));
        gap_fill(&Inputs { params, map: &map, offsets: &offsets, mask: &mask }, &filled, &energy);
        let word = |w: &AtomicU32| u64::from(w.load(Ordering::Relaxed));
        let texels: Vec<[u64; 3]> = filled
            .chunks_exact(6)
            .map(|t| std::array::from_fn(|c| word(&t[2 * c]) | word(&t[2 * c + 1]) << 32))
            .collect();
        for (rows, of) in [(0, &self.texels), (3, &texels)] {
            for c in 0..3 {
                let words = &energy[ENERGY_WORDS * (rows + c)..];
                let booked = (0..3).rev().fold(0_u128, |n, w| n << 32 | u128::from(word(&words[w])));
                assert_eq!(booked, of.iter().map(|t| u128::from(t[c])).sum::<u128>());
            }
        }
        texels
    }
}

fn sums(texels: &[[u64; 3]]) -> [u128; 3] {
    std::array::from_fn(|c| texels.iter().map(|t| u128::from(t[c])).sum())
}

#[test]
fn exchange_keeps_every_unit_and_leaves_what_is_even() {
    let size = UVec2::new(13, 11);
    // As large as a map's numbers get, and odd.
    let mut stripes =
        Small::new(size, 1, |at| if at.x % 3 == 0 { 0x0fff_ffff_ffff_fff1 / u64::from(at.y + 1) } else { 0 });
    for (i, mask) in stripes.mask.iter_mut().enumerate() {
        let x = i % 13;
        if *mask == MASK_DARK && (1..12).contains(&x) {
            *mask = MASK_GAP;
        }
    }
    let filled = stripes.fill(GAP_DISC, 1, 1);
    assert_eq!(sums(&filled), sums(&stripes.texels));
    assert!(filled.iter().zip(&stripes.mask).all(|(t, m)| (*t == [0; 3]) == (*m == MASK_DARK)));
    // Within an even region nothing moves, edges included, and nothing leaves it.
    let even = Small::new(size, 1, |at| if at.x < 6 && at.y > 2 { 999_999_999_937 } else { 0 });
    assert_eq!(even.fill(GAP_DISC, 1, 1), even.texels);
}

#[test]
fn faces_of_a_map_do_not_leak_into_each_other() {
    let faces = Small::new(UVec2::new(6, 4), 2, |at| if at.y < 4 { 5_000_000 } else { 0 });
    let mut gaps = Small { mask: faces.mask.clone(), texels: faces.texels.clone(), ..faces };
    gaps.mask.iter_mut().filter(|m| **m == MASK_DARK).for_each(|m| *m = MASK_GAP);
    for rule in [GAP_DISC, GAP_PAPER, GAP_PAPER_LITERAL] {
        let filled = gaps.fill(rule, 12, 1);
        assert!(filled[24..].iter().all(|t| *t == [0; 3]), "rule {rule}");
    }
}

#[test]
fn the_papers_rules_are_means_and_sums_of_hits() {
    // Everything lit alike: all samples inside hit.
    let even = Small::new(UVec2::splat(16), 1, |_| 700);
    let inner = |texels: &[[u64; 3]]| texels[8 * 16 + 8];
    assert_eq!(inner(&even.fill(GAP_PAPER, 12, 12)), inner(&even.texels));
    assert_eq!(inner(&even.fill(GAP_PAPER_LITERAL, 12, 11)), inner(&even.texels).map(|v| 12 * v));
    // As printed: more than the threshold, not as many.
    assert_eq!(even.fill(GAP_PAPER_LITERAL, 12, 12), even.texels);
    // A dark texel among lit ones gets the hits' mean, not diluted by itself.
    let hole = Small::new(UVec2::splat(16), 1, |at| if at == UVec2::splat(8) { 0 } else { 700 });
    assert_eq!(inner(&hole.fill(GAP_PAPER, 12, 12)), inner(&even.texels));
    // Too few hits: as before.
    let lone = Small::new(UVec2::splat(16), 1, |at| if at == UVec2::splat(8) { 700 } else { 0 });
    assert_eq!(lone.fill(GAP_PAPER, 12, 10), lone.texels);
}

#[test]
fn a_map_of_one_texel_is_left_alone() {
    let one = Small::new(UVec2::ONE, 1, |_| 12_345);
    for rule in [GAP_DISC, GAP_PAPER, GAP_PAPER_LITERAL] {
        assert_eq!(one.fill(rule, 15, 10), one.texels, "rule {rule}");
    }
}

fn asm(gap_filling: GapFilling) -> Settings {
    Settings {
        gap_filling: Some(gap_filling),
        emission_size: 256,
        map_size: Some(256),
        ..Settings::of(Method::Asm)
    }
}

fn filled(scene: &str, settings: &Settings) -> (IrradianceMaps, Option<GapEnergy>) {
    let (maps, statistics) = bake(&bundled(scene).unwrap(), 128, settings);
    (maps, statistics.lights[0].gap_filling)
}

#[test]
fn only_the_disc_keeps_the_light_of_a_map() {
    assert_eq!(filled("prism", &asm(GapFilling::None)).1, None);
    let energy = |rule| filled("prism", &asm(rule)).1.unwrap();
    let disc = energy(GapFilling::Disc);
    assert_eq!(disc.before_xyz, disc.after_xyz);
    assert!(disc.lit_after > disc.lit_before, "{disc:?}");
    let ratio = |e: &GapEnergy| e.after_xyz[1] / e.before_xyz[1];
    let (paper, literal) = (energy(GapFilling::Paper), energy(GapFilling::PaperLiteral));
    println!("paper {} literal {}", ratio(&paper), ratio(&literal));
    // The sum of up to 15 hits instead of their mean.
    assert!(ratio(&literal) > 5.0 * ratio(&paper), "{paper:?} {literal:?}");
    assert!((ratio(&paper) - 1.0).abs() > 1e-3, "{paper:?}");
}

/// Mean CIEDE2000 over texels that hold light in either.
fn delta_e(a: &IrradianceMaps, b: &IrradianceMaps) -> f64 {
    let brightest = b.refracted.iter().map(|t| f64::from(t[1])).fold(0.0, f64::max);
    let lab = |t: &[f32; 3]| lab_from_xyz(t.map(|v| f64::from(v) / brightest), D65);
    let texels: Vec<f64> = a
        .refracted
        .iter()
        .zip(&b.refracted)
        .filter(|(a, b)| f64::from(a[1].max(b[1])) > 0.01 * brightest)
        .map(|(a, b)| delta_e_2000(lab(a), lab(b)))
        .collect();
    texels.iter().sum::<f64>() / texels.len() as f64
}

/// A map of many wavelengths, which leave no gaps.
fn dense(scene: &str) -> IrradianceMaps {
    let settings = Settings {
        wavelengths: Some(64),
        scheme: Some(Scheme::Uniform),
        range_nm: Some((380.0, 780.0)),
        ..asm(GapFilling::None)
    };
    filled(scene, &settings).0
}

const RULES: [GapFilling; 4] =
    [GapFilling::None, GapFilling::Paper, GapFilling::PaperLiteral, GapFilling::Disc];

#[test]
fn a_filled_spectrum_is_closer_to_a_dense_one() {
    let dense = dense("prism");
    let maps = RULES.map(|rule| filled("prism", &asm(rule)).0);
    let [none, paper, literal, disc] = maps.each_ref().map(|m| delta_e(m, &dense));
    println!("prism, mean CIEDE2000: none {none} paper {paper} literal {literal} disc {disc}");
    assert!(disc < 0.7 * none, "mean CIEDE2000: none {none}, disc {disc}");
    assert!(disc < literal, "disc {disc}, literal {literal}");
    let [none, paper, literal, disc] =
        maps.each_ref().map(|m| relative_rms(&m.refracted, &dense.refracted, 64));
    println!("prism, RMS of Y at 64: none {none} paper {paper} literal {literal} disc {disc}");
    assert!(disc < 0.5 * none && disc < literal, "RMS: none {none}, disc {disc}, literal {literal}");
}

#[test]
fn a_caustic_without_gaps_stays_sharp() {
    let dense = dense("sphere");
    let rms = |rule| relative_rms(&filled("sphere", &asm(rule)).0.refracted, &dense.refracted, 64);
    let [none, paper, literal, disc] = RULES.map(rms);
    println!("sphere, RMS of Y at 64: none {none} paper {paper} literal {literal} disc {disc}");
    assert!(disc < 0.001, "none {none}, disc {disc}");
    assert!(disc < 0.01 * paper && disc < literal, "paper {paper}, literal {literal}, disc {disc}");
}

#[test]
fn white_stays_white_and_wavelengths_alike_leave_nothing_to_fill() {
    // Without dispersion every wavelength lands where the others do, whatever is done to gaps in space.
    let scene = plate_over_floor(glass(1.5), 0.5, sun(DVec3::new(0.3, -1.0, 0.2)));
    for rule in [GapFilling::Disc, GapFilling::Paper, GapFilling::PaperLiteral] {
        let settings = Settings { prune: false, ..asm(rule) };
        let (maps, statistics) = bake(&scene, 64, &settings);
        assert!(statistics.lights[0].gap_filling.is_some());
        let brightest = maps.refracted.iter().map(|t| t[1]).fold(0.0, f32::max);
        for texel in maps.refracted.iter().filter(|t| t[1] > 1e-4 * brightest) {
            for c in 0..3 {
                let off = f64::from(texel[c] / texel[1]) / D65[c] - 1.0;
                assert!(off.abs() < 1e-5, "{rule:?}: {texel:?}");
            }
        }
        // One wavelength gives the same picture.
        let one = bake(&scene, 64, &Settings { wavelengths: Some(1), ..settings.clone() }).0;
        let rms = relative_rms(&one.refracted, &maps.refracted, 64);
        assert!(rms < 1e-5, "{rule:?}: {rms}");
        // With pruning there is neither.
        let pruned = bake(&scene, 64, &Settings { prune: true, ..settings }).1;
        assert_eq!(pruned.lights[0].ledgers.len(), 1);
        assert_eq!(pruned.lights[0].gap_filling, None);
    }
}
