//! The directions of the components of a velocity.

/// Along what a component of a velocity points.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Way {
    Axis(usize),
    Outward,
    FromAxis,
    Polar,
    Azimuthal,
}

impl Way {
    /// By the name of a field.
    pub(super) fn named(name: &str) -> Option<Self> {
        Some(match name {
            "v_x" => Self::Axis(0),
            "v_y" => Self::Axis(1),
            "v_z" => Self::Axis(2),
            "v_r" => Self::Outward,
            "v_R" => Self::FromAxis,
            "v_theta" => Self::Polar,
            "v_phi" => Self::Azimuthal,
            _ => return None,
        })
    }

    /// How many dimensions it takes.
    pub(super) fn dimensions(self) -> usize {
        match self {
            Self::Axis(axis) => axis + 1,
            Self::Outward => 1,
            Self::FromAxis | Self::Azimuthal => 2,
            Self::Polar => 3,
        }
    }
}

/// Two directions across `axis` that make a right-handed system with it: x and y across z.
pub(super) fn across(axis: [f64; 3]) -> [[f64; 3]; 2] {
    // The coordinate axis that follows the one that the axis is nearest to: x follows z.
    let nearest = (0..3).max_by(|a, b| axis[*a].abs().total_cmp(&axis[*b].abs())).unwrap_or(2);
    let next = (nearest + 1) % 3;
    let mut first: [f64; 3] = sph::array(|k| f64::from(u8::from(k == next)) - axis[next] * axis[k]);
    let length = first.iter().map(|v| v * v).sum::<f64>().sqrt();
    first = first.map(|v| v / length);
    let second = sph::array(|k| {
        let (a, b) = ((k + 1) % 3, (k + 2) % 3);
        axis[a] * first[b] - axis[b] * first[a]
    });
    [first, second]
}
