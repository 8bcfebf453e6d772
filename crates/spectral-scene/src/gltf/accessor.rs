//! Typed data out of buffers. Every count is checked against the bytes there are before anything is allocated.

use std::borrow::Cow;

use super::document::{Accessor, Document};
use super::error::{LoadError, invalid};

/// Elements decoded from one file, all accessors together. Primitives may share accessors, so the size of the
/// file alone does not bound them.
const MAX_ELEMENTS: usize = 1 << 26;

pub(super) struct Reader<'a> {
    document: &'a Document,
    buffers: Vec<Cow<'a, [u8]>>,
    elements_left: usize,
}

/// Component types of glTF, by OpenGL's numbers.
#[derive(Clone, Copy, PartialEq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

/// A strided run of elements that is known to lie inside its buffer.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: usize,
}

impl<'a> Elements<'a> {
    fn get(&self, i: usize) -> &'a [u8] {
        &self.bytes[i * self.stride..]
    }
}

impl Component {
    fn new(at: &str, number: u32) -> Result<Self, LoadError> {
        Ok(match number {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => {
                return invalid(
                    format!("{at}.componentType"),
                    format!("is {number}"),
                    "it must be 5120, 5121, 5122, 5123, 5125 or 5126",
                );
            }
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

impl<'a> Reader<'a> {
    pub(super) fn new(document: &'a Document, buffers: Vec<Cow<'a, [u8]>>) -> Self {
        Self { document, buffers, elements_left: MAX_ELEMENTS }
    }

    /// Vectors of finite floats: positions, normals and texture coordinates. Integers are accepted where core
    /// glTF allows them, as normalised unsigned texture coordinates.
    pub(super) fn vectors<const N: usize>(
        &mut self,
        index: usize,
        semantic: &str,
    ) -> Result<Vec<[f32; N]>, LoadError> {
        let at = format!("accessors[{index}] ({semantic})");
        let accessor = self.accessor(&at, index)?;
        let kind = format!("VEC{N}");
        if accessor.kind != kind {
            return invalid(
                at,
                format!("is of type {}", accessor.kind),
                format!("{semantic} must be {kind}"),
            );
        }
        let component = Component::new(&at, accessor.component_type)?;
        let scale = match (component, accessor.normalized, N) {
            (Component::F32, ..) => 1.0,
            (Component::U8, true, 2) => 255.0,
            (Component::U16, true, 2) => 65535.0,
            (Component::U32, ..) => {
                return invalid(at, "holds 32-bit integers", format!("{semantic} must be floats"));
            }
            _ => {
                return Err(LoadError::UnsupportedExtension { name: "KHR_mesh_quantization".into(), at });
            }
        };
        let decode = |bytes: &[u8]| -> [f32; N] {
            std::array::from_fn(|k| match component {
                Component::F32 => f32::from_le_bytes(array(&bytes[4 * k..])),
                Component::U8 => f32::from(bytes[k]) / scale,
                _ => f32::from(u16::from_le_bytes(array(&bytes[2 * k..]))) / scale,
            })
        };
        let values = self.decode(&at, accessor, component.size() * N, decode)?;
        match values.iter().position(|v| v.iter().any(|c| !c.is_finite())) {
            Some(i) => {
                invalid(at, format!("has {:?} as element {i}", values[i]), "all numbers must be finite")
            }
            None => Ok(values),
        }
    }

    /// Vertex indices.
    pub(super) fn indices(&mut self, index: usize) -> Result<Vec<u32>, LoadError> {
        let at = format!("accessors[{index}] (indices)");
        let accessor = self.accessor(&at, index)?;
        let component = Component::new(&at, accessor.component_type)?;
        if accessor.kind != "SCALAR" || !is_index(component) {
            let problem = format!("is {} of component type {}", accessor.kind, accessor.component_type);
            return invalid(at, problem, "indices must be SCALAR of 5121, 5123 or 5125");
        }
        self.decode(&at, accessor, component.size(), |bytes| index_value(component, bytes))
    }

    fn accessor(&mut self, at: &str, index: usize) -> Result<&'a Accessor, LoadError> {
        let Some(accessor) = self.document.accessors.get(index) else {
            return out_of_range("accessors", index, self.document.accessors.len());
        };
        match self.elements_left.checked_sub(accessor.count) {
            Some(left) => self.elements_left = left,
            None => {
                let problem =
                    format!("has {} elements, more than are left of {MAX_ELEMENTS}", accessor.count);
                return invalid(at, problem, "split the file or thin out its meshes");
            }
        }
        Ok(accessor)
    }

    fn decode<T>(
        &self,
        at: &str,
        accessor: &Accessor,
        element_size: usize,
        decode: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, LoadError> {
        let Some(view) = accessor.buffer_view else {
            return invalid(
                at,
                "has no bufferView",
                "a mesh needs data; all-zero accessors are not supported",
            );
        };
        let elements = self.elements(at, view, accessor.byte_offset, element_size, accessor.count, true)?;
        let mut values: Vec<T> = (0..elements.count).map(|i| decode(elements.get(i))).collect();
        if let Some(sparse) = &accessor.sparse {
            let at = format!("{at}.sparse");
            let component = Component::new(&at, sparse.indices.component_type)?;
            if !is_index(component) {
                let problem = format!("has indices of component type {}", sparse.indices.component_type);
                return invalid(at, problem, "they must be of 5121, 5123 or 5125");
            }
            let (ix, vx) = (&sparse.indices, &sparse.values);
            let places =
                self.elements(&at, ix.buffer_view, ix.byte_offset, component.size(), sparse.count, false)?;
            let news =
                self.elements(&at, vx.buffer_view, vx.byte_offset, element_size, sparse.count, false)?;
            for i in 0..sparse.count {
                let place = index_value(component, places.get(i)) as usize;
                match values.get_mut(place) {
                    Some(value) => *value = decode(news.get(i)),
                    None => {
                        let problem = format!("replaces element {place}");
                        return invalid(at, problem, format!("the accessor has {}", accessor.count));
                    }
                }
            }
        }
        Ok(values)
    }

    /// Bounds-checks a run of elements; only vertex data may be strided.
    fn elements(
        &self,
        at: &str,
        view_index: usize,
        offset: usize,
        size: usize,
        count: usize,
        strided: bool,
    ) -> Result<Elements<'_>, LoadError> {
        let Some(view) = self.document.buffer_views.get(view_index) else {
            return out_of_range("bufferViews", view_index, self.document.buffer_views.len());
        };
        if let Some(name) = view.extensions.keys().next() {
            let at = format!("bufferViews[{view_index}]");
            return Err(LoadError::UnsupportedExtension { name: name.clone(), at });
        }
        let Some(buffer) = self.buffers.get(view.buffer) else {
            return out_of_range("buffers", view.buffer, self.buffers.len());
        };
        let bytes =
            view.byte_offset.checked_add(view.byte_length).and_then(|end| buffer.get(view.byte_offset..end));
        let Some(bytes) = bytes else {
            let problem = format!("covers {} bytes from {}", view.byte_length, view.byte_offset);
            let expected = format!("buffers[{}] has {}", view.buffer, buffer.len());
            return invalid(format!("bufferViews[{view_index}]"), problem, expected);
        };
        let stride = if strided { view.byte_stride.unwrap_or(size) } else { size };
        if stride < size {
            let problem = format!("has a byteStride of {stride}");
            return invalid(
                format!("bufferViews[{view_index}]"),
                problem,
                format!("{at} has elements of {size}"),
            );
        }
        let end = match count {
            0 => Some(offset),
            _ => (count - 1).checked_mul(stride).and_then(|n| n.checked_add(size)?.checked_add(offset)),
        };
        match end.and_then(|end| bytes.get(offset..end)) {
            Some(bytes) => Ok(Elements { bytes, stride, count }),
            None => {
                let problem =
                    format!("has {count} elements of {size} bytes, {stride} apart, from byte {offset}");
                invalid(at, problem, format!("bufferViews[{view_index}] has {} bytes", view.byte_length))
            }
        }
    }
}

fn is_index(component: Component) -> bool {
    matches!(component, Component::U8 | Component::U16 | Component::U32)
}

fn index_value(component: Component, bytes: &[u8]) -> u32 {
    match component {
        Component::U8 => u32::from(bytes[0]),
        Component::U16 => u32::from(u16::from_le_bytes(array(bytes))),
        _ => u32::from_le_bytes(array(bytes)),
    }
}

fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    std::array::from_fn(|k| bytes[k])
}

pub(super) fn out_of_range<T>(list: &str, index: usize, count: usize) -> Result<T, LoadError> {
    invalid(format!("{list}[{index}]"), "does not exist", format!("there are {count}"))
}
