//! Where the bytes are: `.glb` chunks, data URIs and files beside the document.

use std::borrow::Cow;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::document::{Buffer, Document};
use super::error::{LoadError, invalid};

const MAGIC: &[u8] = b"glTF";
const JSON_CHUNK: u32 = u32::from_le_bytes(*b"JSON");
const BINARY_CHUNK: u32 = u32::from_le_bytes(*b"BIN\0");

/// Splits a file into its JSON and its binary chunk. A file that does not begin with the `.glb` magic is
/// taken for JSON alone.
pub(super) fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), LoadError> {
    let fail = |message: String| Err(LoadError::Container(message));
    if !bytes.starts_with(MAGIC) {
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        return match text.iter().find(|b| !b.is_ascii_whitespace()) {
            Some(b'{') => Ok((text, None)),
            Some(_) => fail("it begins neither with `glTF` (.glb) nor with `{` (.gltf)".into()),
            None => fail("it is empty".into()),
        };
    }
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        return fail(format!("the file ends after {} bytes, a .glb header has 12", bytes.len()));
    };
    if version != 2 {
        return fail(format!(".glb version {version}, only 2 is supported"));
    }
    let Some(mut rest) = bytes.get(12..length as usize) else {
        return fail(format!("the header says {length} bytes, the file has {}", bytes.len()));
    };
    let (mut json, mut binary) = (None, None);
    while !rest.is_empty() {
        let (Some(size), Some(kind)) = (word(rest, 0), word(rest, 4)) else {
            return fail(format!("{} stray bytes follow the last chunk", rest.len()));
        };
        let Some((chunk, after)) = rest[8..].split_at_checked(size as usize) else {
            return fail(format!("a chunk says {size} bytes, {} are left", rest.len() - 8));
        };
        match kind {
            JSON_CHUNK if json.is_none() => json = Some(chunk),
            BINARY_CHUNK if binary.is_none() => binary = Some(chunk),
            // Chunks of other kinds are to be skipped, says the specification.
            _ => {}
        }
        rest = after;
    }
    match json {
        Some(json) => Ok((json, binary)),
        None => fail("the .glb has no JSON chunk".into()),
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

/// Joins JSON and binary into a `.glb`; `None` if it would exceed the format's 4 GiB.
pub(super) fn join(json: &[u8], binary: &[u8]) -> Option<Vec<u8>> {
    let chunks: Vec<(&[u8], u32, u8)> = [(json, JSON_CHUNK, b' '), (binary, BINARY_CHUNK, 0)]
        .into_iter()
        .filter(|(bytes, ..)| !bytes.is_empty())
        .collect();
    let padded = |bytes: &[u8]| bytes.len().next_multiple_of(4);
    let length = 12 + chunks.iter().map(|(bytes, ..)| 8 + padded(bytes)).sum::<usize>();
    let mut glb = Vec::with_capacity(length);
    glb.extend_from_slice(MAGIC);
    glb.extend_from_slice(&2_u32.to_le_bytes());
    glb.extend_from_slice(&u32::try_from(length).ok()?.to_le_bytes());
    for (bytes, kind, padding) in chunks {
        let size = padded(bytes);
        glb.extend_from_slice(&u32::try_from(size).ok()?.to_le_bytes());
        glb.extend_from_slice(&kind.to_le_bytes());
        glb.extend_from_slice(bytes);
        glb.resize(glb.len() + size - bytes.len(), padding);
    }
    Some(glb)
}

/// The bytes of every buffer, each at least as long as its `byteLength` says.
///
/// `folder` is where relative URIs are looked up; without it there are none to look up.
pub(super) fn buffers<'a>(
    document: &Document,
    binary: Option<&'a [u8]>,
    folder: Option<&Path>,
) -> Result<Vec<Cow<'a, [u8]>>, LoadError> {
    document
        .buffers
        .iter()
        .enumerate()
        .map(|(i, buffer)| {
            let at = format!("buffers[{i}]");
            let bytes = match (&buffer.uri, i, binary) {
                (Some(uri), ..) => Cow::Owned(read_uri(&at, uri, buffer, folder)?),
                (None, 0, Some(binary)) => Cow::Borrowed(binary),
                (None, ..) => return invalid(at, "has no uri", "only a .glb's first buffer may do without"),
            };
            if bytes.len() < buffer.byte_length {
                let problem = format!("holds {} bytes", bytes.len());
                return invalid(at, problem, format!("its byteLength says {}", buffer.byte_length));
            }
            Ok(bytes)
        })
        .collect()
}

fn read_uri(at: &str, uri: &str, buffer: &Buffer, folder: Option<&Path>) -> Result<Vec<u8>, LoadError> {
    let at = format!("{at}.uri");
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((_, encoded)) = data.split_once(";base64,") else {
            return invalid(at, "is a data URI without `;base64,`", "buffers are base64-encoded");
        };
        let config = GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
        return GeneralPurpose::new(&STANDARD, config)
            .decode(encoded)
            .or_else(|error| invalid(at, format!("is not base64: {error}"), "fix the data URI"));
    }
    let Some(folder) = folder else {
        return invalid(
            at,
            format!("names the file `{uri}`"),
            "load the document from its folder, not from bytes",
        );
    };
    let Some(relative) = relative_path(uri) else {
        let expected = "buffers must be data URIs or relative paths that stay in the document's folder";
        return invalid(at, format!("is `{uri}`"), expected);
    };
    let path = folder.join(relative);
    let io = |source| LoadError::Io { path: path.clone(), source };
    let file = std::fs::File::open(&path).map_err(io)?;
    let on_disk = file.metadata().map_err(io)?;
    // Checked before anything is allocated: a hostile byteLength or a device file costs nothing.
    if !on_disk.is_file() || on_disk.len() < buffer.byte_length as u64 {
        let problem = format!("is `{uri}`, a file of {} bytes", on_disk.len());
        return invalid(at, problem, format!("byteLength says {}", buffer.byte_length));
    }
    let mut bytes = Vec::with_capacity(buffer.byte_length);
    file.take(buffer.byte_length as u64).read_to_end(&mut bytes).map_err(io)?;
    Ok(bytes)
}

/// The path a relative URI names, if it stays below the folder it is relative to.
fn relative_path(uri: &str) -> Option<PathBuf> {
    let decoded = percent_decoded(uri)?;
    // A colon is a scheme or a drive, a backslash a separator on Windows alone.
    if decoded.is_empty() || decoded.contains([':', '\\', '\0']) {
        return None;
    }
    let path = PathBuf::from(decoded);
    path.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir)).then_some(path)
}

fn percent_decoded(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        if byte == b'%' {
            let (digits, after) = after.split_at_checked(2)?;
            let digit = |d: u8| (d as char).to_digit(16);
            bytes.push((digit(digits[0])? * 16 + digit(digits[1])?) as u8);
            rest = after;
        } else {
            bytes.push(byte);
            rest = after;
        }
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_paths_stay_in_the_folder() {
        assert_eq!(relative_path("a%20b/c.bin"), Some("a b/c.bin".into()));
        assert_eq!(relative_path("./c.bin"), Some("./c.bin".into()));
        let outside =
            ["/etc/passwd", "../c.bin", "a/../../c.bin", "%2e%2e/c.bin", "%2Fetc/passwd", "C:/c.bin"];
        for uri in outside.into_iter().chain(["http://x/c.bin", "a\\c.bin", "a%00", "a%4", "a%ff", ""]) {
            assert_eq!(relative_path(uri), None, "{uri}");
        }
    }

    #[test]
    fn joined_chunks_come_apart_again() {
        let glb = join(b"{ }", &[1, 2, 3, 4, 5]).expect("small");
        assert_eq!(glb.len() % 4, 0);
        let (json, binary) = split(&glb).expect("just written");
        assert_eq!(json, b"{ } ");
        assert_eq!(binary, Some(&[1, 2, 3, 4, 5, 0, 0, 0][..]));
    }

    #[test]
    fn every_truncation_is_an_error() {
        let glb = join(b"{}", &[7; 16]).expect("small");
        for end in 0..glb.len() {
            assert!(split(&glb[..end]).is_err(), "cut after {end} bytes");
        }
        let header_shorter_than_itself =
            [b"glTF".as_slice(), &2_u32.to_le_bytes(), &11_u32.to_le_bytes()].concat();
        assert!(split(&header_shorter_than_itself).is_err());
    }
}
