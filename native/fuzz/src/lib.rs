//! What the fuzz targets do with some bytes: functions that panic where the product is wrong. `cargo test` runs them over
//! the corpus (bih-core/tests/corpus.rs).

mod numbers;
mod queries;
mod saved;

pub use queries::queries;
pub use saved::saved;
