//! Transfer on disk, under the hash of everything it depends on.
//!
//! A file has a header and one record per chunk of 1024 vertices, each with the SHA-256 of its content and of its place.
//! Bounces have such records too, chunk by chunk of each. Records are written as soon as they are computed, so a killed run
//! loses the chunk it was at; what is missing, cut off or altered is computed again. Every chunk has one possible content:
//! two programs may write one file at once.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use spectral_core::grid::SpectralGrid;

use crate::bounces::{BounceSettings, Bounces, SpectralTransfer};
use crate::error::PrtError;
use crate::surface::Surface;
use crate::transfer::{CHUNK_VERTICES, Transfer, TransferSettings, Work};

/// Changes with the file's layout and with every change of what [`precompute`](crate::precompute) and [`add_bounces`](crate::add_bounces) find.
const VERSION: &[u8] = b"spectral-prt transfer 3";
const DIGEST: usize = 32;

/// A transfer and where it came from.
#[derive(Clone, Debug, PartialEq)]
pub struct Cached<T> {
    /// The same, to the bit, as [`precompute`](crate::precompute) or [`add_bounces`](crate::add_bounces) finds.
    pub transfer: T,
    /// The file.
    pub path: PathBuf,
    /// Chunks read from it.
    pub read_chunks: usize,
    /// Chunks computed and written, damaged ones among them.
    pub computed_chunks: usize,
    /// Chunks that were there but not as they were written; all of them if the header was damaged.
    pub damaged_chunks: usize,
}

/// Transfer of every vertex, as [`precompute`](crate::precompute) finds it, from the file in `directory` as far as it is
/// there. The directory is created if need be. `progress` hears shares of the work, 0 to 1, in order.
///
/// # Errors
/// [`PrtError::Rays`], and [`PrtError::Cache`] if the file can be neither read nor written.
pub fn load_or_precompute(
    directory: &Path,
    surfaces: &[Surface],
    settings: &TransferSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<Cached<Transfer>, PrtError> {
    settings.check()?;
    let key = content_hash(surfaces, settings);
    let work = Work::new(surfaces, *settings);
    let lengths = (0..work.chunks()).map(|chunk| work.chunk_len(chunk)).collect();
    let mut file = Records::open(directory, "sprt", key, lengths)?;
    let mut coefficients = Vec::new();
    progress(0.0);
    for chunk in 0..work.chunks() {
        coefficients.extend(file.take(chunk, &|| work.chunk(chunk))?);
        progress((chunk + 1) as f64 / work.chunks() as f64);
    }
    Ok(file.cached(work.transfer(coefficients)))
}

/// Transfer with interreflection, as [`add_bounces`](crate::add_bounces) finds it, likewise: a killed run loses the chunk of the bounce it was
/// at.
///
/// # Errors
/// Those of [`add_bounces`](crate::add_bounces), and [`PrtError::Cache`].
pub fn load_or_add_bounces(
    directory: &Path,
    surfaces: &[Surface],
    direct: &Transfer,
    grid: SpectralGrid,
    reflectances: &[Vec<f64>],
    settings: &BounceSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<Cached<SpectralTransfer>, PrtError> {
    let bounces = Bounces::new(surfaces, direct, grid, reflectances, settings)?;
    let mut hash = Sha256::new();
    let rays = TransferSettings { bands: direct.bands(), rays: settings.rays };
    hash.update(content_hash(surfaces, &rays));
    hash.update(settings.bounces.to_le_bytes());
    direct.coefficients.iter().for_each(|t| hash.update(t.to_le_bytes()));
    for spectrum in reflectances.iter().chain(&bounces.functions()) {
        hash.update((spectrum.len() as u64).to_le_bytes());
        spectrum.iter().for_each(|value| hash.update(value.to_le_bytes()));
    }
    let mut file = Records::open(directory, "bounces.sprt", hash.finalize().into(), bounces.records())?;
    let transfer = bounces.follow(|record, compute| file.take(record, compute), progress)?;
    Ok(file.cached(transfer))
}

/// A file in use, and what became of its records.
struct Records {
    path: PathBuf,
    store: Store,
    read: usize,
    damaged: usize,
}

impl Records {
    fn open(directory: &Path, ending: &str, key: [u8; 32], lengths: Vec<usize>) -> Result<Self, PrtError> {
        let path = directory.join(format!("{}.{ending}", hex(&key)));
        match Store::open(&path, key, lengths) {
            Ok(store) => Ok(Self { path, read: 0, damaged: store.discarded_chunks, store }),
            Err(error) => Err(PrtError::Cache { path, error }),
        }
    }

    /// A record as it was written, or computed and written now.
    fn take(&mut self, record: usize, compute: &dyn Fn() -> Vec<f32>) -> Result<Vec<f32>, PrtError> {
        let failed = |error| PrtError::Cache { path: self.path.clone(), error };
        match self.store.read(record).map_err(failed)? {
            Record::Good(values) => {
                self.read += 1;
                Ok(values)
            }
            other => {
                self.damaged += usize::from(matches!(other, Record::Damaged));
                let values = compute();
                self.store.write(record, &values).map_err(failed)?;
                Ok(values)
            }
        }
    }

    fn cached<T>(self, transfer: T) -> Cached<T> {
        Cached {
            transfer,
            computed_chunks: self.store.lengths.len() - self.read,
            path: self.path,
            read_chunks: self.read,
            damaged_chunks: self.damaged,
        }
    }
}

/// SHA-256 of all that a transfer depends on: the version, the settings, and every surface's geometry, bit by bit.
pub fn content_hash(surfaces: &[Surface], settings: &TransferSettings) -> [u8; 32] {
    let mut hash = Sha256::new();
    hash.update(VERSION);
    hash.update([u8::from(settings.bands)]);
    hash.update(settings.rays.to_le_bytes());
    hash.update((surfaces.len() as u64).to_le_bytes());
    for surface in surfaces {
        for vectors in [surface.positions(), surface.normals()] {
            hash.update((vectors.len() as u64).to_le_bytes());
            for v in vectors {
                v.to_array().iter().for_each(|c| hash.update(c.to_le_bytes()));
            }
        }
        hash.update((surface.triangles().len() as u64).to_le_bytes());
        surface.triangles().as_flattened().iter().for_each(|v| hash.update(v.to_le_bytes()));
    }
    hash.finalize().into()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// What is where a chunk should be.
enum Record {
    Good(Vec<f32>),
    /// Nothing was written there.
    Missing,
    Damaged,
}

/// The file of one transfer, or of its bounces.
struct Store {
    file: File,
    key: [u8; 32],
    header_len: u64,
    /// Numbers in each chunk.
    lengths: Vec<usize>,
    /// Chunks of a file whose header was not this one's.
    discarded_chunks: usize,
}

impl Store {
    fn open(path: &Path, key: [u8; 32], lengths: Vec<usize>) -> io::Result<Self> {
        if let Some(directory) = path.parent() {
            fs::create_dir_all(directory)?;
        }
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        let header = header(&key, &lengths);
        let mut found = Vec::with_capacity(header.len());
        (&file).take(header.len() as u64).read_to_end(&mut found)?;
        let mut discarded_chunks = 0;
        if found != header {
            // Less than a header is what a killed run may leave.
            if found.len() == header.len() {
                discarded_chunks = lengths.len();
            }
            file.set_len(0)?;
            file.rewind()?;
            file.write_all(&header)?;
        }
        Ok(Self { file, key, header_len: header.len() as u64, lengths, discarded_chunks })
    }

    /// Where a chunk's record begins, bytes. No chunk is longer than the first.
    fn offset(&self, chunk: usize) -> u64 {
        self.header_len + (chunk * (self.lengths[0] * size_of::<f32>() + DIGEST)) as u64
    }

    fn read(&mut self, chunk: usize) -> io::Result<Record> {
        let len = self.lengths[chunk] * size_of::<f32>();
        let mut record = Vec::with_capacity(len + DIGEST);
        self.file.seek(SeekFrom::Start(self.offset(chunk)))?;
        (&self.file).take((len + DIGEST) as u64).read_to_end(&mut record)?;
        if record.iter().all(|&byte| byte == 0) {
            return Ok(Record::Missing);
        }
        if record.len() < len + DIGEST || record[len..] != self.digest(chunk, &record[..len]) {
            return Ok(Record::Damaged);
        }
        let number = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().expect("chunks of four bytes"));
        Ok(Record::Good(record[..len].chunks_exact(size_of::<f32>()).map(number).collect()))
    }

    fn write(&mut self, chunk: usize, values: &[f32]) -> io::Result<()> {
        let mut record: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        record.extend(self.digest(chunk, &record));
        self.file.seek(SeekFrom::Start(self.offset(chunk)))?;
        self.file.write_all(&record)
    }

    fn digest(&self, chunk: usize, payload: &[u8]) -> [u8; DIGEST] {
        let mut hash = Sha256::new();
        hash.update(self.key);
        hash.update((chunk as u64).to_le_bytes());
        hash.update(payload);
        hash.finalize().into()
    }
}

/// The version, the key, the sizes.
fn header(key: &[u8; 32], lengths: &[usize]) -> Vec<u8> {
    let mut header = VERSION.to_vec();
    header.extend(key);
    header.extend((CHUNK_VERTICES as u64).to_le_bytes());
    header.extend((lengths.iter().sum::<usize>() as u64).to_le_bytes());
    header
}
