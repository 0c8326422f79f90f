//! How large the driving wheels are.

/// Differences beyond this share are mistakes, not wheels.
pub const LARGEST_DIFFERENCE: f64 = 0.1;

/// Radii of the driving wheels: their mean, and by how much they differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelRadii {
    /// Of the left and the right wheel, m.
    pub mean: f64,
    /// The share of the mean by which the right wheel is larger than the left one.
    pub difference: f64,
}

impl WheelRadii {
    /// Of the left and the right wheel, m.
    pub fn sides(&self) -> [f64; 2] {
        [-0.5, 0.5].map(|share| self.mean * (1.0 + share * self.difference))
    }

    /// The difference, where there is one: wheels that are alike go without saying.
    pub fn unlike(&self) -> Option<f64> {
        Some(self.difference).filter(|share| *share != 0.0)
    }
}

/// Both wheels alike, m.
impl From<f64> for WheelRadii {
    fn from(radius: f64) -> Self {
        Self { mean: radius, difference: 0.0 }
    }
}
