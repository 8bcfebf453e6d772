//! What took long and is kept in a folder, by the hash of all that it depends on.
//!
//! A file is a line of JSON, with what the samples are and their hash, and then the samples as little-endian f32. One that
//! is cut short, changed or of another key is found and counts as not there.

use std::fs;
use std::io::{self, Write};
use std::path::PathBuf;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::output::atomic_file::AtomicFile;

/// Changes when files are laid out otherwise.
const FORMAT: u32 = 1;

/// All that a result depends on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key(String);

impl Key {
    /// Of anything that can be written down, and of the program that works with it.
    ///
    /// # Errors
    /// If a part cannot be written as JSON.
    pub fn of(parts: &impl Serialize, program: &str) -> serde_json::Result<Self> {
        let mut hasher = Hasher(Sha256::new());
        serde_json::to_writer(&mut hasher, &(FORMAT, program, parts))?;
        Ok(Self(hex(hasher.0)))
    }
}

/// A folder of kept results.
pub struct Kept {
    folder: PathBuf,
}

/// Why there is nothing.
#[derive(Debug, PartialEq, Eq)]
pub enum Absent {
    /// Not made yet.
    New,
    /// There is a file, and it is not what was kept.
    Damaged(String),
}

#[derive(Serialize, Deserialize)]
struct Header<T> {
    key: String,
    samples_sha256: String,
    content: T,
}

impl Kept {
    /// In a folder that is made when something is kept.
    #[must_use]
    pub fn in_folder(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// What was kept under a name and key.
    ///
    /// # Errors
    /// [`Absent`], which is no failure: make it, and keep that.
    pub fn read<T: DeserializeOwned>(&self, name: &str, key: &Key) -> Result<(T, Vec<f32>), Absent> {
        let path = self.path(name, key);
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Err(Absent::New),
            Err(error) => return Err(Absent::Damaged(format!("{}: {error}", path.display()))),
        };
        parse(&bytes, key).map_err(|what| Absent::Damaged(format!("{}: {what}", path.display())))
    }

    /// Keep it; readers see the old file or the new one.
    ///
    /// # Errors
    /// If the folder or the file cannot be written.
    pub fn write(&self, name: &str, key: &Key, content: &impl Serialize, samples: &[f32]) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let samples: Vec<u8> = samples.iter().flat_map(|v| v.to_le_bytes()).collect();
        let samples_sha256 = hex(Sha256::new_with_prefix(&samples));
        let header = Header { key: key.0.clone(), samples_sha256, content };
        let mut bytes = serde_json::to_vec(&header)?;
        bytes.push(b'\n');
        bytes.extend(samples);
        AtomicFile::new(&self.path(name, key))?.write(|file| file.write_all(&bytes))
    }

    fn path(&self, name: &str, key: &Key) -> PathBuf {
        self.folder.join(format!("{name}-{}.kept", &key.0[..16]))
    }
}

fn parse<T: DeserializeOwned>(bytes: &[u8], key: &Key) -> Result<(T, Vec<f32>), String> {
    let end = bytes.iter().position(|&b| b == b'\n').ok_or("no end of the first line")?;
    let header: Header<T> = serde_json::from_slice(&bytes[..end]).map_err(|e| e.to_string())?;
    if header.key != key.0 {
        return Err("of another key".into());
    }
    let samples = &bytes[end + 1..];
    if header.samples_sha256 != hex(Sha256::new_with_prefix(samples)) {
        return Err("its samples are not those that were kept".into());
    }
    let (numbers, rest) = samples.as_chunks();
    if !rest.is_empty() {
        return Err(format!("{} bytes are no samples", rest.len()));
    }
    Ok((header.content, numbers.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect()))
}

/// What is written is hashed.
struct Hasher(Sha256);

impl Write for Hasher {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A hash in hexadecimal digits.
#[must_use]
pub fn hex(hasher: Sha256) -> String {
    hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLES: [f32; 3] = [1.5, -0.0, f32::MIN_POSITIVE];

    fn kept(test: &str) -> (Kept, PathBuf) {
        let folder = std::env::temp_dir().join(format!("spectral-kept-{test}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        (Kept::in_folder(folder.clone()), folder)
    }

    #[test]
    fn what_is_kept_comes_back() {
        let (kept, folder) = kept("back");
        let key = Key::of(&("scene", 7), "v1").expect("a key");
        assert_eq!(kept.read::<String>("a", &key), Err(Absent::New));
        kept.write("a", &key, &"content", &SAMPLES).expect("written");
        let (content, samples) = kept.read::<String>("a", &key).expect("there");
        assert_eq!((content.as_str(), samples.as_slice()), ("content", SAMPLES.as_slice()));
        fs::remove_dir_all(folder).expect("removed");
    }

    #[test]
    fn scene_settings_and_program_are_all_in_the_key() {
        let key =
            |scene: &str, photons: u32, program: &str| Key::of(&(scene, photons), program).expect("a key");
        let one = key("sphere", 7, "v1");
        assert_eq!(one, key("sphere", 7, "v1"));
        for other in [key("spheres", 7, "v1"), key("sphere", 8, "v1"), key("sphere", 7, "v2")] {
            assert_ne!(one, other);
        }
    }

    #[test]
    fn damage_is_found() {
        let (kept, folder) = kept("damage");
        let key = Key::of(&"scene", "v1").expect("a key");
        kept.write("a", &key, &"content", &SAMPLES).expect("written");
        let path = kept.path("a", &key);
        let good = fs::read(&path).expect("there");
        let mut flipped = good.clone();
        *flipped.last_mut().expect("bytes") ^= 1;
        let cut = good[..good.len() - 4].to_vec();
        let other = String::from_utf8_lossy(&good[..90]).replace(&key.0[..8], "00000000").into_bytes();
        let other = [other, good[90..].to_vec()].concat();
        for bad in [flipped, cut, other, b"{}".to_vec(), Vec::new()] {
            fs::write(&path, bad).expect("written");
            let found = kept.read::<String>("a", &key);
            assert!(matches!(found, Err(Absent::Damaged(_))), "{found:?}");
        }
        kept.write("a", &key, &"content", &SAMPLES).expect("made again");
        assert!(kept.read::<String>("a", &key).is_ok());
        fs::remove_dir_all(folder).expect("removed");
    }
}
