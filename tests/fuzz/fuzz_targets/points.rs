#![no_main]

use std::sync::Once;

#[path = "../entries.rs"]
mod entries;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    // The LAZ decoder may panic in its own thread, which the reader turns into an error.
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let standard = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if std::thread::current().name() != Some("las") {
                standard(panic);
            }
        }));
    });
    entries::run("points", bytes);
});
