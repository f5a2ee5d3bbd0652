#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| bih_fuzz::queries(data, 6));
