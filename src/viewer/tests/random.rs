//! Whatever hands do, nothing breaks. `CATOPTRIC_LONG_TESTS=1` does it for three minutes and looks at the memory.

use eframe::egui::{Event, Key, Modifiers, PointerButton, vec2};

use super::*;

/// Keys that do something, and some that do not.
const KEYS: [Key; 18] = [
    Key::W,
    Key::A,
    Key::S,
    Key::D,
    Key::Q,
    Key::E,
    Key::F,
    Key::R,
    Key::C,
    Key::I,
    Key::P,
    Key::H,
    Key::Num1,
    Key::Num4,
    Key::Escape,
    Key::Home,
    Key::Tab,
    Key::Enter,
];

/// Numbers of a linear congruence.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: u64) -> u64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % n
    }

    fn share(&mut self) -> f32 {
        self.below(1000) as f32 / 999.0
    }
}

/// Resident memory, bytes, where the system tells.
fn memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/statm").ok()?;
    Some(text.split_whitespace().nth(1)?.parse::<u64>().ok()? * 4096)
}

#[test]
fn random_input_breaks_nothing() {
    let long = std::env::var_os("CATOPTRIC_LONG_TESTS").is_some();
    let minute = Duration::from_secs(if long { 60 } else { 2 });
    let (_folder, path) = small();
    let mut hands = opened(&path, [700.0, 500.0], Settings::default());
    hands.step();
    until_drawn(&mut hands);
    let (mut after, mut steps) = (Vec::new(), 0);
    for _ in 0..3 {
        // The same again: what is done for the first time takes memory that allocators and drivers keep.
        let mut dice = Dice(7);
        let start = Instant::now();
        while start.elapsed() < minute {
            act(&mut hands, &mut dice);
            hands.step();
            steps += 1;
            // A window paints all the time; what it has sent to its device is only let go of then.
            if long && steps % 4 == 0 {
                hands.render().expect("it paints");
            }
        }
        // All minutes end with the same window, long ones with the same scene however finely it was sampled.
        hands.set_size(vec2(700.0, 500.0));
        let viewer = viewer_mut(&mut hands);
        viewer.settings = Settings::default();
        viewer.selected = None;
        if long {
            viewer.prepare = opening("").prepare;
            let before = viewer.prepared.as_ref().map(|p| p.generation);
            viewer.open(std::slice::from_ref(&path));
            until(&mut hands, "the scene", |viewer| {
                viewer.prepared.as_ref().map(|p| p.generation) != before
            });
        } else {
            hands.step();
        }
        until_drawn(&mut hands);
        for _ in 0..4 {
            hands.step();
            if long {
                hands.render().expect("it paints");
            }
        }
        after.push(memory());
    }
    for eye in [viewer(&hands).eye.position, viewer(&hands).eye.target] {
        assert!(eye.is_finite());
    }
    assert!(viewer(&hands).shots > 3);
    if let (true, &[_, Some(first), Some(second)]) = (long, after.as_slice()) {
        assert!(second <= first + (16 << 20), "{first} bytes grew to {second}");
    }
}

fn act(hands: &mut Hands<'_>, dice: &mut Dice) {
    let whole = hands.ctx.content_rect().size();
    let mut at = || (vec2(dice.share(), dice.share()) * whole).to_pos2();
    let (from, to) = (at(), at());
    match dice.below(10) {
        0..=3 => {
            // Not on the bar: quitting and dialogs are not for machines.
            let buttons = [PointerButton::Primary, PointerButton::Secondary, PointerButton::Middle];
            let button = buttons[usize::try_from(dice.below(3)).unwrap_or(0)];
            if from.y > 40.0 && to.y > 40.0 {
                drag(hands, button, from, to);
            }
        }
        4 => hands.event(Event::MouseWheel {
            unit: egui::MouseWheelUnit::Point,
            delta: vec2(0.0, 200.0 * (dice.share() - 0.5)),
            phase: egui::TouchPhase::Move,
            source: egui::MouseWheelSource::Unknown,
            modifiers: Modifiers::NONE,
        }),
        5 => hands.event(Event::Zoom(0.5 + dice.share())),
        6 if dice.below(4) == 0 => {
            let size = vec2(200.0 + 800.0 * dice.share(), 150.0 + 600.0 * dice.share());
            hands.set_size(size);
        }
        _ => {
            let key = KEYS[usize::try_from(dice.below(KEYS.len() as u64)).unwrap_or(0)];
            hands.key_press(key);
        }
    }
}
