//! What a CPU mirror sees: its uniform, its resources by name, and for draws the vertex and fragment records.

use std::sync::atomic::AtomicU32;
use std::sync::{Mutex, PoisonError};

use bytemuck::Pod;

use super::{StorageTextureMut, TextureView};

/// Arguments of a CPU mirror: the uniform block of this iteration and the bound resources by the names of
/// [`crate::PassInfo::bindings`].
///
/// Compute mirrors do the work of the whole dispatch and parallelise it with rayon; they run inside the executor's thread
/// pool. Vertex and fragment mirrors are called from many threads at once and only read, load and add.
///
/// # Panics
/// Asking for a name or a type that the pass does not declare is a bug of the pass, and panics.
pub struct MirrorArgs<'a> {
    pub(super) pass: &'static str,
    pub(super) groups: [u32; 3],
    pub(super) params: &'a [u8],
    pub(super) slots: Vec<(&'static str, Slot<'a>)>,
}

/// A bound resource.
pub(super) enum Slot<'a> {
    Read(&'a [u8]),
    Write(Mutex<Option<&'a mut [u8]>>),
    Atomic(&'a [AtomicU32]),
    Texture(TextureView<'a>),
    StorageTexture(Mutex<Option<StorageTextureMut<'a>>>),
    Sampler,
}

impl<'a> MirrorArgs<'a> {
    /// The uniform block of this iteration.
    #[must_use]
    pub fn params<T: Pod>(&self) -> T {
        assert_eq!(self.params.len(), size_of::<T>(), "{}: size of the parameter struct", self.pass);
        bytemuck::pod_read_unaligned(self.params)
    }

    /// Workgroups of this dispatch; zero for draws.
    #[must_use]
    pub const fn groups(&self) -> [u32; 3] {
        self.groups
    }

    /// A [`crate::BindingKind::Read`] buffer; a rest shorter than an element is left out, as WGSL's `arrayLength` does.
    #[must_use]
    pub fn read<T: Pod>(&self, name: &str) -> &'a [T] {
        match self.slot(name) {
            Slot::Read(bytes) => bytemuck::cast_slice(whole_elements::<T>(bytes)),
            _ => self.wrong(name, "Read"),
        }
    }

    /// A [`crate::BindingKind::Write`] buffer, given out once per call of the mirror.
    #[must_use]
    pub fn write<T: Pod>(&self, name: &str) -> &'a mut [T] {
        match self.slot(name) {
            Slot::Write(slot) => {
                let bytes = slot
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .take()
                    .unwrap_or_else(|| panic!("{}: {name} was taken twice", self.pass));
                let len = whole_elements::<T>(bytes).len();
                bytemuck::cast_slice_mut(&mut bytes[..len])
            }
            _ => self.wrong(name, "Write"),
        }
    }

    /// A [`crate::BindingKind::Atomic`] or [`crate::BindingKind::ReadAtomic`] buffer.
    #[must_use]
    pub fn atomics(&self, name: &str) -> &'a [AtomicU32] {
        match self.slot(name) {
            Slot::Atomic(words) => words,
            _ => self.wrong(name, "Atomic or ReadAtomic"),
        }
    }

    /// A [`crate::BindingKind::Texture`] or [`crate::BindingKind::DepthTexture`].
    #[must_use]
    pub fn texture(&self, name: &str) -> TextureView<'a> {
        match self.slot(name) {
            Slot::Texture(view) => *view,
            _ => self.wrong(name, "Texture or DepthTexture"),
        }
    }

    /// A [`crate::BindingKind::StorageTexture`], given out once per call of the mirror.
    #[must_use]
    pub fn storage_texture(&self, name: &str) -> StorageTextureMut<'a> {
        match self.slot(name) {
            Slot::StorageTexture(slot) => slot
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .take()
                .unwrap_or_else(|| panic!("{}: {name} was taken twice", self.pass)),
            _ => self.wrong(name, "StorageTexture"),
        }
    }

    fn slot(&self, name: &str) -> &Slot<'a> {
        self.slots
            .iter()
            .find(|(n, _)| *n == name)
            .map_or_else(|| panic!("{}: no binding named {name}", self.pass), |(_, slot)| slot)
    }

    fn wrong(&self, name: &str, wanted: &str) -> ! {
        panic!("{}: {name} is not bound as {wanted}", self.pass)
    }
}

/// The part of `bytes` that holds whole elements.
fn whole_elements<T>(bytes: &[u8]) -> &[u8] {
    &bytes[..bytes.len() / size_of::<T>() * size_of::<T>()]
}

/// Output of a vertex mirror.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VertexOutput {
    /// Clip-space position, y up, depth 0..w.
    pub position: [f32; 4],
    /// Integers passed on without interpolation, taken from the triangle's first vertex.
    pub flat: [u32; 4],
    /// Values interpolated with perspective.
    pub varyings: [[f32; 4]; 2],
}

/// Input of a fragment mirror: one texel centre inside a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    /// Texel centre in x and y (texels, y down), depth in z, 1/w in w: WGSL's `@builtin(position)`.
    pub position: [f32; 4],
    /// The triangle faces the viewer.
    pub front_facing: bool,
    /// From the triangle's first vertex.
    pub flat: [u32; 4],
    /// Interpolated with perspective.
    pub varyings: [[f32; 4]; 2],
}
