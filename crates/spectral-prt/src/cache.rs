//! Transfer on disk, under the hash of everything it depends on.
//!
//! A file has a header and one record per chunk of 1024 vertices, each with the SHA-256 of its content and of its place.
//! Records are written as soon as they are computed, so a killed run loses the chunk it was at; what is missing, cut off
//! or altered is computed again. Every chunk has one possible content: two programs may write one file at once.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::error::PrtError;
use crate::surface::Surface;
use crate::transfer::{CHUNK_VERTICES, Transfer, TransferSettings, Work};

/// Changes with the file's layout and with every change of what [`precompute`](crate::precompute) finds.
const VERSION: &[u8] = b"spectral-prt transfer 2";
const DIGEST: usize = 32;

/// A transfer and where it came from.
#[derive(Clone, Debug, PartialEq)]
pub struct Cached {
    /// The same, to the bit, as [`precompute`](crate::precompute)'s.
    pub transfer: Transfer,
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
) -> Result<Cached, PrtError> {
    settings.check()?;
    let key = content_hash(surfaces, settings);
    let path = directory.join(format!("{}.sprt", hex(&key)));
    let work = Work::new(surfaces, *settings);
    let failed = |error| PrtError::Cache { path: path.clone(), error };
    let mut store = Store::open(&path, key, &work).map_err(failed)?;
    let mut coefficients = Vec::new();
    let (mut read_chunks, mut damaged_chunks) = (0, store.discarded_chunks);
    progress(0.0);
    for chunk in 0..work.chunks() {
        match store.read(chunk).map_err(failed)? {
            Record::Good(values) => {
                read_chunks += 1;
                coefficients.extend(values);
            }
            other => {
                damaged_chunks += usize::from(matches!(other, Record::Damaged));
                let values = work.chunk(chunk);
                store.write(chunk, &values).map_err(failed)?;
                coefficients.extend(values);
            }
        }
        progress((chunk + 1) as f64 / work.chunks() as f64);
    }
    let computed_chunks = work.chunks() - read_chunks;
    Ok(Cached { transfer: work.transfer(coefficients), path, read_chunks, computed_chunks, damaged_chunks })
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

/// The file of one transfer.
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
    fn open(path: &Path, key: [u8; 32], work: &Work) -> io::Result<Self> {
        if let Some(directory) = path.parent() {
            fs::create_dir_all(directory)?;
        }
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        let lengths: Vec<usize> = (0..work.chunks()).map(|chunk| work.chunk_len(chunk)).collect();
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

    /// Where a chunk's record begins, bytes. All chunks but the last are equally long.
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
