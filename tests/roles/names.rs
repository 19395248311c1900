//! How communities spell the variables of one cloud.

use crate::grids::Field;

pub struct Community {
    pub name: &'static str,
    pub density: &'static str,
    pub velocity: [&'static str; 3],
    pub field: Option<[&'static str; 3]>,
    pub energy: Option<&'static str>,
    pub pressure: Option<&'static str>,
    pub temperature: Option<&'static str>,
    pub helium: Option<&'static str>,
}

const fn community(name: &'static str, density: &'static str, velocity: [&'static str; 3]) -> Community {
    Community { name, density, velocity, field: None, energy: None, pressure: None, temperature: None, helium: None }
}

pub const COMMUNITIES: &[Community] = &[
    Community {
        field: Some(["Bcc1", "Bcc2", "Bcc3"]),
        pressure: Some("press"),
        ..community("Athena++", "rho", ["vel1", "vel2", "vel3"])
    },
    Community {
        field: Some(["Bx1", "Bx2", "Bx3"]),
        pressure: Some("prs"),
        ..community("PLUTO", "rho", ["vx1", "vx2", "vx3"])
    },
    Community {
        field: Some(["magx", "magy", "magz"]),
        energy: Some("eint"),
        pressure: Some("pres"),
        temperature: Some("temp"),
        helium: Some("he4"),
        ..community("FLASH", "dens", ["velx", "vely", "velz"])
    },
    Community {
        energy: Some("eint_e"),
        pressure: Some("pressure"),
        temperature: Some("Temp"),
        helium: Some("X_He"),
        ..community("AMReX", "density", ["x_velocity", "y_velocity", "z_velocity"])
    },
    Community {
        field: Some(["magnetic_field_x", "magnetic_field_y", "magnetic_field_z"]),
        energy: Some("specific_thermal_energy"),
        temperature: Some("temperature"),
        ..community("yt", "density", ["velocity_x", "velocity_y", "velocity_z"])
    },
    Community {
        pressure: Some("air_pressure"),
        temperature: Some("air_temperature"),
        ..community("CF", "air_density", ["u", "v", "w"])
    },
    Community {
        field: Some(["Bx", "By", "Bz"]),
        energy: Some("u"),
        temperature: Some("T"),
        ..community("Phantom", "rho", ["vx", "vy", "vz"])
    },
    Community {
        energy: Some("A1_u"),
        pressure: Some("A1_P"),
        temperature: Some("A1_T"),
        ..community("WoMa", "A1_rho", ["v_x", "v_y", "v_z"])
    },
    Community {
        energy: Some("InternalEnergies"),
        pressure: Some("Pressures"),
        temperature: Some("Temperatures"),
        ..community("SWIFT", "Densities", ["Velocity_x", "Velocity_y", "Velocity_z"])
    },
    Community { pressure: Some("P"), temperature: Some("T"), ..community("GYRE", "rho", ["v_x", "v_y", "v_z"]) },
    Community {
        energy: Some("InternalEnergy"),
        helium: Some("x_mass_fraction_He"),
        ..community("GADGET, MESA", "Density", ["ux", "uy", "uz"])
    },
];

impl Community {
    /// Names with the functions that they stand for; components in an order of their own.
    pub fn variables(&self) -> Vec<(&'static str, Field)> {
        let mut all: Vec<(&'static str, Field)> = vec![
            (self.velocity[2], super::velocity_z),
            (self.density, super::density),
            (self.velocity[0], super::velocity_x),
            (self.velocity[1], super::velocity_y),
        ];
        if let Some([x, y, z]) = self.field {
            all.extend([(y, super::field_y as Field), (x, super::field_x), (z, super::field_z)]);
        }
        for (name, f) in [
            (self.energy, super::energy as Field),
            (self.pressure, super::pressure),
            (self.temperature, super::temperature),
            (self.helium, super::helium),
        ] {
            all.extend(name.map(|name| (name, f)));
        }
        all
    }
}
