//! Files that a file names: they lie in its folder or below, unless others are allowed. A scene from somewhere must not make
//! the program read what its author could not.

use std::path::{Component, Path, PathBuf};

use crate::error::Error;

/// Where the files lie that a file names.
#[derive(Clone, Copy, Debug)]
pub struct Nearby<'a> {
    /// The folder of the file; empty is the current one.
    pub folder: &'a Path,
    /// Whether they may lie elsewhere, too.
    pub outside: bool,
}

/// Why a name leads to no file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unfound {
    /// There is none.
    Missing,
    /// It is not in the folder.
    Outside,
}

impl<'a> Nearby<'a> {
    /// Of what the file at `path` names.
    pub fn of(path: &'a Path, outside: bool) -> Self {
        Self { folder: path.parent().unwrap_or(Path::new("")), outside }
    }

    /// The file of that name, which is relative to the folder or absolute.
    ///
    /// # Errors
    /// See [`Unfound`].
    pub fn find(&self, name: &str) -> Result<PathBuf, Unfound> {
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { self.folder };
        let path = folder.join(name);
        if self.outside {
            return if path.exists() { Ok(path) } else { Err(Unfound::Missing) };
        }
        // First by the name alone, so that nothing is told of what lies elsewhere; then by where links lead.
        if !stays(Path::new(name)) && !path.starts_with(folder) {
            return Err(Unfound::Outside);
        }
        let plain = |p: &Path| p.canonicalize().map_err(|_| Unfound::Missing);
        let inside = plain(folder)?;
        if !stays(Path::new(name)) {
            // An absolute name, or one that leaves the folder and returns.
            let parent = path.parent().map(plain);
            if !matches!(parent, Some(Ok(parent)) if parent.starts_with(&inside)) {
                return Err(Unfound::Outside);
            }
        }
        if plain(&path)?.starts_with(&inside) { Ok(path) } else { Err(Unfound::Outside) }
    }

    /// The same for the names in exporters' files, which may have backslashes, or name a place on the author's machine: then
    /// a file of that name in the folder itself will do.
    ///
    /// # Errors
    /// See [`Unfound`].
    pub fn find_loosely(&self, name: &str) -> Result<PathBuf, Unfound> {
        let name = name.replace('\\', "/");
        let why = match self.find(&name) {
            Ok(path) => return Ok(path),
            Err(why) => why,
        };
        let last = name.rsplit('/').next().filter(|last| !last.is_empty());
        last.and_then(|last| self.find(last).ok()).ok_or(why)
    }
}

impl Unfound {
    /// As an error of the file or option `name`, at `place`, that names `file`.
    pub fn error(self, name: &str, place: &str, file: &str) -> Error {
        let (problem, remedy) = match self {
            Self::Missing => ("does not exist", "check the name and the folder"),
            Self::Outside => (
                "lies outside of the folder",
                "move it there, or allow it (--allow-outside) if you trust this file",
            ),
        };
        Error::input(name, place, format!("{file} {problem}"), remedy)
    }
}

/// Whether a relative path never leaves where it starts.
fn stays(path: &Path) -> bool {
    let mut depth = 0;
    path.components().all(|part| {
        depth += match part {
            Component::Normal(_) => 1,
            Component::CurDir => 0,
            Component::ParentDir => -1,
            Component::RootDir | Component::Prefix(_) => i32::MIN / 2,
        };
        depth >= 0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn names_do_not_leave_the_folder_unless_allowed() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("scene");
        fs::create_dir_all(folder.join("deep")).unwrap();
        for file in ["secret.ply", "scene/a.ply", "scene/deep/b.ply"] {
            fs::write(root.path().join(file), "x").unwrap();
        }
        let own = Nearby { folder: &folder, outside: false };
        let absolute = folder.join("a.ply");
        let secret = root.path().join("secret.ply");
        for good in ["a.ply", "deep/b.ply", "./deep/../a.ply", absolute.to_str().unwrap()] {
            assert!(own.find(good).is_ok(), "{good}");
        }
        for missing in ["c.ply", "deep/a.ply"] {
            assert_eq!(own.find(missing), Err(Unfound::Missing), "{missing}");
        }
        let there = ["../secret.ply", "deep/../../secret.ply", secret.to_str().unwrap()];
        for bad in there.into_iter().chain(["../nothing.ply", "/etc/passwd", "/"]) {
            assert_eq!(own.find(bad), Err(Unfound::Outside), "{bad}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&secret, folder.join("link.ply")).unwrap();
            assert_eq!(own.find("link.ply"), Err(Unfound::Outside));
        }
        let all = Nearby { folder: &folder, outside: true };
        assert!(there.iter().all(|name| all.find(name).is_ok()));
        assert_eq!(all.find("../nothing.ply"), Err(Unfound::Missing));
    }

    #[test]
    fn exporters_names_are_found_by_their_end() {
        let root = tempfile::tempdir().unwrap();
        fs::create_dir(root.path().join("textures")).unwrap();
        fs::write(root.path().join("textures/a.png"), "x").unwrap();
        fs::write(root.path().join("b.png"), "x").unwrap();
        let own = Nearby { folder: root.path(), outside: false };
        assert!(own.find_loosely("textures\\a.png").is_ok());
        assert!(own.find_loosely("C:\\Users\\me\\b.png").is_ok());
        assert!(own.find_loosely("/home/me/b.png").is_ok());
        assert_eq!(own.find_loosely("/home/me/c.png"), Err(Unfound::Outside));
        assert_eq!(own.find_loosely("textures/c.png"), Err(Unfound::Missing));
        assert_eq!(own.find_loosely(""), Err(Unfound::Outside).or(own.find("")));
    }
}
