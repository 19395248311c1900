//! From placed particles to the file that holds them.

pub mod columns;
