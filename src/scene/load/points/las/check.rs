//! What a header says, held against the length of its file.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};

use las::{Builder, Header, raw};

use super::Input;
use crate::error::Result;
use crate::scene::load::ply::first_line;
use crate::scene::load::{GET_IT_AGAIN, REPAIR, unreadable};

/// What the decoder needs to know of a file whose header is in order.
pub(super) struct Checked {
    /// Points that the header promises.
    pub(super) count: u64,
    /// Bytes of a point.
    pub(super) record_bytes: u64,
    /// Where the points begin in the file.
    pub(super) start: u64,
    pub(super) file_bytes: u64,
    /// How many layers each chunk has, in files that store the fields of their points apart.
    pub(super) layers: Option<u64>,
}

/// Bytes of a variable length record without its data, and of an extended one.
const RECORD_HEAD: u64 = 54;
const EXTENDED_HEAD: u64 = 60;
/// Where the length of the data stands in an extended one.
const EXTENDED_LENGTH_AT: u64 = 20;

/// Refuses a header that the file cannot hold what it promises.
pub(super) fn check(file: File, input: &Input) -> Result<Checked> {
    let mut file = BufReader::new(file);
    let bad = |problem: String| input.error("", problem, GET_IT_AGAIN);
    let raw = raw::Header::read_from(&mut file)
        .map_err(|e| bad(format!("has a bad header: {}", first_line(&e))))?;
    let (start, length) = (u64::from(raw.offset_to_point_data), input.total_bytes);
    let records = u64::from(raw.number_of_variable_length_records) * RECORD_HEAD;
    if u64::from(raw.header_size) + records > start || start > length {
        let problem = format!("says that its points begin at byte {start} of {length}");
        return Err(bad(problem));
    }
    for (axis, scale, offset) in [
        ("x", raw.x_scale_factor, raw.x_offset),
        ("y", raw.y_scale_factor, raw.y_offset),
        ("z", raw.z_scale_factor, raw.z_offset),
    ] {
        if !(scale.is_finite() && offset.is_finite() && scale != 0.0) {
            let problem = format!("scales {axis} by {scale} from {offset}");
            return Err(input.error("", problem, REPAIR));
        }
    }
    let large = raw.large_file.map_or(0, |large| large.number_of_point_records);
    let count = match u64::from(raw.number_of_point_records) {
        0 => large,
        count => count,
    };
    let record_bytes = u64::from(raw.point_data_record_length);
    let promised = u128::from(count) * u128::from(record_bytes);
    let held = u128::from(length - start);
    // Seven bits: the eighth says that it is compressed.
    let is_compressed = raw.point_data_record_format & 0x80 != 0;
    if !is_compressed && promised > held {
        let problem = format!("promises {count} points ({promised} bytes), but only {held} follow");
        return Err(bad(problem));
    }
    if promised > u128::from(u64::MAX >> 1) {
        return Err(bad(format!("promises {count} points")));
    }
    if let Some(extended) = raw.evlr {
        check_extended(&mut file, extended.start_of_first_evlr, input)?;
    }
    let mut checked = Checked { count, record_bytes, start, file_bytes: length, layers: None };
    file.rewind().map_err(|e| unreadable(&input.path, &e))?;
    let header =
        Header::new(&mut file).map_err(|e| bad(format!("has a bad header: {}", first_line(&e))))?;
    if is_compressed {
        check_chunks(&mut file, &checked, input)?;
        checked.layers = layers(&header, input)?;
    }
    Ok(checked)
}

/// The first extended record is read whole.
fn check_extended(file: &mut BufReader<File>, start: u64, input: &Input) -> Result<()> {
    let mut bytes = [0; 8];
    let fits = start.checked_add(EXTENDED_HEAD).is_some_and(|end| end <= input.total_bytes)
        && read_at(file, start + EXTENDED_LENGTH_AT, &mut bytes).is_some()
        && u64::from_le_bytes(bytes) <= input.total_bytes - start - EXTENDED_HEAD;
    if fits {
        return Ok(());
    }
    let problem = format!("has no extended record at byte {start} of {}", input.total_bytes);
    Err(input.error("", problem, GET_IT_AGAIN))
}

fn read_at<const N: usize>(file: &mut BufReader<File>, at: u64, bytes: &mut [u8; N]) -> Option<()> {
    file.seek(SeekFrom::Start(at)).ok()?;
    file.read_exact(bytes).ok()
}

/// There is room for as many chunks as the table has, before it is read.
fn check_chunks(file: &mut BufReader<File>, checked: &Checked, input: &Input) -> Result<()> {
    let Checked { start, file_bytes, record_bytes, .. } = *checked;
    let mut place = [0; 8];
    let mut count = [0; 4];
    let mut table = |at: u64| {
        read_at(file, at, &mut place)?;
        let table = u64::from_le_bytes(place);
        // A version comes first.
        let after = (start + 8..=file_bytes).contains(&table).then_some(table + 4)?;
        read_at(file, after, &mut count)
    };
    // Who could not go back to write it has put it at the end.
    let found = table(start).or_else(|| table(file_bytes.checked_sub(8)?));
    let chunks = u64::from(u32::from_le_bytes(count));
    if found.is_none() || chunks.saturating_mul(record_bytes) > file_bytes {
        let problem = "has no readable table of its chunks";
        return Err(input.error("", problem, GET_IT_AGAIN));
    }
    Ok(())
}

/// Holds what is compressed against what the point format says, and counts the layers of a chunk.
fn layers(header: &Header, input: &Input) -> Result<Option<u64>> {
    let bad = |problem: String| input.error("", problem, GET_IT_AGAIN);
    let said = |e: las::Error| bad(format!("has a bad header: {}", first_line(&e)));
    let mut plain = Builder::from(header.version());
    plain.point_format = *header.point_format();
    let mut plain = plain.into_header().map_err(said)?;
    plain.add_laz_vlr().map_err(said)?;
    let (found, wanted) = (header.laz_vlr().map_err(said)?, plain.laz_vlr().map_err(said)?);
    let same = found.items().len() == wanted.items().len()
        && found.items().iter().zip(wanted.items()).all(|(found, wanted)| {
            (found.item_type(), found.size()) == (wanted.item_type(), wanted.size())
        });
    if !same {
        return Err(bad("compresses other fields than its points have".into()));
    }
    let layers = |item: u16, bytes: u16| match item {
        POINT_14 => 9,
        RGB_NIR_14 => 2,
        BYTES_14 => u64::from(bytes),
        _ => 1,
    };
    let is_layered = found.items().iter().any(|item| item.version() >= FIRST_LAYERED);
    let layers = found.items().iter().map(|item| layers(item.item_type().into(), item.size()));
    Ok(is_layered.then(|| layers.sum()))
}

/// Numbers of fields in the LASzip specification, and the first version of its compressors that stores layers.
const POINT_14: u16 = 10;
const RGB_NIR_14: u16 = 12;
const BYTES_14: u16 = 14;
const FIRST_LAYERED: u16 = 3;
