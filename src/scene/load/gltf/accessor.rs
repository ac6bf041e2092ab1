//! Numbers in the buffers of a glTF file. The crate's own iterators panic where a stride is less than an element, or fewer
//! values are given than promised; these check first.

use std::path::Path;

use gltf::accessor::{Accessor, DataType};
use gltf::buffer::View;

use super::super::{GET_IT_AGAIN, REPAIR};
use crate::context::Context;
use crate::error::{Error, Result};

/// A file's buffers, and what to call it in errors.
#[derive(Clone, Copy)]
pub(super) struct Numbers<'a> {
    pub path: &'a Path,
    pub buffers: &'a [Vec<u8>],
    pub cx: &'a Context,
}

impl Numbers<'_> {
    /// Vectors of at least `N` components; what they have more is left out. Integers become 0 to 1, or -1 to 1, if they
    /// are normalized.
    pub(super) fn vectors<const N: usize>(&self, accessor: &Accessor<'_>) -> Result<Vec<[f32; N]>> {
        let kind = accessor.data_type();
        let stored = accessor.dimensions().multiplicity();
        if stored < N {
            let problem = format!("has {stored} components where {N} are needed");
            return Err(self.error(accessor.index(), problem, REPAIR));
        }
        let scale = if accessor.normalized() { largest(kind) } else { 1.0 };
        let mut all = vec![[0.0; N]; self.room(accessor, 4 * N)?];
        self.elements(accessor, stored * kind.size(), |i, bytes| {
            for (k, component) in bytes.chunks_exact(kind.size()).take(N).enumerate() {
                #[expect(clippy::cast_possible_truncation, reason = "from f32, or short integers")]
                let value = number(kind, component) as f32;
                all[i][k] = (value / scale).max(if scale > 1.0 { -1.0 } else { f32::MIN });
            }
        })?;
        Ok(all)
    }

    /// Indices of any integer type.
    pub(super) fn indices(&self, accessor: &Accessor<'_>) -> Result<Vec<u32>> {
        let kind = accessor.data_type();
        if !matches!(kind, DataType::U8 | DataType::U16 | DataType::U32) {
            return Err(self.error(accessor.index(), "has indices that are no integers", REPAIR));
        }
        let mut all = vec![0; self.room(accessor, 4)?];
        self.elements(accessor, kind.size(), |i, bytes| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "checked to be of such a type"
            )]
            let index = number(kind, bytes) as u32;
            all[i] = index;
        })?;
        Ok(all)
    }

    /// The number of elements, if they are there or there is room for them.
    fn room(&self, accessor: &Accessor<'_>, bytes: usize) -> Result<usize> {
        let count = accessor.count();
        if let Some(view) = accessor.view() {
            let size = accessor.dimensions().multiplicity() * accessor.data_type().size();
            self.span(accessor.index(), &view, accessor.offset(), count, size)?;
        } else if accessor.sparse().is_none() || count > ZEROS {
            let problem = format!("promises {count} elements and has none");
            return Err(self.error(accessor.index(), problem, REPAIR));
        }
        let what = format!("{count} elements");
        let bytes = (count as u64).saturating_mul(bytes as u64);
        self.cx.room_for(&self.path.display().to_string(), &what, bytes)?;
        Ok(count)
    }

    /// Visits each element that is not zero, with its index.
    fn elements(
        &self,
        accessor: &Accessor<'_>,
        size: usize,
        mut visit: impl FnMut(usize, &[u8]),
    ) -> Result<()> {
        let (index, count) = (accessor.index(), accessor.count());
        if let Some(view) = accessor.view() {
            let (data, stride) = self.span(index, &view, accessor.offset(), count, size)?;
            (0..count).for_each(|i| visit(i, &data[i * stride..i * stride + size]));
        }
        let Some(sparse) = accessor.sparse() else { return Ok(()) };
        let (places, values) = (sparse.indices(), sparse.values());
        let kind = match places.index_type() {
            gltf::accessor::sparse::IndexType::U8 => DataType::U8,
            gltf::accessor::sparse::IndexType::U16 => DataType::U16,
            gltf::accessor::sparse::IndexType::U32 => DataType::U32,
        };
        let some = sparse.count();
        let (at, step) = self.span(index, &places.view(), places.offset(), some, kind.size())?;
        let (data, stride) = self.span(index, &values.view(), values.offset(), some, size)?;
        for i in 0..some {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "an unsigned integer of 32 bits at most"
            )]
            let place = number(kind, &at[i * step..i * step + kind.size()]) as usize;
            if place >= count {
                let problem = format!("replaces element {place} of {count}");
                return Err(self.error(index, problem, REPAIR));
            }
            visit(place, &data[i * stride..i * stride + size]);
        }
        Ok(())
    }

    /// The bytes from an element of a view on, and how far the elements are apart.
    fn span(
        &self,
        accessor: usize,
        view: &View<'_>,
        offset: usize,
        count: usize,
        size: usize,
    ) -> Result<(&[u8], usize)> {
        let stride = view.stride().unwrap_or(size);
        if stride < size {
            let problem = format!("has elements of {size} bytes, {stride} apart");
            return Err(self.error(accessor, problem, REPAIR));
        }
        let buffer = self.buffers.get(view.buffer().index()).map_or(&[][..], Vec::as_slice);
        let end = view.offset().checked_add(view.length());
        let view = end.and_then(|end| buffer.get(view.offset()..end));
        let needed = count
            .checked_sub(1)
            .and_then(|last| last.checked_mul(stride))
            .and_then(|bytes| bytes.checked_add(size));
        let data = view.and_then(|view| view.get(offset..));
        match (data, needed) {
            (Some(data), Some(needed)) if data.len() >= needed => Ok((data, stride)),
            _ => {
                let problem = format!("promises {count} elements that its buffer does not hold");
                Err(self.error(accessor, problem, GET_IT_AGAIN))
            }
        }
    }

    fn error(&self, accessor: usize, problem: impl Into<String>, remedy: &str) -> Error {
        Error::file(self.path, format!("accessor {accessor}"), problem, remedy)
    }
}

/// Elements that are zero unless said otherwise, at most: no exporter writes more of them.
const ZEROS: usize = 1 << 24;

/// The largest value of an integer type, 1 of the others.
fn largest(kind: DataType) -> f32 {
    match kind {
        DataType::I8 => 127.0,
        DataType::U8 => 255.0,
        DataType::I16 => 32_767.0,
        DataType::U16 => 65_535.0,
        DataType::U32 | DataType::F32 => 1.0,
    }
}

/// A component; `bytes` has its size.
fn number(kind: DataType, bytes: &[u8]) -> f64 {
    match (kind, bytes) {
        (DataType::I8, &[a]) => f64::from(i8::from_le_bytes([a])),
        (DataType::U8, &[a]) => f64::from(a),
        (DataType::I16, &[a, b]) => f64::from(i16::from_le_bytes([a, b])),
        (DataType::U16, &[a, b]) => f64::from(u16::from_le_bytes([a, b])),
        (DataType::U32, &[a, b, c, d]) => f64::from(u32::from_le_bytes([a, b, c, d])),
        (DataType::F32, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
        _ => 0.0,
    }
}
