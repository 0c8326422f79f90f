//! One reader of `tests/fuzz_inputs/readers.rs`, made once.

#[path = "../tests/fuzz_inputs/readers.rs"]
#[allow(dead_code)] // its valid files are written out by tests/fuzz_inputs.rs
mod readers;

use std::cell::OnceCell;

use trajc::memory;

thread_local! {
    static READER: OnceCell<readers::Reader> = const { OnceCell::new() };
}

/// Gives bytes to the reader of this name.
pub fn read(name: &str, bytes: &[u8]) {
    READER.with(|reader| {
        let reader = reader.get_or_init(|| {
            memory::set(16 << 20, memory::Source::Asked);
            readers::readers().into_iter().find(|reader| reader.name == name).expect("a reader's name")
        });
        (reader.read)(bytes);
    });
}
