//! Logs of a known robot, with noise and outliers.

use super::*;
use crate::math::noise::Noise;

const TRUE: Geometry = [0.0806, 0.0802, 0.326];
const GUESS: Geometry = [0.08, 0.08, 0.32];

/// A log at 20 Hz of motions that are held for two seconds each, rad/s; `outliers`: the share of poses that jump.
fn log(motions: &[[f64; 2]], noise: PoseNoise, outliers: f64, seed: u64) -> Log {
    let (mut random, mut out) = (Noise::new(seed), Log::default());
    let (mut pose, mut angles) = (Pose2::new(1.0, 2.0, 0.3), [0.0; 2]);
    for k in 0..40 * motions.len() {
        let (time, rate) = (0.05 * k as f64, motions[k / 40]);
        let [a, b, c] = random.normals();
        let jump = if random.uniform() < outliers { 0.3 * random.normal() } else { 0.0 };
        let seen = Pose2::new(
            pose.x + noise.metres * a + jump,
            pose.y + noise.metres * b,
            wrap_angle(pose.yaw + noise.radians * c + jump),
        );
        out.wheels.push((time, angles));
        out.poses.push((time, seen));
        let rims = [TRUE[0] * rate[0], TRUE[1] * rate[1]];
        pose = pose.after_twist(0.5 * (rims[0] + rims[1]), (rims[1] - rims[0]) / TRUE[2], 0.05);
        (0..2).for_each(|side| angles[side] += 0.05 * rate[side]);
    }
    out
}

/// Straight, spins, bends to both sides; there and back.
fn rich() -> Vec<[f64; 2]> {
    let once = [[4.0, 4.0], [-2.0, 2.0], [2.0, -2.0], [3.0, 4.5], [4.5, 3.0], [4.0, 4.0], [-3.0, 3.0], [3.0, -3.0]];
    once.iter().chain(&once).copied().collect()
}

fn chi_square(fit: &Fit) -> f64 {
    let off = Vector3::from([0, 1, 2].map(|k| fit.geometry[k] - TRUE[k]));
    let covariance = Matrix3::from_fn(|i, j| fit.covariance[i][j]);
    (off.transpose() * covariance.try_inverse().expect("regular") * off)[0]
}

#[test]
fn without_noise_radii_and_track_are_found_to_rounding() {
    let fit = fit(&log(&rich(), PoseNoise { metres: 0.0, radians: 0.0 }, 0.0, 1), GUESS, PoseNoise::default())
        .expect("a fit");
    for (found, truth) in fit.geometry.iter().zip(TRUE) {
        assert!((found - truth).abs() < 1e-9, "{:?}", fit.geometry);
    }
    assert_eq!(fit.outliers, 0);
}

#[test]
fn errors_are_as_the_covariance_says() {
    for outliers in [0.0, 0.03] {
        let count = 60;
        let mean = (0..count)
            .map(|seed| {
                chi_square(
                    &fit(&log(&rich(), PoseNoise::default(), outliers, seed), GUESS, PoseNoise::default())
                        .expect("a fit"),
                )
            })
            .sum::<f64>()
            / count as f64;
        // Chi-square of three degrees: mean 3, variance 6; of the mean of 60 a deviation of 0.32. A covariance that is estimated itself,
        // from some hundred pairs, makes it a little larger.
        assert!((1.8..4.5).contains(&mean), "{outliers}: {mean}");
    }
}

#[test]
fn a_wrong_guess_of_the_noise_does_not_spoil_the_covariance() {
    let wrong = PoseNoise { metres: 0.02, radians: 2f64.to_radians() };
    let mean =
        (0..30).map(|s| chi_square(&fit(&log(&rich(), PoseNoise::default(), 0.0, s), GUESS, wrong).expect("a fit")));
    let mean = mean.sum::<f64>() / 30.0;
    assert!((1.5..5.0).contains(&mean), "{mean}");
}

#[test]
fn outliers_hardly_matter_and_are_counted() {
    let clean = fit(&log(&rich(), PoseNoise::default(), 0.0, 5), GUESS, PoseNoise::default()).expect("a fit");
    let dirty = fit(&log(&rich(), PoseNoise::default(), 0.05, 5), GUESS, PoseNoise::default()).expect("a fit");
    for k in 0..3 {
        let sigma = clean.covariance[k][k].sqrt();
        assert!((clean.geometry[k] - dirty.geometry[k]).abs() < 5.0 * sigma, "{k}");
    }
    assert!(dirty.outliers > clean.outliers);
}

#[test]
fn logs_that_do_not_show_a_parameter_are_refused_with_what_to_drive() {
    let noise = PoseNoise::default();
    let straight = fit(&log(&[[4.0, 4.0]; 16], noise, 0.0, 1), GUESS, noise).expect_err("no track");
    assert!(matches!(straight, CalibrateError::Straight(_)) && straight.hint().contains("spins"), "{straight}");
    let still = fit(&log(&[[0.0, 0.0]; 16], noise, 0.0, 1), GUESS, noise).expect_err("no radii");
    assert!(matches!(still, CalibrateError::Still(_)), "{still}");
    let short = fit(&log(&[[4.0, 3.0]], noise, 0.0, 1), GUESS, noise).expect_err("too short");
    assert!(matches!(short, CalibrateError::Short { .. }), "{short}");
    let degrees: Log = {
        let mut log = log(&rich(), noise, 0.0, 1);
        log.wheels.iter_mut().for_each(|(_, angles)| *angles = angles.map(f64::to_degrees));
        log
    };
    assert!(fit(&degrees, GUESS, noise).is_err());
}

#[test]
fn the_remaining_tolerance_is_three_deviations_and_holds_what_is_true() {
    let fit = fit(&log(&rich(), PoseNoise::default(), 0.0, 5), GUESS, PoseNoise::default()).expect("a fit");
    let remaining = fit.remaining();
    let difference = (TRUE[1] - TRUE[0]) / (0.5 * (TRUE[0] + TRUE[1]));
    assert!((fit.larger_right() - difference).abs() < remaining.wheel_difference && remaining.wheel_difference < 0.01);
    // A log that does not tell a difference from none has it in what remains.
    let mut alike = fit.clone();
    alike.geometry[1] = alike.geometry[0] * (1.0 + 0.1 * remaining.wheel_difference);
    assert_eq!(alike.larger_right(), 0.0);
    assert!(alike.remaining().wheel_difference > remaining.wheel_difference);
    alike.geometry[1] = 1.1 * alike.geometry[0];
    assert_eq!(alike.larger_right(), alike.difference());
    assert!(remaining.track < 0.01 && remaining.wheel_radius < 0.005, "{remaining:?}");
}

#[test]
fn scipy_finds_the_same() {
    let text = include_str!("../../tests/vectors/calibrate.json");
    let value: serde_json::Value = serde_json::from_str(text).expect("JSON");
    let numbers = |value: &serde_json::Value| -> Vec<f64> {
        value.as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number")).collect()
    };
    let mut log = Log::default();
    for row in value["rows"].as_array().expect("rows") {
        let row = numbers(row);
        log.wheels.push((row[0], [row[1], row[2]]));
        log.poses.push((row[0], Pose2::new(row[3], row[4], row[5])));
    }
    let fit = fit(&log, GUESS, PoseNoise::default()).expect("a fit");
    assert_eq!(fit.pairs as u64, value["pairs"].as_u64().expect("a number"));
    assert!(fit.outliers > 0);
    for (ours, theirs) in fit.geometry.iter().zip(numbers(&value["found"])) {
        // Both stop where steps are rounding.
        assert!((ours / theirs - 1.0).abs() < 1e-7, "{ours} {theirs}");
    }
}
