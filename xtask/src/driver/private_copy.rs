//! A driver unpacked into a folder of ours, with its manifest made to point there.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::Value;

use crate::unpacked::{self, Environment, files_under};

/// Our manifest, beside the unpacked packages: the loader resolves its library path from where it lies.
const MANIFEST: &str = "driver_icd.json";

/// Where packages put the manifests of layers that programs ask for.
const LAYERS: &str = "usr/share/vulkan/explicit_layer.d";

/// That of Khronos' validation layer; its library is found as all libraries of the copy are.
const VALIDATION_MANIFEST: &str = "VkLayer_khronos_validation.json";

/// Drivers we take; packages bring manifests of hardware drivers too.
const SOFTWARE_MANIFESTS: [&str; 2] = ["lvp_icd", "vk_swiftshader_icd"];

/// An unpacked driver with its loader.
pub(super) struct PrivateCopy {
    root: PathBuf,
}

impl PrivateCopy {
    /// A copy made earlier.
    ///
    /// # Errors
    /// If there is none.
    pub(super) fn open(root: &Path) -> Result<Self> {
        let manifest = root.join(MANIFEST);
        anyhow::ensure!(manifest.is_file(), "{} is not there", manifest.display());
        Ok(Self { root: root.to_owned() })
    }

    /// Fetch, and put into place only when it is whole.
    ///
    /// # Errors
    /// What `fetch` says; no manifest or library in what it fetched; an unwritable folder.
    pub(super) fn create(root: &Path, fetch: fn(&Path) -> Result<()>) -> Result<Self> {
        unpacked::create(root, |folder| fetch(folder).and_then(|()| write_manifest(folder)))?;
        Self::open(root)
    }

    /// The folder.
    pub(super) fn root(&self) -> &Path {
        &self.root
    }

    /// What names the driver to the Vulkan loader.
    pub(super) fn manifest(&self) -> PathBuf {
        self.root.join(MANIFEST)
    }

    /// Variables that make the Vulkan loader this one and the driver the only one, and that let tests validate.
    pub(super) fn environment(&self) -> Environment {
        let manifest = self.manifest().into_os_string();
        let mut environment = vec![
            // Loaders before 1.3.207 know only the second name.
            ("VK_DRIVER_FILES", manifest.clone()),
            ("VK_ICD_FILENAMES", manifest),
        ];
        unpacked::put_libraries_first(&self.root, &mut environment);
        let layers = self.root.join(LAYERS);
        if layers.join(VALIDATION_MANIFEST).is_file() {
            environment.push(("VK_LAYER_PATH", layers.into_os_string()));
            // What was fetched for the tests is to be used by them.
            environment.push(("SPECTRAL_REQUIRE_VALIDATION", "1".into()));
        }
        environment
    }
}

/// Write our manifest from the driver's own, with the library's path relative to `root`.
fn write_manifest(root: &Path) -> Result<()> {
    let files = files_under(root);
    let named = |path: &&PathBuf, start: &str| {
        path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(start))
    };
    let original = files
        .iter()
        .find(|path| {
            path.extension().is_some_and(|e| e == "json") && SOFTWARE_MANIFESTS.iter().any(|s| named(path, s))
        })
        .context("the download holds no software driver's manifest")?;
    let text = fs::read_to_string(original)?;
    let mut manifest: Value =
        serde_json::from_str(&text).with_context(|| format!("{} is not JSON", original.display()))?;
    let library_name = manifest["ICD"]["library_path"]
        .as_str()
        .and_then(|path| Path::new(path).file_name())
        .with_context(|| format!("{} names no library", original.display()))?
        .to_owned();
    let library = files
        .iter()
        .find(|path| path.file_name() == Some(&library_name))
        .and_then(|path| path.strip_prefix(root).ok())
        .with_context(|| format!("the download holds no {}", library_name.display()))?;
    manifest["ICD"]["library_path"] = Value::from(Path::new(".").join(library).to_string_lossy());
    fs::write(root.join(MANIFEST), serde_json::to_string_pretty(&manifest)?)?;
    Ok(())
}
