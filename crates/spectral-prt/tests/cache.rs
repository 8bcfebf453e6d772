//! Transfer on disk: the same bits, whatever happened to the file.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use glam::DVec3;
use proptest::prelude::*;
use spectral_core::grid::SpectralGrid;
use spectral_prt::cache::{Cached, content_hash, load_or_add_bounces, load_or_precompute};
use spectral_prt::{
    Bands, BounceSettings, PrtError, SpectralTransfer, Surface, Transfer, TransferSettings, add_bounces,
    precompute,
};

const GRID: SpectralGrid = SpectralGrid::SCHWENK_2010;

fn settings() -> TransferSettings {
    TransferSettings { bands: Bands::new(2).expect("1 to 10"), rays: 2 }
}

/// 3 x 1000 flat vertices: chunks of 1024, 1024 and 952.
const CHUNKS: usize = 3;

/// A fan of triangles that shade each other.
fn fan() -> Vec<Surface> {
    let positions: Vec<DVec3> = (0..1002)
        .map(|i| {
            let t = f64::from(i) * 0.05;
            DVec3::new(t.cos() * (1.0 + t), t.sin() * (1.0 + t), (3.0 * t).sin())
        })
        .collect();
    let triangles: Vec<[u32; 3]> = (0..1000).map(|i| [i, i + 1, i + 2]).collect();
    vec![Surface::new(&positions, &[], &triangles).expect("a mesh")]
}

fn cached(directory: &Path) -> Cached<Transfer> {
    load_or_precompute(directory, &fan(), &settings(), &mut |_| {}).expect("a cache")
}

fn counts(cached: &Cached<Transfer>) -> [usize; 3] {
    [cached.read_chunks, cached.computed_chunks, cached.damaged_chunks]
}

#[test]
fn the_second_run_reads_what_the_first_computed() {
    let directory = tempfile::tempdir().unwrap();
    let nested = directory.path().join("not/there/yet");
    let first = cached(&nested);
    assert_eq!(counts(&first), [0, CHUNKS, 0]);
    assert_eq!(first.transfer, precompute(&fan(), &settings(), &mut |_| {}).unwrap());
    let second = cached(&nested);
    assert_eq!(counts(&second), [CHUNKS, 0, 0]);
    assert_eq!(first.transfer, second.transfer);
    assert!(first.transfer.surface(0).iter().any(|&t| t != 0.0));
}

#[test]
fn a_run_that_dies_keeps_every_finished_chunk() {
    let directory = tempfile::tempdir().unwrap();
    let died = catch_unwind(AssertUnwindSafe(|| {
        load_or_precompute(directory.path(), &fan(), &settings(), &mut |share| assert!(share < 0.5, "killed"))
    }));
    assert!(died.is_err());
    assert_eq!(counts(&cached(directory.path())), [2, 1, 0]);
    assert_eq!(counts(&cached(directory.path())), [CHUNKS, 0, 0]);
}

#[test]
fn another_mesh_or_setting_is_another_file() {
    let base = content_hash(&fan(), &settings());
    let mut moved: Vec<DVec3> = fan()[0].positions().to_vec();
    moved[17].x = moved[17].x.next_up();
    let triangles = fan()[0].triangles().to_vec();
    let other = Surface::new(&moved, fan()[0].normals(), &triangles).unwrap();
    let mut hashes = vec![
        base,
        content_hash(&[other], &settings()),
        content_hash(&fan(), &TransferSettings { rays: 3, ..settings() }),
        content_hash(&fan(), &TransferSettings { bands: Bands::MAX, ..settings() }),
        content_hash(&[fan(), fan()].concat(), &settings()),
    ];
    hashes.sort_unstable();
    hashes.dedup();
    assert_eq!(hashes.len(), 5);
    assert_eq!(base, content_hash(&fan(), &settings()));
}

#[test]
fn a_directory_that_is_a_file_is_an_error_with_its_name() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("file");
    fs::write(&file, "").unwrap();
    let refused = load_or_precompute(&file, &fan(), &settings(), &mut |_| {}).unwrap_err();
    assert!(matches!(refused, PrtError::Cache { .. }) && refused.to_string().contains("file"), "{refused}");
}

fn bounced(directory: &Path, reflectance: f64, progress: &mut dyn FnMut(f64)) -> Cached<SpectralTransfer> {
    let direct = precompute(&fan(), &settings(), &mut |_| {}).expect("good settings");
    let paint = [GRID.sample(|lambda_nm| reflectance * lambda_nm / 700.0)];
    let settings = BounceSettings { rays: 4, bounces: 2 };
    load_or_add_bounces(directory, &fan(), &direct, GRID, &paint, &settings, progress).expect("a cache")
}

/// Bounces are read as they were computed, those of a run that died as far as it came, and a damaged one is computed again; another paint is
/// another file.
#[test]
fn bounces_are_kept_chunk_by_chunk() {
    let directory = tempfile::tempdir().unwrap();
    let paint = [GRID.sample(|lambda_nm| 0.8 * lambda_nm / 700.0)];
    let direct = precompute(&fan(), &settings(), &mut |_| {}).unwrap();
    let by_rays = BounceSettings { rays: 4, bounces: 2 };
    let computed = add_bounces(&fan(), &direct, GRID, &paint, &by_rays, &mut |_| {}).unwrap();
    let died = catch_unwind(AssertUnwindSafe(|| {
        bounced(directory.path(), 0.8, &mut |share| assert!(share < 0.7, "killed"))
    }));
    assert!(died.is_err());
    let first = bounced(directory.path(), 0.8, &mut |_| {});
    assert_eq!([first.read_chunks, first.computed_chunks, first.damaged_chunks], [5, 1, 0]);
    assert_eq!(first.transfer, computed);
    let mut bytes = fs::read(&first.path).unwrap();
    // Within the second of six records.
    let quarter = bytes.len() / 4;
    bytes[quarter] ^= 1;
    fs::write(&first.path, bytes).unwrap();
    let mended = bounced(directory.path(), 0.8, &mut |_| {});
    assert_eq!([mended.read_chunks, mended.computed_chunks, mended.damaged_chunks], [5, 1, 1]);
    assert_eq!(mended.transfer, computed);
    let other = bounced(directory.path(), 0.7, &mut |_| {});
    assert_eq!([other.read_chunks, other.computed_chunks], [0, 2 * CHUNKS]);
    assert_ne!(other.transfer, computed);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any byte of the file, altered in any way: found, computed again, and whole the next time.
    #[test]
    fn an_altered_byte_is_found_and_rebuilt(place in 0.0..1.0, flip in 1_u8..=255) {
        let directory = tempfile::tempdir().expect("a directory");
        let whole = cached(directory.path());
        let mut bytes = fs::read(&whole.path).expect("written");
        let at = (place * bytes.len() as f64) as usize;
        bytes[at] ^= flip;
        fs::write(&whole.path, bytes).expect("a writable file");
        let mended = cached(directory.path());
        prop_assert_eq!(&mended.transfer, &whole.transfer);
        prop_assert!(mended.damaged_chunks == 1 || mended.damaged_chunks == CHUNKS);
        prop_assert_eq!(mended.computed_chunks, mended.damaged_chunks);
        prop_assert_eq!(counts(&cached(directory.path())), [CHUNKS, 0, 0]);
    }

    /// Cut anywhere, as a full disk or a lost write may: what was whole is read, the rest computed.
    #[test]
    fn a_file_cut_short_is_completed(place in 0.0..1.0) {
        let directory = tempfile::tempdir().expect("a directory");
        let whole = cached(directory.path());
        let mut bytes = fs::read(&whole.path).expect("written");
        bytes.truncate((place * bytes.len() as f64) as usize);
        fs::write(&whole.path, bytes).expect("a writable file");
        let mended = cached(directory.path());
        prop_assert_eq!(&mended.transfer, &whole.transfer);
        prop_assert!(mended.computed_chunks >= 1 && mended.damaged_chunks <= 1);
        prop_assert_eq!(counts(&cached(directory.path())), [CHUNKS, 0, 0]);
    }
}
