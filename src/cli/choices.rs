//! Words that options take, as the scene has them.

use crate::seeding::{METHODS, Seeding};
use sph::kernel::KernelName;
use sph_formats::did_you_mean;

/// One of several words, as the scene has them.
fn choice<T: Copy>(text: &str, known: &[(&str, T)]) -> std::result::Result<T, String> {
    known.iter().find(|(name, _)| *name == text).map(|(_, value)| *value).ok_or_else(|| {
        let names = || known.iter().map(|(name, _)| *name);
        format!("expected {}{}", names().collect::<Vec<_>>().join(", "), did_you_mean(text, names()))
    })
}

pub fn kernel(text: &str) -> std::result::Result<KernelName, String> {
    choice(text, &KernelName::ALL.map(|kernel| (kernel.name(), kernel)))
}

pub fn seeding(text: &str) -> std::result::Result<Seeding, String> {
    Seeding::by_name(text)
        .map_or_else(|| choice(text, &METHODS.iter().map(|m| (m.name, m.seeding)).collect::<Vec<_>>()), Ok)
}

pub fn order(text: &str) -> std::result::Result<crate::scene::Order, String> {
    use crate::scene::Order::{Crystal, Isotropic};
    choice(text, &[("crystal", Crystal), ("isotropic", Isotropic)])
}

pub fn boundary(text: &str) -> std::result::Result<crate::scene::BoundaryName, String> {
    use crate::scene::BoundaryName::{Open, Periodic, Reflecting};
    choice(text, &[("periodic", Periodic), ("reflecting", Reflecting), ("open", Open)])
}

pub fn staggering(text: &str) -> std::result::Result<crate::scene::StaggeringName, String> {
    use crate::scene::StaggeringName::{Auto, Centers, InnerFaces, Nodes, OuterFaces};
    let known = [
        ("nodes", Nodes),
        ("outer-faces", OuterFaces),
        ("inner-faces", InnerFaces),
        ("centers", Centers),
        ("auto", Auto),
    ];
    choice(text, &known)
}

pub fn polish(text: &str) -> std::result::Result<crate::scene::Polish, String> {
    use crate::scene::Polish::{Afc, Alaric, DampedRelaxation, None, Solver};
    let known =
        [("solver", Solver), ("alaric", Alaric), ("damped-relaxation", DampedRelaxation), ("afc", Afc), ("none", None)];
    choice(text, &known)
}

pub fn on_interrupt(text: &str) -> std::result::Result<crate::scene::OnInterrupt, String> {
    use crate::scene::OnInterrupt::{Discard, Write};
    choice(text, &[("discard", Discard), ("write", Write)])
}
