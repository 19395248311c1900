//! Integers and real numbers in records.

use crate::common::fortran::Records;
use crate::error::Result;

/// The next record as so many whole numbers of 4 bytes.
///
/// # Errors
/// A record of another length.
pub fn whole(records: &mut Records, location: &str, count: usize) -> Result<Vec<i32>> {
    let bytes = records.exactly(location, 4 * count as u64)?;
    let is_big = records.big_endian;
    let number = |b: &[u8; 4]| if is_big { i32::from_be_bytes(*b) } else { i32::from_le_bytes(*b) };
    Ok(bytes.as_chunks().0.iter().map(number).collect())
}

/// The next record as one number that is not negative.
///
/// # Errors
/// A record of another length, or another number.
pub fn count(records: &mut Records, location: &str) -> Result<usize> {
    let found = whole(records, location, 1)?[0];
    usize::try_from(found)
        .map_err(|_| records.error(location, format!("is {found}, expected a number that is not negative")))
}

/// The next record as so many real numbers, of 8 bytes or 4.
///
/// # Errors
/// A record of another length.
pub fn real(records: &mut Records, location: &str, count: usize) -> Result<Vec<f64>> {
    let bytes = records.record(location, 8 * count as u64)?;
    let is_big = records.big_endian;
    let double = |b: &[u8; 8]| if is_big { f64::from_be_bytes(*b) } else { f64::from_le_bytes(*b) };
    let single = |b: &[u8; 4]| if is_big { f32::from_be_bytes(*b) } else { f32::from_le_bytes(*b) };
    if bytes.len() == 8 * count {
        return Ok(bytes.as_chunks().0.iter().map(double).collect());
    }
    if bytes.len() == 4 * count {
        return Ok(bytes.as_chunks().0.iter().map(|b| f64::from(single(b))).collect());
    }
    let problem = format!("its record has {} bytes, expected {count} numbers of 4 or 8 bytes", bytes.len());
    Err(records.error(location, problem))
}
