//! The methods that `compare` knows: named variations of a scene, each with any seeding.

use crate::error::{Error, Result};
use crate::relaxation::{Bias, Weight, WvtOptions};
use crate::scene::{Polish, Scene};
use crate::seeding::{METHODS, Seeding};

/// A named change to a scene.
#[derive(Debug, Clone, Copy)]
pub struct Variation {
    pub name: &'static str,
    pub summary: &'static str,
    pub reference: &'static str,
    change: fn(&mut Scene),
}

/// All variations, in the order in which reports show them.
pub const VARIATIONS: &[Variation] = &[
    Variation {
        name: "seed",
        summary: "the seeded positions alone",
        reference: "see `sph-prep methods`",
        change: |scene| {
            scene.wvt.iterations = Some(0);
            scene.polish = Some(Polish::None);
        },
    },
    Variation {
        name: "wvt",
        summary: "weighted Voronoi tessellation (WVT) alone, the kernel as weight, bias corrected",
        reference: "Diehl et al. 2015, PASA 32, e048, sec. 4; corrections: this program",
        change: |scene| wvt(scene, Weight::Kernel, Bias::Corrected),
    },
    Variation {
        name: "wvt-inverse-square",
        summary: "WVT alone, inverse-square weight, bias corrected",
        reference: "Diehl et al. 2015, sec. 4; corrections: this program",
        change: |scene| wvt(scene, Weight::InverseSquare, Bias::Corrected),
    },
    Variation {
        name: "wvt-plain",
        summary: "WVT alone as published: inverse-square weight, bias not corrected",
        reference: "Diehl et al. 2015, sec. 4",
        change: |scene| wvt(scene, Weight::InverseSquare, Bias::Plain),
    },
    Variation {
        name: "alaric",
        summary: "WVT, then ALARIC (an algorithm for arbitrary initial conditions): damped dynamics without splitting",
        reference: "the ALARIC paper, sec. 2",
        change: |scene| alaric(scene, 0),
    },
    Variation {
        name: "alaric-split",
        summary: "WVT with few particles, then ALARIC with one splitting",
        reference: "the ALARIC paper, sec. 2.4",
        change: |scene| alaric(scene, 1),
    },
    Variation {
        name: "damped-relaxation",
        summary: "WVT, then ALARIC's dynamics with friction and viscosity alone: no velocity stops, no splitting",
        reference: "the ALARIC paper, sec. 1.4.3",
        change: |scene| scene.polish = Some(Polish::DampedRelaxation),
    },
    Variation {
        name: "afc",
        summary: "away from the closest neighbor, from the seeded positions",
        reference: "the ALARIC paper, sec. 5.3",
        change: |scene| {
            scene.wvt.iterations = Some(0);
            scene.polish = Some(Polish::Afc);
        },
    },
    Variation {
        name: "solver",
        summary: "WVT, then the density solver with the scene's quietness",
        reference: "this program",
        change: |scene| scene.polish = Some(Polish::Solver),
    },
    Variation {
        name: "solver-exact",
        summary: "WVT, then the density solver for the density alone (quietness 0)",
        reference: "this program",
        change: |scene| solver(scene, 0.0),
    },
    Variation {
        name: "solver-quiet",
        summary: "WVT, then the density solver for the least force noise (quietness 1)",
        reference: "this program",
        change: |scene| solver(scene, 1.0),
    },
    Variation { name: "scene", summary: "the scene as it is", reference: "the scene file", change: |_| {} },
];

/// Compared when nothing else is asked for.
pub const DEFAULT: &str = "seed,wvt,wvt-inverse-square,alaric,solver";

fn wvt(scene: &mut Scene, weight: Weight, bias: Bias) {
    scene.wvt.weight = weight;
    scene.wvt.bias = bias;
    scene.polish = Some(Polish::None);
    // From any seeding, also from those that are better without WVT.
    scene.wvt.iterations = scene.wvt.iterations.or(Some(WvtOptions::new(3).iterations));
}

fn alaric(scene: &mut Scene, splittings: usize) {
    scene.polish = Some(Polish::Alaric);
    scene.alaric.splittings = Some(splittings);
}

fn solver(scene: &mut Scene, quietness: f64) {
    scene.polish = Some(Polish::Solver);
    scene.solver.quietness = Some(quietness);
}

/// A variation, with the scene's own seeding or another.
#[derive(Debug, Clone, Copy)]
pub struct Compared {
    pub variation: &'static Variation,
    pub seeding: Option<Seeding>,
}

impl Compared {
    /// `NAME` or `NAME:SEEDING`.
    ///
    /// # Errors
    /// A name that is in neither list; the error has the list.
    pub fn parse(text: &str) -> Result<Self> {
        let (name, seeding) = text.split_once(':').map_or((text, None), |(n, s)| (n, Some(s)));
        let variation = VARIATIONS.iter().find(|v| v.name == name).ok_or_else(|| {
            let names: Vec<&str> = VARIATIONS.iter().map(|v| v.name).collect();
            let problem = format!("'{name}' is unknown, expected {} (or one of them with :SEEDING)", names.join(", "));
            Error::scene("methods", problem)
        })?;
        let seeding = seeding.map(|name| {
            Seeding::by_name(name).ok_or_else(|| {
                let names: Vec<&str> = METHODS.iter().map(|m| m.name).collect();
                Error::scene("methods", format!("seeding '{name}' is unknown, expected {}", names.join(", ")))
            })
        });
        Ok(Self { variation, seeding: seeding.transpose()? })
    }

    /// Several, separated by commas.
    ///
    /// # Errors
    /// As [`Self::parse`]; one that is named twice.
    pub fn parse_list(text: &str) -> Result<Vec<Self>> {
        let mut names: Vec<&str> = Vec::new();
        for name in text.split(',').map(str::trim) {
            if names.contains(&name) {
                return Err(Error::scene("methods", format!("'{name}' is named twice; name each once")));
            }
            names.push(name);
        }
        names.into_iter().map(Self::parse).collect()
    }

    /// As [`Self::parse`] reads it.
    pub fn name(&self) -> String {
        match self.seeding {
            None => self.variation.name.into(),
            Some(seeding) => format!("{}:{}", self.variation.name, seeding.method().name),
        }
    }

    /// The scene that this method runs.
    pub fn apply(&self, scene: &Scene) -> Scene {
        let mut changed = scene.clone();
        (self.variation.change)(&mut changed);
        changed.seeding = self.seeding.or(changed.seeding);
        changed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back_as_written() {
        for name in VARIATIONS.iter().map(|v| v.name.to_string()).chain(["seed:shells".into(), "wvt:random".into()]) {
            assert_eq!(Compared::parse(&name).unwrap().name(), name);
        }
        assert!(Compared::parse_list(DEFAULT).is_ok_and(|list| list.len() > 3));
    }

    #[test]
    fn unknown_names_are_refused_with_the_list() {
        let error = Compared::parse("wtv").unwrap_err().to_string();
        assert!(VARIATIONS.iter().all(|v| error.contains(v.name)), "{error}");
        let error = Compared::parse("seed:shell").unwrap_err().to_string();
        assert!(METHODS.iter().all(|m| error.contains(m.name)), "{error}");
        assert!(Compared::parse_list("wvt, wvt").is_err() && Compared::parse_list("").is_err());
    }

    #[test]
    fn a_method_changes_only_what_it_names() {
        let scene = Scene { seed: 7, seeding: Some(Seeding::Random), ..Scene::default() };
        assert_eq!(Compared::parse("scene").unwrap().apply(&scene), scene);
        let exact = Compared::parse("solver-exact:shells").unwrap().apply(&scene);
        assert_eq!((exact.seed, exact.seeding, exact.solver.quietness), (7, Some(Seeding::Shells), Some(0.0)));
        let seed = Compared::parse("seed").unwrap().apply(&scene);
        assert_eq!(
            (seed.wvt.iterations, seed.polish, seed.seeding),
            (Some(0), Some(Polish::None), Some(Seeding::Random))
        );
    }
}
