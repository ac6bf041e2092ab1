//! The records of a LAS or LAZ file, through `las`.
//!
//! That crate trusts its file: it makes room by numbers in the header, and its decompressor panics where the data is
//! damaged. So the header is checked before it is handed over ([`check`]), the decompressor reads through a [`Guard`], and it
//! runs in a thread of its own, which a panic ends. That also decompresses the next points while the last are in use.

use std::fs::File;
use std::io::{self, BufReader};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use glam::{DVec3, Vec3};
use las::{PointData, PointDataBuilder, Reader};

use super::{Colors, FilePoint, Input, PointLayout, Source};
use crate::error::Result;
use crate::scene::load::ply::first_line;
use crate::scene::load::{GET_IT_AGAIN, unreadable};

mod check;
mod guard;

use check::Checked;
use guard::Guard;

/// Points that are decoded at once, and bytes of them, at most.
const BATCH: u64 = 1 << 16;
const BATCH_BYTES: u64 = 1 << 24;

pub(super) struct Records {
    batches: Receiver<Batch>,
    decoder: Option<JoinHandle<()>>,
    points: std::vec::IntoIter<FilePoint>,
    count: u64,
    layout: PointLayout,
}

/// Points, or why there are no more.
type Batch = Result<(Option<Colors>, Vec<FilePoint>), las::Error>;

impl Records {
    pub(super) fn open(input: &mut Input) -> Result<Self> {
        let open = || File::open(&input.path).map_err(|e| unreadable(&input.path, &e));
        let checked = check::check(open()?, input)?;
        let file = BufReader::with_capacity(super::BUFFER, open()?);
        let (sender, batches) = sync_channel(2);
        let count = checked.count;
        let decode = move || decode(file, checked, &sender);
        let decoder = std::thread::Builder::new().name("las".into()).spawn(decode);
        let decoder = decoder.map_err(|e| {
            let remedy = "end other programs and try again";
            input.error("", format!("cannot be decoded: {e}"), remedy)
        })?;
        let layout = PointLayout::default();
        let points = Vec::new().into_iter();
        let mut records = Self { batches, decoder: Some(decoder), points, count, layout };
        // The layout comes with the first points.
        records.refill(input, 0)?;
        Ok(records)
    }

    /// Waits for more points; none at the end.
    fn refill(&mut self, input: &mut Input, index: u64) -> Result<()> {
        let place = || format!("point {index}");
        match self.batches.recv() {
            Ok(Ok((colors, points))) => {
                self.layout.colors = colors;
                self.points = points.into_iter();
                Ok(())
            }
            Ok(Err(las::Error::Io(e))) if e.kind() == io::ErrorKind::UnexpectedEof => {
                let problem =
                    format!("the file ends here, but its header promises {} of them", self.count);
                Err(input.error(place(), problem, GET_IT_AGAIN))
            }
            Ok(Err(e)) => Err(input.error(place(), first_line(&e), GET_IT_AGAIN)),
            Err(_) => match self.decoder.take().map(JoinHandle::join) {
                Some(Err(_)) => {
                    Err(input.error(place(), "cannot be decompressed from here on", GET_IT_AGAIN))
                }
                _ => Ok(()),
            },
        }
    }
}

impl Source for Records {
    fn layout(&self) -> PointLayout {
        self.layout
    }

    fn next(&mut self, input: &mut Input, index: u64) -> Result<Option<FilePoint>> {
        if self.points.len() == 0 {
            self.refill(input, index)?;
            let done = (index as f64 / self.count.max(1) as f64).min(1.0);
            #[expect(clippy::cast_possible_truncation, reason = "a part of a number of bytes")]
            let bytes = (done * input.total_bytes as f64) as u64;
            input.bytes = if self.points.len() == 0 { input.total_bytes } else { bytes };
        }
        Ok(self.points.next())
    }

    fn place(&self, index: u64) -> String {
        format!("point {index}")
    }
}

/// Sends all points of a file.
fn decode(file: BufReader<File>, checked: Checked, sender: &SyncSender<Batch>) {
    if let Err(e) = try_decode(file, checked, sender) {
        // If nobody waits for it any more, it does not matter.
        let _ = sender.send(Err(e));
    }
}

fn try_decode(
    file: BufReader<File>,
    checked: Checked,
    sender: &SyncSender<Batch>,
) -> Result<(), las::Error> {
    let started = Arc::new(AtomicBool::new(false));
    let is_layered = checked.layers.is_some();
    let mut reader = Reader::new(Guard::new(file, &checked, Arc::clone(&started)))?;
    if is_layered && !started.load(Ordering::Relaxed) {
        let problem = "has no readable table of its chunks";
        return Err(io::Error::new(io::ErrorKind::InvalidData, problem).into());
    }
    let mut data = PointDataBuilder::new().for_header(reader.header()).build();
    let most = BATCH.min(BATCH_BYTES / data.record_len() as u64);
    let mut colors = None;
    loop {
        if reader.fill_points(most, &mut data)? == 0 {
            return Ok(());
        }
        let colors = *colors.get_or_insert_with(|| kind_of_colors(&data));
        if sender.send(Ok((colors, points(&data, colors)))).is_err() {
            return Ok(());
        }
    }
}

/// Files often have colours that nobody filled in: the first points tell.
fn kind_of_colors(data: &PointData) -> Option<Colors> {
    let colored = |mut rgb: Box<dyn Iterator<Item = (u16, u16, u16)> + '_>| {
        rgb.any(|color| color != (0, 0, 0))
    };
    if data.rgb().is_some_and(|rgb| colored(Box::new(rgb))) {
        return Some(Colors::ByLargest);
    }
    data.intensity().any(|intensity| intensity != 0).then_some(Colors::Intensity)
}

fn points(data: &PointData, colors: Option<Colors>) -> Vec<FilePoint> {
    let positions = data.x().zip(data.y()).zip(data.z()).map(|((x, y), z)| DVec3::new(x, y, z));
    let mut points: Vec<FilePoint> =
        positions.map(|position| FilePoint { position, ..Default::default() }).collect();
    match colors {
        Some(Colors::Intensity) => {
            for (point, intensity) in points.iter_mut().zip(data.intensity()) {
                point.color = Vec3::splat(f32::from(intensity));
            }
        }
        Some(_) => {
            for (point, (r, g, b)) in points.iter_mut().zip(data.rgb().into_iter().flatten()) {
                point.color = Vec3::from_array([r, g, b].map(f32::from));
            }
        }
        None => {}
    }
    points
}
