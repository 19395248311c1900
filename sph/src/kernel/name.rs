//! Kernels by name: converts a choice at run time to a type.

use super::shape::Kernel;
use crate::with_kernel;
use serde::{Deserialize, Serialize};

/// The kernels by name, for scenes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum KernelName {
    CubicSpline,
    Quartic,
    Quintic,
    WendlandC2,
    #[default]
    WendlandC4,
    WendlandC6,
    Sinc6,
}

impl KernelName {
    pub const ALL: [Self; 7] = [
        Self::CubicSpline,
        Self::Quartic,
        Self::Quintic,
        Self::WendlandC2,
        Self::WendlandC4,
        Self::WendlandC6,
        Self::Sinc6,
    ];

    /// As scenes and options write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::CubicSpline => "cubic-spline",
            Self::Quartic => "quartic",
            Self::Quintic => "quintic",
            Self::WendlandC2 => "wendland-c2",
            Self::WendlandC4 => "wendland-c4",
            Self::WendlandC6 => "wendland-c6",
            Self::Sinc6 => "sinc6",
        }
    }

    /// The kernel's name in prose.
    pub fn title(self) -> &'static str {
        fn title<K: Kernel>(_: K) -> &'static str {
            K::NAME
        }
        with_kernel!(self, kernel => title(kernel))
    }

    /// The kernel of a title or a name; none of others.
    pub fn titled(text: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kernel| kernel.title() == text || kernel.name() == text)
    }

    /// Norm in `d` dimensions at unit support.
    pub fn sigma(self, d: usize) -> f64 {
        fn sigma<K: Kernel>(_: K, d: usize) -> f64 {
            K::SIGMA[d - 1]
        }
        with_kernel!(self, kernel => sigma(kernel, d))
    }
}

/// Calls `$body` with `$k` bound to the kernel that `$name` names: the one place where the run-time choice
/// becomes a type.
#[macro_export]
macro_rules! with_kernel {
    ($name:expr, $k:ident => $body:expr) => {
        match $name {
            $crate::kernel::KernelName::CubicSpline => {
                let $k = $crate::kernel::CubicSpline;
                $body
            }
            $crate::kernel::KernelName::Quartic => {
                let $k = $crate::kernel::Quartic;
                $body
            }
            $crate::kernel::KernelName::Quintic => {
                let $k = $crate::kernel::Quintic;
                $body
            }
            $crate::kernel::KernelName::WendlandC2 => {
                let $k = $crate::kernel::WendlandC2;
                $body
            }
            $crate::kernel::KernelName::WendlandC4 => {
                let $k = $crate::kernel::WendlandC4;
                $body
            }
            $crate::kernel::KernelName::WendlandC6 => {
                let $k = $crate::kernel::WendlandC6;
                $body
            }
            $crate::kernel::KernelName::Sinc6 => {
                let $k = $crate::kernel::Sinc6;
                $body
            }
        }
    };
}
