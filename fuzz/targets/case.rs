//! Case files, from text to the first mesh.
#![no_main]

#[path = "../../tests/fuzz/follow.rs"]
mod follow;

libfuzzer_sys::fuzz_target!(|text: &str| {
    if !follow::generates_many(text) {
        follow::case_text(text);
    }
});
