//! The header of a particle file as pairs of strings, for formats that store only named strings.

use crate::model::RunHeader;
use crate::units::UnitSystem;

/// Before the keys of the provenance.
const PROVENANCE: &str = "provenance ";

/// Everything a header says.
pub fn texts(header: &RunHeader) -> Vec<(String, String)> {
    let u = &header.units;
    let list = |v: &[f64]| v.iter().map(|x| format!("{x:e}")).collect::<Vec<_>>().join(" ");
    let mut facts = vec![
        ("dimension", header.dimension.to_string()),
        ("box_size", list(&header.box_size)),
        ("periodic", list(&header.periodic.map(|p| f64::from(u8::from(p))))),
        ("units_in_cgs", list(&[u.length, u.mass, u.time, u.temperature])),
        ("time", list(&[header.time])),
        ("kernel", header.kernel.clone()),
        ("kernel_neighbors", list(&[header.kernel_neighbors])),
    ];
    if let Some(corner) = header.box_corner.filter(|corner| *corner != [0.0; 3]) {
        facts.push(("box_corner", list(&corner)));
    }
    facts.retain(|(_, value)| !value.is_empty());
    let facts = facts.into_iter().map(|(k, v)| (k.to_owned(), v));
    facts.chain(header.provenance.iter().map(|(k, v)| (format!("{PROVENANCE}{k}"), v.clone()))).collect()
}

/// What could be read of a header.
#[derive(Debug, Clone, Default)]
pub struct Facts {
    pub dimension: Option<usize>,
    pub box_size: Option<[f64; 3]>,
    pub box_corner: Option<[f64; 3]>,
    pub periodic: Option<[bool; 3]>,
    pub units: Option<UnitSystem>,
    pub time: Option<f64>,
    pub kernel: String,
    pub kernel_neighbors: f64,
    pub provenance: Vec<(String, String)>,
}

impl Facts {
    /// Takes the pairs that are understood and make sense; others are no facts of a header.
    pub fn new<'a>(texts: impl Iterator<Item = (&'a str, &'a str)>) -> Self {
        let mut facts = Self::default();
        for (key, value) in texts {
            let numbers = || -> Option<Vec<f64>> { value.split_whitespace().map(|v| v.parse().ok()).collect() };
            let three = || numbers().and_then(|v| <[f64; 3]>::try_from(v).ok());
            let one = || numbers().and_then(|v| v.first().copied()).filter(|v| v.is_finite());
            match key {
                "dimension" => facts.dimension = value.trim().parse().ok().filter(|d| (1..=3).contains(d)),
                "box_size" => facts.box_size = three().filter(|b| b.iter().all(|l| l.is_finite() && *l >= 0.0)),
                "box_corner" => facts.box_corner = three().filter(|c| c.iter().all(|x| x.is_finite())),
                "periodic" => facts.periodic = three().map(|p| p.map(|p| p != 0.0)),
                "units_in_cgs" => facts.units = numbers().and_then(|v| system(&v)),
                "time" => facts.time = one(),
                "kernel" => facts.kernel = value.to_owned(),
                "kernel_neighbors" => facts.kernel_neighbors = one().unwrap_or(0.0),
                _ => {
                    if let Some(key) = key.strip_prefix(PROVENANCE) {
                        facts.provenance.push((key.to_owned(), value.to_owned()));
                    }
                }
            }
        }
        facts
    }
}

fn system(v: &[f64]) -> Option<UnitSystem> {
    let [length, mass, time, temperature] = *v else { return None };
    v.iter().all(|x| x.is_finite() && *x > 0.0).then_some(UnitSystem { length, mass, time, temperature })
}

/// A text on one line.
pub fn escaped(text: &str) -> String {
    text.replace('\\', "\\\\").replace('\n', "\\n").replace('\r', "\\r")
}

/// The text that [`escaped`] had.
pub fn unescaped(line: &str) -> String {
    let mut text = String::with_capacity(line.len());
    let mut chars = line.chars();
    while let Some(c) = chars.next() {
        match (c, if c == '\\' { chars.next() } else { None }) {
            ('\\', Some('n')) => text.push('\n'),
            ('\\', Some('r')) => text.push('\r'),
            ('\\', Some(other)) => text.push(other),
            _ => text.push(c),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_survives_as_text() {
        let header = RunHeader {
            dimension: 2,
            box_size: [0.1, 1.0 / 3.0, 0.0],
            box_corner: Some([-0.05, 0.0, 1e-300]),
            periodic: [true, false, false],
            units: UnitSystem::solar(),
            time: 1e-300,
            kernel: "M4".into(),
            kernel_neighbors: 48.0,
            provenance: vec![("Scene".into(), "a: 1\n\\n b\r\n".into())],
            layouts: Vec::new(),
        };
        let texts = texts(&header);
        let kept: Vec<_> = texts.iter().map(|(k, v)| (k.clone(), unescaped(&escaped(v)))).collect();
        assert_eq!(texts, kept);
        let back = Facts::new(kept.iter().map(|(k, v)| (k.as_str(), v.as_str())));
        assert_eq!((back.dimension, back.box_size, back.units), (Some(2), Some(header.box_size), Some(header.units)));
        assert_eq!(back.box_corner, header.box_corner);
        assert_eq!((back.periodic, back.time), (Some(header.periodic), Some(1e-300)));
        assert_eq!(back.provenance, header.provenance);
    }

    #[test]
    fn nonsense_is_no_fact() {
        let facts = Facts::new([("dimension", "7"), ("box_size", "1 2"), ("units_in_cgs", "1 -1 1 1")].into_iter());
        assert!(facts.dimension.is_none() && facts.box_size.is_none() && facts.units.is_none());
        assert_eq!(unescaped("a\\"), "a\\");
    }
}
