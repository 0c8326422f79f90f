//! Points spread evenly over a box, the same ones each time (Halton 1960).

/// Coordinate `axis` of point `index` (from 1), in 0..1: the radical inverse of the index to that axis' prime.
pub fn value(axis: usize, index: usize) -> f64 {
    let base = (2usize..).filter(|n| (2..*n).all(|d| n % d != 0)).nth(axis).expect("there is always another prime");
    let (mut value, mut digit, mut rest) = (0.0, 1.0 / base as f64, index);
    while rest > 0 {
        value += digit * (rest % base) as f64;
        digit /= base as f64;
        rest /= base;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::value;

    #[test]
    fn the_first_points_are_the_radical_inverses() {
        assert_eq!([1, 2, 3, 4].map(|index| value(0, index)), [0.5, 0.25, 0.75, 0.125]);
        assert!((value(1, 5) - (2.0 / 3.0 + 1.0 / 9.0)).abs() < 1e-15 && (value(2, 3) - 0.6).abs() < 1e-15);
    }

    #[test]
    fn every_part_of_a_square_gets_its_share() {
        let inside = (1..=3600).filter(|k| value(2, *k) < 0.5 && value(3, *k) < 0.25).count();
        assert!(inside.abs_diff(450) < 15, "{inside}");
    }
}
