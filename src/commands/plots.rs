//! What all plots share.

/// Of a plot, pixels.
pub(super) const SIZE: (u32, u32) = (760, 460);
/// Of its labels.
pub(super) const FONT: (&str, i32) = ("sans-serif", 15);

pub(super) fn failed(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow::anyhow!("a plot could not be drawn: {error}")
}
