//! Phantom's parameter file.

use super::facts::{END, Facts, SNAPSHOT, prefix};
use sph::kernel::KernelName;
use sph_formats::common::particle_names as names;
use sph_formats::phantom::LocallyIsothermal;
use std::fmt::Write as _;

impl Facts<'_> {
    pub(super) fn phantom(&self) -> String {
        let prefix = prefix(&self.stem);
        let is_isothermal = LocallyIsothermal::of(self.file).is_some();
        let build = self.phantom_build(is_isothermal);
        let mut text = self.head("#", &format!("phantom {prefix}.in, built by make {build}"));
        let row = |text: &mut String, key: &str, value: String, what: &str| {
            let _ = writeln!(text, "{key:>20} = {value:>12}    ! {what}");
        };
        let number = |v: f64| format!("{v:.6E}");
        row(&mut text, "logfile", format!("{prefix}01.log"), "file to which output is directed");
        row(&mut text, "dumpfile", self.name.clone(), "dump file to start from");
        let header = &self.file.header.units;
        // A dump is in units of time in which G is 1.
        let time = self.time * header.time / sph_formats::phantom::units(header).time;
        row(&mut text, "tmax", number(END * time), "end time");
        row(&mut text, "dtmax", number(SNAPSHOT * time), "time between dumps");
        let of_dust: &[_] = if self.has_dust() { OF_DUST } else { &[] };
        let of_field: &[_] = if self.has_field() { OF_FIELD } else { &[] };
        for (key, value, what) in PHANTOM.iter().chain(of_dust).chain(of_field) {
            let value = if *key == "ieos" && is_isothermal { "6" } else { value };
            let is_read = match *key {
                // A build without gravity has no tree to be accurate.
                "tree_accuracy" => self.phantom_has_gravity(),
                key if OF_ENERGY.contains(&key) => !is_isothermal,
                key if OF_VISCOSITY.contains(&key) => !self.has_disc,
                _ => true,
            };
            if is_read {
                row(&mut text, key, value.to_owned(), what);
            }
        }
        if self.has_disc {
            let what = "act between particles that part as well: shear alone pushes nothing";
            row(&mut text, "disc_viscosity", "T".to_owned(), what);
        }
        row(&mut text, "hfact", number(self.code.setting()), "h in units of particle spacing [h = hfact(m/rho)^(1/3)]");
        text
    }

    /// Whether the gas attracts itself: sinks attract it in any build.
    fn phantom_has_gravity(&self) -> bool {
        self.gravity.is_some() && !self.has_light_gas
    }

    fn has_field(&self) -> bool {
        self.gas.column(names::MAGNETIC_FIELD).is_some()
    }

    /// As particles, or carried by the gas.
    fn has_dust(&self) -> bool {
        let has = |name: &str| self.file.species.iter().any(|s| s.table.column(name).is_some());
        has(names::DUST_TO_GAS_RATIO) || has(names::DUST_FRACTION)
    }

    /// Options of `make`, as far as the file depends on them.
    fn phantom_build(&self, is_isothermal: bool) -> String {
        let mut options = vec![match (self.phantom_has_gravity(), is_isothermal) {
            // A star's setup has a gas with energies of its own.
            (true, true) => "SETUP=empty GRAVITY=yes ISOTHERMAL=yes",
            (false, true) => "SETUP=empty ISOTHERMAL=yes",
            (true, false) => "SETUP=star",
            (false, false) => "SETUP=empty",
        }];
        let further = [
            // A box without a net momentum keeps none where all particles step together; Phantom stops over a tenth of next to nothing.
            (self.file.header.periodic.contains(&true), "PERIODIC=yes IND_TIMESTEPS=no"),
            (self.has_dust(), "DUST=yes"),
            (self.has_field(), "MHD=yes"),
        ];
        options.extend(further.into_iter().filter(|(is_needed, _)| *is_needed).map(|(_, option)| option));
        options.extend(match self.code.kernel {
            KernelName::Quartic => Some("KERNEL=quartic"),
            KernelName::Quintic => Some("KERNEL=quintic"),
            KernelName::WendlandC2 => Some("KERNEL=WendlandC2"),
            KernelName::WendlandC4 => Some("KERNEL=WendlandC4"),
            KernelName::WendlandC6 => Some("KERNEL=WendlandC6"),
            KernelName::CubicSpline | KernelName::Sinc6 => None,
        });
        options.join(" ")
    }
}

/// Options without which Phantom writes the file anew and stops, at its defaults.
const PHANTOM: &[(&str, &str, &str)] = &[
    ("nmax", "-1", "maximum number of timesteps (0=just get derivs and stop)"),
    ("nout", "-1", "write dumpfile every n dtmax (-ve=ignore)"),
    ("twallmax", "000:00", "maximum wall time (hhh:mm, 000:00=ignore)"),
    ("nfulldump", "1", "full dump every n dumps"),
    ("iverbose", "0", "verboseness of log (-1=quiet 0=default 1=allsteps 2=debug 5=max)"),
    ("C_cour", "0.300", "Courant factor"),
    ("C_force", "0.250", "dt_force factor"),
    ("tolv", "1.000E-02", "tolerance on v iterations in timestepping"),
    ("tree_accuracy", "0.500", "tree opening criterion (0.0-1.0)"),
    ("tolh", "1.000E-04", "tolerance on h-rho iterations"),
    ("alpha", "0.000", "MINIMUM shock viscosity parameter"),
    ("alphamax", "1.000", "MAXIMUM shock viscosity parameter"),
    ("beta", "2.000", "non-linear shock viscosity parameter"),
    ("alphau", "1.000", "shock conductivity parameter"),
    ("ieos", "2", "eqn of state (1=isoth;2=adiab;3=locally iso;6=locally iso about a sink;8=barotropic)"),
    ("mu", "2.381", "mean molecular weight"),
    ("ipdv_heating", "1", "heating from PdV work (0=off, 1=on)"),
    ("ishock_heating", "1", "shock heating (0=off, 1=on)"),
    ("icooling", "0", "cooling function (0=off)"),
    ("isink_potential", "0", "sink potential (0=1/r,1=surf)"),
    ("icreate_sinks", "0", "allow automatic sink particle creation"),
    ("h_soft_sinksink", "0.000", "softening length between sink particles"),
    ("f_acc", "0.800", "particles < f_acc*h_acc accreted without checks"),
    ("iexternalforce", "0", "external force (0=none)"),
    ("irealvisc", "0", "physical viscosity type (0=none)"),
    ("shearparam", "0.100", "magnitude of shear viscosity"),
    ("bulkvisc", "0.000", "magnitude of bulk viscosity"),
    ("rkill", "-1.000", "deactivate particles outside this radius (<0 is off)"),
    ("curlv", "F", "output curl v in dump files"),
    ("track_lum", "F", "write du/dt to dump files"),
    ("gw", "F", "calculate gravitational wave strain"),
];

/// Those that only a build whose gas has energies of its own reads, and those that none reads which is told of `disc_viscosity`.
const OF_ENERGY: [&str; 4] = ["alphau", "ipdv_heating", "ishock_heating", "icooling"];
const OF_VISCOSITY: [&str; 3] = ["irealvisc", "shearparam", "bulkvisc"];

/// Those of a build with a magnetic field, at its defaults.
const OF_FIELD: &[(&str, &str, &str)] = &[
    ("alphaB", "1.000", "shock resistivity parameter"),
    ("psidecayfac", "1.000", "div B diffusion parameter"),
    ("overcleanfac", "1.000", "factor to increase div B cleaning speed (decreases timestep)"),
];

/// Those of a build with dust, at its defaults.
const OF_DUST: &[(&str, &str, &str)] = &[
    ("idrag", "1", "gas/dust drag (0=off,1=Epstein/Stokes,2=const K,3=const ts)"),
    ("grainsize", "0.100", "Grain size in cm"),
    ("graindens", "3.000", "Intrinsic grain density in g/cm^3"),
    ("icut_backreaction", "0", "cut the drag on the gas phase (0=no, 1=yes)"),
    ("irecon", "1", "use reconstruction in gas/dust drag (-1=off,0=no slope limiter,1=van leer MC)"),
    ("drag_implicit", "F", "gas/dust drag implicit scheme (works only with IND_TIMESTEPS=no)"),
];
