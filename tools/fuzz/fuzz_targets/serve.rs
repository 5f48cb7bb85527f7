//! Requests of a viewer, and origins: the first byte of an input chooses.

#![no_main]

use libfuzzer_sys::fuzz_target;
use percuss_serve::{Address, AllowedOrigin, Origin, protocol};

fuzz_target!(|bytes: &[u8]| {
    let Some((kind, content)) = bytes.split_first() else { return };
    let text = std::str::from_utf8(content);
    match (kind % 3, text) {
        (0, _) => drop(protocol::binary(content)),
        (1, Ok(text)) => {
            if let Err(error) = protocol::text(text) {
                assert!(protocol::error(&error).len() < 2000);
            }
        }
        (_, Ok(text)) => {
            if let Ok(origin) = text.parse::<Origin>() {
                let shown = origin.to_string();
                assert!(shown.chars().all(|c| c.is_ascii_graphic()), "{shown:?}");
                assert_eq!(shown.parse::<Origin>().expect("an origin"), origin);
            }
            drop((text.parse::<AllowedOrigin>(), text.parse::<Address>()));
        }
        _ => {}
    }
});
