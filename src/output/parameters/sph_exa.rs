//! SPH-EXA's command line: the code has no parameter file, and reads its other parameters from the input file.

use super::facts::{END, Facts, SNAPSHOT};

impl Facts<'_> {
    /// Times are real numbers, for it takes integers as numbers of steps.
    pub(super) fn sph_exa(&self) -> String {
        let head = self.head("#", &format!("sh {}.sh [OPTION ...], where sphexa is on the path", self.stem));
        format!(
            "#!/bin/sh\n{head}exec sphexa --init {} --prop {} -s {:e} -w {:e} -f x,y,z,vx,vy,vz,h,m,rho,temp -o {} \"$@\"\n",
            quoted(&self.name),
            self.code.scheme.name,
            END * self.time,
            SNAPSHOT * self.time,
            quoted(&format!("{}_snap.h5", self.stem)),
        )
    }
}

/// A word of a shell's command, whatever it holds.
fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', r"'\''"))
}
