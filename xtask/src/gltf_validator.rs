//! The Khronos glTF validator over every scene that we write, where Node and npm are installed.
//!
//! Two files with known faults go in with the scenes and must be refused: a validator that accepts everything would
//! be of no use.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use xtask::subject::Subject;

use crate::tool::Outcome;
use crate::{paths, tool};

/// The npm package, in the version that our files are known to pass.
const PACKAGE: &str = "gltf-validator@2.0.0-dev.3.10";

/// Write every scene to `target/gltf` and validate the files.
///
/// # Errors
/// If a scene cannot be written.
pub(crate) fn run() -> Result<Outcome> {
    let [Some(node), Some(npm)] = ["node", "npm"].map(tool::on_path) else {
        return Ok(Outcome::Skipped("node and npm are not both installed".into()));
    };
    let folder = paths::target().join("gltf-validator");
    if let Err(error) = install(&npm, &folder) {
        return Ok(Outcome::Skipped(format!("npm cannot get {PACKAGE}: {error:#}")));
    }
    let files = paths::target().join("gltf");
    fs::create_dir_all(&files).with_context(|| format!("cannot create {}", files.display()))?;
    let root = paths::workspace_root();
    let mut command = Command::new(&node);
    command.current_dir(&folder).arg(root.join("tests/gltf_validator.mjs"));
    for name in Subject::names() {
        let scene = Subject::open(name, &root)?.scene;
        command.arg(written(&files, name, &spectral_scene::to_glb(&scene)?)?);
    }
    command.arg("--broken");
    let whole = spectral_scene::to_glb(&Subject::open("prism", &root)?.scene)?;
    for (name, fault) in FAULTS {
        command.arg(written(&files, name, &respelt(&whole, fault)?)?);
    }
    let output = command.output().with_context(|| format!("cannot start {}", node.display()))?;
    let [said, complained] = [&output.stdout, &output.stderr].map(|t| String::from_utf8_lossy(t));
    let text = format!("{said}{complained}").trim().to_owned();
    Ok(if output.status.success() { Outcome::Passed(text) } else { Outcome::Failed(text) })
}

/// A change that makes a file invalid.
type Fault = fn(&mut Value);

/// Faults that the validator must find, one an error and one a warning.
const FAULTS: [(&str, Fault); 2] = [
    ("broken-reference", |gltf| gltf["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 9999.into()),
    ("unexpected-property", |gltf| gltf["asset"]["wavelength"] = 550.into()),
];

/// The validator in a folder of ours, from wherever the user's npm gets its packages.
fn install(npm: &Path, folder: &Path) -> Result<()> {
    if folder.join("node_modules/gltf-validator/package.json").is_file() {
        return Ok(());
    }
    fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let options = ["install", "--no-audit", "--no-fund", "--ignore-scripts", "--loglevel=error", "--prefix"];
    tool::run(Command::new(npm).args(options).arg(folder).arg(PACKAGE)).map(drop)
}

fn written(folder: &Path, name: &str, bytes: &[u8]) -> Result<PathBuf> {
    let path = folder.join(format!("{name}.glb"));
    fs::write(&path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(path)
}

/// A binary glTF file with its JSON changed; glTF 2.0 specification, section 4.4.
fn respelt(glb: &[u8], change: Fault) -> Result<Vec<u8>> {
    /// Bytes of the file's header, and of a chunk's.
    const HEADER: usize = 12;
    const CHUNK_HEADER: usize = 8;
    let length = glb.get(HEADER..HEADER + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let json_begin = HEADER + CHUNK_HEADER;
    let json_end = json_begin + length.context("the file ends in its header")? as usize;
    ensure!(json_end <= glb.len(), "the JSON chunk ends at {json_end}, the file at {}", glb.len());
    let mut gltf: Value = serde_json::from_slice(&glb[json_begin..json_end])?;
    change(&mut gltf);
    let mut json = serde_json::to_vec(&gltf)?;
    json.resize(json.len().next_multiple_of(4), b' ');
    let rest = &glb[json_end..];
    let total = json_begin + json.len() + rest.len();
    let mut file = glb[..8].to_vec();
    file.extend((total as u32).to_le_bytes());
    file.extend((json.len() as u32).to_le_bytes());
    file.extend(&glb[HEADER + 4..json_begin]);
    file.extend(json);
    file.extend(rest);
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_respelt_file_loads_with_the_change_and_nothing_else() {
        let scene = spectral_scene::bundled("gem").unwrap();
        let whole = spectral_scene::to_glb(&scene).unwrap();
        let load = |glb: &[u8]| spectral_scene::load_bytes(glb, "gem").unwrap().0;
        assert_eq!(load(&respelt(&whole, |_| ()).unwrap()), load(&whole));
        let renamed = respelt(&whole, |gltf| gltf["nodes"][0]["name"] = "another".into()).unwrap();
        assert_ne!(load(&renamed), load(&whole));
    }

    #[test]
    fn truncated_files_are_an_error() {
        assert!(respelt(b"glTF", |_| ()).is_err());
        assert!(respelt(&[255; 16], |_| ()).is_err());
    }
}
