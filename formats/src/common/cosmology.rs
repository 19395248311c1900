//! Cosmological parameters in the header of a snapshot, and whether its numbers are comoving or contain powers of h.

use crate::model::COSMOLOGY_KEY;

/// A relative difference between the time and 1/(1 + z) up to which the time is the scale factor.
const SAME: f64 = 1e-3;

/// What the header of a snapshot states.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Stated {
    pub time: Option<f64>,
    pub redshift: Option<f64>,
    /// H0 over 100 km/s/Mpc, where numbers may be per h.
    pub hubble: Option<f64>,
    /// Whether the run's parameters say that it is cosmological.
    pub is_comoving: Option<bool>,
    /// Share of matter in the critical density, which means something in cosmological runs alone.
    pub matter: Option<f64>,
}

impl Stated {
    /// The scale factor of a cosmological run: the time is 1/(1 + z), and the parameters say so, or z is not 0, or matter and h are those of a universe.
    fn scale_factor(&self) -> Option<f64> {
        let (time, redshift) = (self.time?, self.redshift?);
        let is_scale = redshift.is_finite() && (time * (1.0 + redshift) - 1.0).abs() < SAME;
        (is_scale && self.is_comoving.unwrap_or(redshift != 0.0 || self.is_of_universe())).then_some(time)
    }

    fn is_of_universe(&self) -> bool {
        self.matter.is_some_and(|share| share > 0.0) && self.hubble.is_some_and(|h| h > 0.0 && h != 1.0)
    }

    /// Key and text for the provenance: what its numbers are, which are read as they stand.
    pub fn fact(&self) -> Option<(String, String)> {
        let scale = self.scale_factor()?;
        let hubble = self.hubble.filter(|h| *h > 0.0 && *h != 1.0);
        let per_h = hubble.map_or(String::new(), |h| format!(" and h = {h}"));
        let of_h = if hubble.is_some() { ", and lengths and masses are per h" } else { "" };
        let text = format!(
            "the snapshot is of a cosmological run, at a scale factor of {scale:.6}{per_h}: its lengths are comoving{of_h}, and velocities may be those over \
             sqrt(a); all are taken as they stand, as numbers of a box that does not expand"
        );
        Some((COSMOLOGY_KEY.to_owned(), text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_in_an_expanding_box_are_told_from_others() {
        let stated = |time: f64, redshift: f64, is_comoving: Option<bool>| Stated {
            time: Some(time),
            redshift: Some(redshift),
            hubble: Some(0.7),
            is_comoving,
            matter: None,
        };
        let text = stated(0.25, 3.0, None).fact().unwrap().1;
        assert!(text.contains("0.25") && text.contains("h = 0.7"), "{text}");
        assert!(stated(1.0, 0.0, Some(true)).fact().is_some());
        // Redshifts that are left at 0, or that times do not go with.
        for other in
            [stated(0.0, 0.0, None), stated(1.0, 0.0, None), stated(0.5, 3.0, None), stated(0.25, 3.0, Some(false))]
        {
            assert_eq!(other.fact(), None, "{other:?}");
        }
        assert_eq!(Stated::default().fact(), None);
        // Today, by matter and h; not in a run that does not expand.
        let today = Stated { matter: Some(0.3), ..stated(1.0, 0.0, None) };
        assert!(today.fact().unwrap().1.contains("per h"));
        assert_eq!(Stated { matter: Some(0.3), ..stated(0.0, 0.0, None) }.fact(), None);
        assert_eq!(Stated { hubble: Some(1.0), ..today }.fact(), None);
        assert_eq!(Stated { is_comoving: Some(false), ..today }.fact(), None);
    }
}
