//! The window, as a user has it: on a display of its own (Xvfb) with a mouse and keys (xdotool). Where these are missing
//! it says so; CATOPTRIC_REQUIRE_DISPLAY=1 makes that a failure.

use std::fs;
use std::io::{BufRead as _, Write as _};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::{Folder, Run};

/// Longer than anything takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(100);

const SCENE: &str = r##"
name = "small"
[eye]
position = [0.0, 1.2, 3.0]
target = [0.0, 0.5, 0.0]
[[mirror]]
shape = "sphere"
triangles = 800
scale = 0.6
translate = [0.0, 0.6, 0.0]
[[object]]
name = "red"
shape = "sphere"
color = "#d02020"
scale = 0.25
translate = [1.1, 0.25, 0.6]
[[object]]
shape = "ground"
pattern = { kind = "checker", colors = ["#ffffff", "#405060"], period = 0.25 }
scale = 4.0
"##;

/// A display without a screen, whose pixels lie in a file.
struct Display {
    server: Child,
    name: String,
    /// In the X window dump format.
    pixels: PathBuf,
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Whether a program is there.
fn has(program: &str) -> bool {
    let found =
        Command::new("which").arg(program).stdout(Stdio::null()).stderr(Stdio::null()).status();
    found.is_ok_and(|status| status.success())
}

impl Display {
    fn open(folder: &Folder) -> Option<Self> {
        if !has("Xvfb") || !has("xdotool") {
            let required = std::env::var("CATOPTRIC_REQUIRE_DISPLAY").as_deref() == Ok("1");
            assert!(!required, "CATOPTRIC_REQUIRE_DISPLAY is set, but Xvfb or xdotool is missing");
            let _ = writeln!(std::io::stderr(), "window: not tested (no Xvfb or xdotool)");
            return None;
        }
        // The server finds a free number and tells it on this descriptor: its standard output.
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1400x900x24", "-fbdir"])
            .arg(folder.path(""))
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut number = String::new();
        let mut told = std::io::BufReader::new(server.stdout.take().unwrap());
        std::io::BufRead::read_line(&mut told, &mut number).unwrap();
        let name = format!(":{}", number.trim());
        Some(Self { server, name, pixels: folder.path("Xvfb_screen0") })
    }

    fn command(&self, folder: &Folder, line: &str) -> Command {
        let mut command = folder.command(line.split_whitespace());
        // Settings of whoever runs the tests are not theirs.
        command.env("HOME", folder.path("")).env("XDG_DATA_HOME", folder.path("data"));
        command.env_remove("WAYLAND_DISPLAY").env("DISPLAY", &self.name);
        command
    }

    /// The mouse and the keys.
    fn hands(&self, line: &str) {
        let mut command = Command::new("xdotool");
        let done =
            command.env("DISPLAY", &self.name).args(line.split_whitespace()).output().unwrap();
        assert!(done.status.success(), "xdotool {line}: {done:?}");
    }

    /// Red, green and blue of a rectangle of the screen.
    fn seen(&self, [x, y]: [usize; 2], [width, height]: [usize; 2]) -> Vec<[u8; 3]> {
        let bytes = fs::read(&self.pixels).unwrap();
        let word =
            |i: usize| u32::from_be_bytes(bytes[4 * i..4 * i + 4].try_into().unwrap()) as usize;
        // Header size, bytes a line, colours: words 0, 12 and 19 of the X window dump.
        let (start, stride) = (word(0) + 12 * word(19), word(12));
        let pixel = |x: usize, y: usize| {
            let at = start + y * stride + 4 * x;
            [bytes[at + 2], bytes[at + 1], bytes[at]]
        };
        (y..y + height)
            .flat_map(|y| (x..x + width).map(move |x| (x, y)))
            .map(|(x, y)| pixel(x, y))
            .collect()
    }

    /// Until what is seen there satisfies it.
    fn until(&self, what: &str, place: [[usize; 2]; 2], holds: impl Fn(&[[u8; 3]]) -> bool) {
        let start = Instant::now();
        while !holds(&self.seen(place[0], place[1])) {
            assert!(start.elapsed() < PATIENCE, "{what} never came");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

fn red(pixels: &[[u8; 3]]) -> usize {
    pixels.iter().filter(|[r, g, b]| *r > 120 && *g < 70 && *b < 70).count()
}

#[test]
fn without_a_display_it_says_how_to_see_it() {
    let folder = Folder::new();
    folder.write("small.toml", SCENE);
    let alone = |line: &str| {
        let mut command = folder.command(line.split_whitespace());
        command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        folder.finish(command)
    };
    if cfg!(not(target_os = "linux")) {
        return;
    }
    let run = alone("view small.toml");
    assert_eq!(run.code, Some(2), "{}", run.err);
    assert!(run.err.contains("the window: cannot be opened"), "{}", run.err);
    assert!(run.err.contains("ssh -X") && run.err.contains("catoptric render"), "{}", run.err);
    let run = alone("view small.toml --screenshot w.png --json w.png");
    assert_eq!(run.code, Some(2));
    assert!(run.err.contains("names the same file"), "{}", run.err);
    let run = alone("view small.toml --frames 0");
    assert_eq!(run.code, Some(2));
}

#[test]
fn the_window_shows_what_render_draws() {
    let folder = Folder::new();
    folder.write("small.toml", SCENE);
    let Some(display) = Display::open(&folder) else { return };
    let how = "view small.toml --surfels 60000 --size 900x600";
    let shot = display.command(&folder, &format!("{how} --screenshot w.png --json w.json"));
    let run = folder.finish(shot);
    assert_eq!(run.code, Some(0), "{}", run.err);
    let figures = folder.json("w.json");
    let number = |key: &str, i: usize| u32::try_from(figures[key][i].as_u64().unwrap()).unwrap();
    let (width, height) = (number("size", 0), number("size", 1));
    assert!(width > 500 && height > 400, "{figures}");
    folder.good(&format!("render small.toml --surfels 60000 --size {width}x{height} -o r.png"));
    let window = image::load_from_memory(&folder.read("w.png")).unwrap();
    window
        .crop_imm(number("canvas", 0), number("canvas", 1), width, height)
        .to_rgb8()
        .save(folder.path("c.png"))
        .unwrap();
    folder.good("compare c.png r.png --where all --json c.json");
    let flip = folder.json("c.json")["flip"].as_f64().unwrap();
    assert!(flip <= 0.01, "FLIP {flip}");
    // Its bytes even: nothing filters, tints or shifts a picture on its way to the screen.
    let [shown, drawn] = ["c.png", "r.png"]
        .map(|file| image::load_from_memory(&folder.read(file)).unwrap().to_rgb8());
    let others = shown.pixels().zip(drawn.pixels()).filter(|(a, b)| a != b).count();
    assert_eq!(others, 0, "of {} pixels", width * height);
    // The comparison can fail: another view.
    folder.good(&format!(
        "render small.toml --surfels 60000 --eye 1,1,3 --size {width}x{height} -o r.png"
    ));
    folder.good("compare c.png r.png --where all --json c.json");
    assert!(folder.json("c.json")["flip"].as_f64().unwrap() > 0.05);
}

#[test]
fn frames_are_counted_in_the_window() {
    let folder = Folder::new();
    folder.write("small.toml", SCENE);
    let Some(display) = Display::open(&folder) else { return };
    let line = "view small.toml --surfels 20000 --size 480x360 --frames 12 --json f.json";
    let run = folder.finish(display.command(&folder, line));
    assert_eq!(run.code, Some(0), "{}", run.err);
    let figures = folder.json("f.json");
    assert_eq!(figures["frames_rendered"], 12);
    for key in ["fps_median", "ui_blocked_ms_max", "first_picture_ms", "mirror_share"] {
        assert!(figures[key].as_f64().is_some_and(|n| n > 0.0), "{key}: {figures}");
    }
    let [median, p99] = ["median", "p99"].map(|k| figures["frame_ms"][k].as_f64().unwrap());
    assert!(median > 0.0 && p99 >= median);
    assert!(run.out.contains("12 frames") && run.out.contains("frames/s"), "{}", run.out);
    let run = folder.finish(display.command(&folder, "view missing.toml --frames 3"));
    assert_eq!(run.code, Some(2), "{}", run.err);
    assert!(run.err.contains("missing.toml"), "{}", run.err);
}

#[test]
fn a_mouse_and_keys_drive_it() {
    let folder = Folder::new();
    folder.write("small.toml", SCENE);
    let Some(display) = Display::open(&folder) else { return };
    let child = display
        .command(&folder, "view small.toml --surfels 20000 --size 1000x700")
        .spawn()
        .unwrap();
    // Left of the side panel, below the bar.
    let canvas = [[0, 60], [680, 560]];
    display.until("the red ball", canvas, |pixels| red(pixels) > 300);
    display.hands("search --sync --name Catoptric windowfocus");
    std::thread::sleep(Duration::from_millis(300));
    let before = display.seen(canvas[0], canvas[1]);
    // Around the target by dragging the ground.
    display.hands("mousemove 120 560 sleep 0.2 mousedown 1 sleep 0.2 mousemove 160 560 sleep 0.2 mousemove 300 560 sleep 0.2 mouseup 1");
    let differ = |a: &[[u8; 3]], b: &[[u8; 3]]| a.iter().zip(b).filter(|(a, b)| a != b).count();
    display.until("another view", canvas, |pixels| differ(pixels, &before) > 20_000);
    display.hands("key Home");
    display.until("the first view", canvas, |pixels| differ(pixels, &before) < 2000);
    // Two methods: the divider is white from top to bottom.
    display.hands("key c");
    let strip = [[300, 120], [120, 400]];
    display.until("the divider", strip, |pixels| {
        (0..120).any(|x| (0..400).all(|y| pixels[y * 120 + x].iter().all(|&v| v > 240)))
    });
    display.hands("key c");
    // Its own keys do what the help says, and it closes.
    display.hands("key h");
    display.until("the help", canvas, |pixels| differ(pixels, &before) > 20_000);
    display.hands("key Escape");
    display.hands("key ctrl+q");
    let run = Run::of("view".into(), child);
    assert_eq!(run.code, Some(0), "{}", run.err);
}

#[cfg(unix)]
#[test]
fn what_cannot_be_opened_is_told_where_it_was_called_too() {
    let folder = Folder::new();
    folder.write("bad.ply", "ply\nformat ascii 1.0\nelement vertex 3\n");
    let Some(display) = Display::open(&folder) else { return };
    let mut child = display
        .command(&folder, "view bad.ply --size 640x480")
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = String::new();
    let mut lines = std::io::BufReader::new(child.stderr.take().unwrap());
    while !said.contains("error") {
        assert!(lines.read_line(&mut said).unwrap() > 0, "nothing was said: {said}");
    }
    assert!(said.contains("bad.ply"), "{said}");
    assert!(child.try_wait().unwrap().is_none(), "the window stays");
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
}

#[cfg(unix)]
#[test]
fn an_interrupt_closes_it() {
    let folder = Folder::new();
    folder.write("small.toml", SCENE);
    let Some(display) = Display::open(&folder) else { return };
    let child =
        display.command(&folder, "view small.toml --surfels 20000 --size 640x480").spawn().unwrap();
    display.until("the red ball", [[0, 60], [340, 340]], |pixels| red(pixels) > 50);
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    assert_eq!(Run::of("view".into(), child).code, Some(130));
}
