//! The room table of `src/lib.rs`: which parts of the library may use which.
//!
//! Reads the sources as tokens, without comments, strings and tests, and looks at every path that starts at
//! the root of the crate, be it by `crate::` or by `super::`.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Rooms and what they may use besides themselves and [`ANYONE`].
const ROOMS: [(&str, &[&str]); 14] = [
    ("geometry", &[]),
    ("image", &[]),
    ("camera", &["geometry"]),
    ("accel", &["geometry"]),
    ("scene", &["geometry", "camera", "accel", "image"]),
    ("paths", &["geometry", "camera", "accel", "scene"]),
    ("visibility", &["geometry", "camera", "scene"]),
    ("plan", &["geometry", "camera", "scene", "visibility", "image"]),
    ("cull", &["geometry", "camera", "accel", "scene", "plan"]),
    ("methods", &["geometry", "image", "camera", "accel", "scene", "visibility", "plan", "cull"]),
    ("backend", &["geometry", "image", "camera", "accel", "scene", "visibility", "plan"]),
    (
        "frame",
        &[
            "geometry",
            "image",
            "camera",
            "accel",
            "scene",
            "visibility",
            "plan",
            "cull",
            "methods",
            "backend",
        ],
    ),
    (
        "analysis",
        &[
            "geometry",
            "image",
            "camera",
            "accel",
            "scene",
            "paths",
            "visibility",
            "plan",
            "cull",
            "methods",
            "backend",
            "frame",
        ],
    ),
    (
        "viewer",
        &[
            "geometry",
            "image",
            "camera",
            "accel",
            "scene",
            "paths",
            "visibility",
            "plan",
            "cull",
            "methods",
            "backend",
            "frame",
            "analysis",
        ],
    ),
];
/// What every room may use; these use each other only.
const ANYONE: [&str; 2] = ["error", "context"];
/// The root's re-exports and where they come from.
const REEXPORTS: [(&str, &str); 4] =
    [("Error", "error"), ("Result", "error"), ("Context", "context"), ("Progress", "context")];
/// The binary: a crate of its own, which the library cannot use and which may use all of it.
const BINARY: [&str; 2] = ["main", "commands"];

#[test]
fn every_file_keeps_to_the_room_table() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    list(&root, &mut files);
    files.sort();
    assert!(files.len() > 40, "only {} files: is this the right folder?", files.len());

    let (mut broken, mut rooms) = (String::new(), BTreeSet::new());
    for file in &files {
        let path = file.strip_prefix(&root).expect("it was found there");
        let module = module_path(path);
        let Some(room) = module.first() else { continue };
        if BINARY.contains(&room.as_str()) {
            continue;
        }
        rooms.insert(room.clone());
        let text = std::fs::read_to_string(file).expect("sources are readable");
        for Broken { line, rule } in check(&module, &text) {
            writeln!(broken, "src/{}:{line}: {rule}", path.display()).expect("strings grow");
        }
    }
    assert!(broken.is_empty(), "the room table (src/lib.rs) is broken:\n{broken}");
    let known: BTreeSet<String> =
        ROOMS.iter().map(|r| r.0).chain(ANYONE).map(str::to_owned).collect();
    assert_eq!(rooms, known, "rooms in src/, and in the table");
}

fn list(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("folders are readable") {
        let path = entry.expect("entries are readable").path();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        // Tests may look at anything.
        if stem == "tests" || stem.ends_with("_tests") {
            continue;
        }
        if path.is_dir() {
            list(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
}

/// `accel/kd_tree/build.rs` is accel, kd_tree, build; the root has no name.
fn module_path(path: &Path) -> Vec<String> {
    let names = path.with_extension("");
    let names = names.iter().map(|name| name.to_string_lossy().into_owned());
    names.filter(|name| name != "mod" && name != "lib").collect()
}

/// A use that the table forbids.
#[derive(Debug, PartialEq)]
struct Broken {
    line: usize,
    rule: String,
}

/// Checks the text of one module.
fn check(module: &[String], text: &str) -> Vec<Broken> {
    let room = module[0].as_str();
    let allowed = ROOMS.iter().find(|r| r.0 == room).map_or(&[][..], |r| r.1);
    let mut broken = Vec::new();
    for (line, name) in root_names(module, &without_tests(tokens(text))) {
        let used = REEXPORTS.iter().find(|r| r.0 == name).map_or(name.as_str(), |r| r.1);
        let known = ANYONE.contains(&used) || ROOMS.iter().any(|r| r.0 == used);
        let rule = if !known {
            format!("`{name}` of the crate's root is in no room")
        } else if used == room || ANYONE.contains(&used) || allowed.contains(&used) {
            continue;
        } else {
            let allowed: Vec<&str> = allowed.iter().copied().chain(ANYONE).collect();
            format!("{room} may not use {used}, only {}", allowed.join(", "))
        };
        broken.push(Broken { line, rule });
    }
    broken
}

/// A word, `::` or another sign, and its line.
type Token = (usize, String);

fn tokens(text: &str) -> Vec<Token> {
    let (mut list, mut line, mut rest) = (Vec::new(), 1, text);
    while let Some(first) = rest.chars().next() {
        let word = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        let raw = rest.strip_prefix(['r', 'b', 'c']).unwrap_or(rest);
        let raw = raw.strip_prefix('r').unwrap_or(raw);
        let hashes = raw.len() - raw.trim_start_matches('#').len();
        let end = |from: usize, mark: &str| {
            rest[from..].find(mark).map_or(rest.len(), |at| from + at + mark.len())
        };
        let length = if rest.starts_with("//") {
            end(0, "\n") - usize::from(rest.contains('\n'))
        } else if rest.starts_with("/*") {
            end(2, "*/")
        } else if raw.len() < rest.len() && raw[hashes..].starts_with('"') {
            let open = rest.len() - raw.len() + hashes + 1;
            if rest[..open].contains('r') {
                end(open, &format!("\"{}", "#".repeat(hashes)))
            } else {
                open - 1 + quoted(&rest[open - 1..], '"')
            }
        } else if first == '"' {
            quoted(rest, '"')
        } else if first == '\'' {
            // A character, or a lifetime: those have no second quote behind one character.
            let mut inner = rest[1..].chars();
            match (inner.next(), inner.next()) {
                (Some('\\'), _) | (Some(_), Some('\'')) => quoted(rest, '\''),
                _ => 1,
            }
        } else if word > 0 {
            list.push((line, rest[..word].to_owned()));
            word
        } else if rest.starts_with("::") {
            list.push((line, "::".to_owned()));
            2
        } else {
            if !first.is_whitespace() {
                list.push((line, first.to_string()));
            }
            first.len_utf8()
        };
        line += rest[..length].matches('\n').count();
        rest = &rest[length..];
    }
    list
}

/// Length of a literal with its quotes.
fn quoted(text: &str, quote: char) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if c == quote => return at + c.len_utf8(),
            _ => {}
        }
    }
    text.len()
}

/// Takes out each item behind `#[cfg(test)]`.
fn without_tests(tokens: Vec<Token>) -> Vec<Token> {
    let mark = ["#", "[", "cfg", "(", "test", ")", "]"];
    let is = |at: usize, word: &str| tokens.get(at).is_some_and(|t| t.1 == word);
    let (mut kept, mut i) = (Vec::new(), 0);
    while i < tokens.len() {
        if !mark.iter().enumerate().all(|(k, word)| is(i + k, word)) {
            kept.push(tokens[i].clone());
            i += 1;
            continue;
        }
        i += mark.len();
        // Up to a `;` or the end of a block outside of all brackets; attributes stay outside of blocks.
        let mut depth = 0;
        while i < tokens.len() {
            let word = tokens[i].1.as_str();
            depth += match word {
                "{" | "(" | "[" => 1,
                "}" | ")" | "]" => -1,
                _ => 0,
            };
            i += 1;
            if depth == 0 && (word == ";" || word == "}") {
                break;
            }
        }
    }
    kept
}

/// The names that follow the crate's root, in paths and in groups.
fn root_names(module: &[String], tokens: &[Token]) -> Vec<Token> {
    let word = |at: usize| tokens.get(at).map_or("", |t| t.1.as_str());
    let mut names = Vec::new();
    // How deep in braces, and at which depths there are modules within the file.
    let (mut depth, mut inner) = (0, Vec::new());
    let mut i = 0;
    while i < tokens.len() {
        match word(i) {
            "{" => {
                depth += 1;
                if i >= 2 && word(i - 2) == "mod" {
                    inner.push(depth);
                }
            }
            "}" => {
                inner.pop_if(|d| *d == depth);
                depth -= 1;
            }
            _ => {}
        }
        let mut supers = 0;
        while word(i) == "super" && word(i + 1) == "::" {
            supers += 1;
            i += 2;
        }
        let rooted = word(i) == "crate" && word(i + 1) == "::";
        if rooted {
            i += 2;
        }
        if rooted || supers > 0 && supers == module.len() + inner.len() {
            group(tokens, i, &mut names);
        }
        i += usize::from(!rooted && supers == 0);
    }
    names
}

/// The name at `i`, or the first name of each path in the group there.
fn group(tokens: &[Token], i: usize, names: &mut Vec<Token>) {
    let Some(token) = tokens.get(i) else { return };
    if token.1 != "{" {
        names.push(token.clone());
        return;
    }
    let (mut depth, mut first) = (0, false);
    for token in &tokens[i..] {
        match token.1.as_str() {
            "{" => depth += 1,
            "}" => depth -= 1,
            _ if depth == 1 && first => names.push(token.clone()),
            _ => {}
        }
        first = depth == 1 && (token.1 == "{" || token.1 == ",");
        if depth == 0 {
            return;
        }
    }
}

mod checker {
    use super::{check, module_path};
    use std::path::Path;

    /// Lines that break a rule.
    fn lines(file: &str, text: &str) -> Vec<usize> {
        check(&module_path(Path::new(file)), text).iter().map(|b| b.line).collect()
    }

    #[test]
    fn each_kind_of_path_is_caught() {
        assert_eq!(
            lines("backend/mod.rs", "use crate::plan::Plan;\nuse crate::cull::Culler;"),
            [2]
        );
        assert_eq!(lines("geometry/aabb.rs", "fn f() -> bool {\n  crate::camera::x()\n}"), [2]);
        assert_eq!(lines("backend/cpu/mod.rs", "use super::super::methods::c3rc;"), [1]);
        assert_eq!(lines("cull.rs", "pub use super::backend::Backend as B;"), [1]);
        assert_eq!(lines("plan.rs", "mod a { use super::super::cull::X; }"), [1]);
        assert_eq!(lines("image/io.rs", "macro_rules! m { () => { $crate::scene::f() } }"), [1]);
        let nested = "use crate::{\n  plan::{Batch, methods},\n  error::Error,\n  frame::{self, Renderer},\n};";
        assert_eq!(lines("cull.rs", nested), [4]);
        let rules = check(&["accel".into()], "use crate::scene::Scene;");
        assert_eq!(rules[0].rule, "accel may not use scene, only geometry, error, context");
    }

    #[test]
    fn what_has_no_room_is_caught() {
        assert_eq!(lines("cull.rs", "use crate::viewer::run;"), [1]);
        assert_eq!(lines("cull.rs", "use crate::nowhere::Orbit;"), [1]);
        assert_eq!(lines("cull.rs", "use crate::*;"), [1]);
        assert_eq!(lines("context.rs", "use crate::geometry::Aabb;"), [1]);
        assert_eq!(lines("nowhere/mod.rs", "use crate::geometry::Aabb;"), [1]);
    }

    #[test]
    fn what_is_allowed_passes() {
        let text = "//! See crate::cull.\nuse crate::{Context, geometry::Aabb, error::Result};\n\
            /* crate::frame */ pub(crate) fn f<'a>(c: char) -> &'a str {\n\
            if c == '\"' || c == '\\'' { r#\"crate::frame \"quoted\" \"# } else { \"\\\" crate::cull\" } }\n\
            use super::super::mesh; pub(super) struct S;";
        assert_eq!(lines("accel/kd_tree/build.rs", text), []);
        assert_eq!(lines("accel/kd_tree/build.rs", &format!("{text}\nuse crate::cull::X;")), [6]);
    }

    #[test]
    fn tests_may_use_anything_and_end_where_they_end() {
        let text = "#[cfg(test)]\n#[path = \"x_tests.rs\"]\nmod tests;\n#[cfg(test)]\nmod more {\n\
            use crate::frame::Renderer; fn f() { if true {} } }\nuse crate::frame::Renderer;";
        assert_eq!(lines("accel/mod.rs", text), [7]);
    }
}
