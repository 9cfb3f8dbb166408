//! What to draw of the flow.

use std::str::FromStr;

use super::super::figure::named;

/// Names of the axes.
pub(super) const AXES: [char; 3] = ['x', 'y', 'z'];

named! {
    /// What is drawn in colours.
    Quantity {
        /// Length of the velocity.
        Speed = "speed",
        /// Pressure, but for the same number everywhere.
        Pressure = "pressure",
        /// `sqrt(2 E : E)` of the symmetric part `E` of the velocity gradient.
        StrainRate = "strain-rate",
        /// Component of the curl of the velocity along the axis across the picture.
        Vorticity = "vorticity",
    }
}

impl Quantity {
    /// Name and unit.
    pub(super) fn label(self) -> &'static str {
        match self {
            Self::Speed => "speed (length / time)",
            Self::Pressure => "pressure (viscosity / time)",
            Self::StrainRate => "strain rate (1 / time)",
            Self::Vorticity => "vorticity (1 / time)",
        }
    }
}

/// A plane across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SliceChoice {
    /// The axis: 0 for x, 1 for y, 2 for z.
    pub axis: usize,
    /// Where, in lengths of the case.
    pub at: f64,
}

impl FromStr for SliceChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('=');
        let axis = parts.and_then(|(name, _)| ["x", "y", "z"].iter().position(|axis| *axis == name));
        let at = parts.and_then(|(_, at)| at.parse().ok()).filter(|at: &f64| at.is_finite());
        match (axis, at) {
            (Some(axis), Some(at)) => Ok(Self { axis, at }),
            _ => Err("expected an axis and a place on it, such as z=0.5".into()),
        }
    }
}

/// Options of a picture of the flow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowOptions {
    /// In colours.
    pub quantity: Quantity,
    /// The plane, in 3D; across z through the middle of the box when absent.
    pub slice: Option<SliceChoice>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_quantities_and_slices_are_read() {
        assert_eq!("strain-rate".parse(), Ok(Quantity::StrainRate));
        assert!("strain".parse::<Quantity>().is_err_and(|error| error.contains("speed, pressure")));
        assert_eq!("y=-0.25".parse(), Ok(SliceChoice { axis: 1, at: -0.25 }));
        for wrong in ["0.5", "w=1", "x=", "x=nan"] {
            assert!(wrong.parse::<SliceChoice>().is_err(), "{wrong}");
        }
    }
}
