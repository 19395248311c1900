//! Pairs that the forces of a code make of particles, and what keeps them apart.

use super::{Neighbors, Sheet, TargetCode};
use sph::kernel::most_neighbors_without_pairs;

/// Part of the most neighbors that make no pairs which is advised, and above which a body is said to be quieter with fewer: a star of 10 000 particles
/// has a tenth to a twentieth of the kinetic energy with 44 neighbors of the cubic spline that it has with 48, in SWIFT (with 46 an eighth) and GADGET-4.
const FEWER: f64 = 0.87;
const NEAR: f64 = 0.93;

impl TargetCode {
    /// What to change where the code's forces make pairs, so that no arrangement is at rest; `None` where they do not.
    pub fn pairing(&self, d: usize) -> Option<String> {
        let most = most_neighbors_without_pairs(self.kernel, d).filter(|most| self.kernel_neighbors(d) > *most)?;
        Some(format!(
            "{} has the pairing instability, and particles leave any arrangement at rest: {}, stays quieter",
            self.with_neighbors(d),
            self.fewer(most, d)
        ))
    }

    /// What to change where the code's forces keep particles apart, and just so: a body at rest is quieter with fewer neighbors. `None` elsewhere.
    pub fn nearly_pairing(&self, d: usize) -> Option<String> {
        let most = most_neighbors_without_pairs(self.kernel, d)?;
        let is_near = (NEAR * most..=most).contains(&self.kernel_neighbors(d));
        is_near.then(|| {
            format!(
                "{} is next to the pairing instability: {}, has a tenth of the motion",
                self.with_neighbors(d),
                self.fewer(most, d)
            )
        })
    }

    fn with_neighbors(&self, d: usize) -> String {
        let (kernel, count) = (self.kernel.title(), self.kernel_neighbors(d));
        format!("{} with {kernel} and {count:.1} neighbors", self.sheet.title)
    }

    /// The setting that is advised, here and in the code.
    fn fewer(&self, most: f64, d: usize) -> String {
        let Sheet { name, parameter, key, .. } = self.sheet;
        let is_whole = self.has_whole_numbers();
        let rounded = |value: f64| if is_whole { value.floor() } else { (value * 100.0).floor() / 100.0 };
        // Counts are those in space here, and those of the dimension in the code.
        let (setting, in_code) = match self.neighbors {
            Neighbors::Count { .. } if d < 3 => {
                let in_code = rounded(FEWER * most);
                let in_space = self.setting_for(self.kernel, d, in_code);
                (if is_whole { in_space.round() } else { rounded(in_space) }, in_code)
            }
            _ => {
                let setting = rounded(self.setting_for(self.kernel, d, FEWER * most));
                (setting, setting)
            }
        };
        format!("--for {name}:{key}={setting}, with {parameter} {in_code} in the code")
    }

    /// What to change where solids with a free surface, or liquids, are to rest in it; `None` where its kernel keeps particles apart.
    pub fn pairing_of_solids(&self, d: usize) -> Option<String> {
        most_neighbors_without_pairs(self.kernel, d)?;
        let Sheet { name, title, has_kernels, .. } = self.sheet;
        let scheme = self.scheme.name;
        has_kernels.then(|| {
            format!(
                "with {} nothing keeps particles apart where a solid has little pressure: those of its surface go on moving along it. --for \
                 {name}:scheme={scheme},wendland-c4, with {title} built with that kernel, is some ten times as quiet",
                self.kernel.title()
            )
        })
    }
}
