//! The bytes by which a file is recognized.

pub const NAME: &str = "stl";

/// Bytes before the first triangle of a binary file.
pub const HEADER_BYTES: usize = 84;
/// Bytes of a triangle.
pub const RECORD_BYTES: usize = 50;

/// How far a normal that is not zero may be from a unit vector.
const UNIT: f32 = 0.01;

/// The number of triangles that a binary file declares.
pub fn declared(head: &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(*head.get(80..)?.first_chunk()?))
}

/// Whether the text begins as a file of triangles does.
pub fn is_text(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head).to_ascii_lowercase();
    let mut words = text.split_whitespace();
    words.next() == Some("solid") && text.contains("facet") && !text.contains('\0')
}

/// Whether all records are triangles: with finite corners, and a normal that is zero or a unit vector.
pub fn has_records(head: &[u8]) -> bool {
    let Some(count) = declared(head).filter(|n| *n > 0) else { return false };
    let records = head.get(HEADER_BYTES..).unwrap_or_default().chunks_exact(RECORD_BYTES);
    let number = |record: &[u8], i: usize| {
        record.get(4 * i..).and_then(|b| b.first_chunk()).map_or(f32::NAN, |b| f32::from_le_bytes(*b))
    };
    let is_triangle = |record: &[u8]| {
        let normal = (0..3).map(|k| number(record, k).powi(2)).sum::<f32>();
        (normal == 0.0 || (normal.sqrt() - 1.0).abs() < UNIT) && (3..12).all(|k| number(record, k).is_finite())
    };
    let seen = records.len();
    seen > 0 && seen <= count as usize && records.clone().all(is_triangle)
}
