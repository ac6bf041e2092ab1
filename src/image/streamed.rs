//! Files that are too large to be made in memory.

use std::fs::OpenOptions;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::io::{output_error, plain, replaceable, write_aside};
use crate::error::Result;

/// Bytes given to the system at once.
const BUFFER: usize = 1 << 20;

/// A file that is written bit by bit and comes to its place whole or not at all, see [`write_bytes`](super::io::write_bytes). Dropped before
/// [`StreamedFile::finish`], it leaves no trace.
pub struct StreamedFile {
    path: PathBuf,
    aside: BufWriter<tempfile::NamedTempFile>,
}

impl StreamedFile {
    /// Begins a file that will be at `path`.
    ///
    /// # Errors
    /// [`Error::Output`](crate::Error::Output) with what the system said.
    pub fn create(path: &Path) -> Result<Self> {
        let aside =
            if replaceable(path) { write_aside(path) } else { tempfile::NamedTempFile::new() };
        let aside = aside.map_err(|error| output_error(path, plain(&error)))?;
        Ok(Self { path: path.to_owned(), aside: BufWriter::with_capacity(BUFFER, aside) })
    }

    /// Puts the file into its place.
    ///
    /// # Errors
    /// [`Error::Output`](crate::Error::Output) with what the system said.
    pub fn finish(mut self) -> Result<()> {
        let place = || {
            self.aside.flush()?;
            let mut aside = self.aside.into_inner()?;
            if replaceable(&self.path) {
                aside.persist(&self.path)?;
            } else {
                aside.rewind()?;
                let mut out =
                    OpenOptions::new().write(true).create(true).truncate(true).open(&self.path)?;
                std::io::copy(&mut aside, &mut out)?;
            }
            Ok(())
        };
        place().map_err(|error: std::io::Error| output_error(&self.path, plain(&error)))
    }
}

impl Write for StreamedFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.aside.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.aside.flush()
    }
}

impl Seek for StreamedFile {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.aside.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_finished_file_takes_its_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows");
        std::fs::write(&path, "old").unwrap();
        let mut file = StreamedFile::create(&path).unwrap();
        file.write_all(b"-new").unwrap();
        drop(file);
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        let mut file = StreamedFile::create(&path).unwrap();
        file.write_all(b"-new").unwrap();
        file.seek(SeekFrom::Start(0)).unwrap();
        file.write_all(b"+").unwrap();
        file.finish().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"+new");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(StreamedFile::create(&folder.path().join("none/rows")).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_are_written_through() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link] = ["file", "link"].map(|name| folder.path().join(name));
        std::os::unix::fs::symlink(&file, &link).unwrap();
        let mut streamed = StreamedFile::create(&link).unwrap();
        streamed.write_all(b"rows").unwrap();
        assert!(!file.exists());
        streamed.finish().unwrap();
        assert!(link.is_symlink());
        assert_eq!(std::fs::read(&file).unwrap(), b"rows");
    }
}
