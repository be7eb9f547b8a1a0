//! NumPy arrays in a ZIP archive, one entry each.

use std::io::Cursor;

use miniz_oxide::inflate::decompress_to_vec_with_limit;
use rawzip::{CompressionMethod, ZipArchive, ZipSliceArchive, ZipSliceEntry};

use super::{Array, Contents, LARGEST, Unusable, Variable, npy};

/// Bytes of all arrays together: an archive of a few kilobytes can claim any number.
const MOST: usize = 16 * LARGEST;

pub(super) fn read(bytes: &[u8]) -> Result<Contents, Unusable> {
    let broken = |error: rawzip::Error| Unusable::new(format!("is not a ZIP archive that can be read: {error}"));
    let archive = ZipArchive::from_slice(bytes).map_err(broken)?;
    let mut entries = archive.entries();
    let (mut variables, mut room) = (Vec::new(), MOST);
    while let Some(entry) = entries.next_entry().map_err(broken)? {
        let path = String::from_utf8_lossy(entry.file_path().as_bytes()).into_owned();
        let name = path.strip_suffix(".npy").unwrap_or(&path).to_owned();
        let content = array(&archive, entry.wayfinder(), entry.compression_method(), &mut room);
        variables.push(Variable { name: Some(name), content });
    }
    Ok(Contents { variables })
}

fn array(
    archive: &ZipSliceArchive<&[u8]>,
    place: rawzip::ZipArchiveEntryWayfinder,
    method: CompressionMethod,
    room: &mut usize,
) -> Result<Array, Unusable> {
    let entry = archive.get_entry(place).map_err(|error| Unusable::new(format!("cannot be unpacked: {error}")))?;
    match method {
        CompressionMethod::STORE => checked(&entry, entry.data()),
        CompressionMethod::DEFLATE => {
            let inflated = decompress_to_vec_with_limit(entry.data(), *room)
                .map_err(|error| Unusable::new(format!("cannot be unpacked: {error}")))?;
            *room -= inflated.len();
            checked(&entry, &inflated)
        }
        other => Err(Unusable::new(format!("is packed in a way that is not known ({other:?})"))
            .with_help("save it with np.savez or np.savez_compressed")),
    }
}

/// The array in `bytes`, if these are the ones that were packed.
fn checked(entry: &ZipSliceEntry<'_>, bytes: &[u8]) -> Result<Array, Unusable> {
    let sum = std::io::copy(&mut entry.verifying_reader(Cursor::new(bytes)), &mut std::io::sink());
    sum.map_err(|error| Unusable::new(format!("is damaged: {error}")))?;
    npy::read(bytes)
}
