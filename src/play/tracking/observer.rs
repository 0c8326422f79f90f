//! Where the robot is: poses as they come, joined by the commands that it drove in between.
//!
//! An extended Kalman filter (Jazwinski 1970, chapter 8) of seven states: the pose; by how much each wheel's radius and the track differ
//! from the file's, as shares; and how much later than told commands take effect in the poses (latency of commands and of poses is
//! one to it, and so is that of the wheels' own controllers). The pose is the one that the commands given so far lead to: ahead of what is
//! measured by the latency, and what the law must know. Between poses the held commands are driven along exact arcs with
//! those wheels; so noise of single poses is averaged, and a wheel that is larger than the model says is found within the first
//! metres instead of being fought all the way. What wheels do not explain (slip, a push) is process noise that grows with the way.
//!
//! A pose far off is not believed at first: localisation jumps. `BELIEVED` of them in a row are.

use std::collections::VecDeque;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::geom::{Pose2, wrap_angle};
use crate::math::real;

/// Standard deviations of the wheels' radii about their common mean's own, of that mean, and of the track, before anything was seen.
const DIFFERENCE: f64 = 0.003;
const SCALE: f64 = 0.01;
const TRACK: f64 = 0.01;
/// Standard deviation of the latency beyond what was told, s, and the most of it that is believed.
const LATE: f64 = 0.05;
const LATEST: f64 = 0.25;
/// Shares are never believed beyond this.
const MOST: f64 = 0.03;
/// Process noise: of the position, m per root of a metre; of the heading, rad per root of a metre (and of a turned track width).
const SLIP: f64 = 0.003;
const TURN_SLIP: f64 = 0.004;
/// Process noise of a robot at rest, m and rad per root of a second.
const CREEP: (f64, f64) = (1e-4, 2e-4);
/// A pose is far off beyond so many standard deviations, and these distances besides: m, rad.
const FAR: (f64, f64, f64) = (5.0, 0.1, 0.15);
/// Squared distance of a pose in standard deviations beyond which the model did not see it coming (chi-square of three degrees: one in a thousand).
const SURPRISE: f64 = 16.3;
/// Far poses in a row that are believed.
const BELIEVED: usize = 5;
/// Steps in which time is driven at most, s: bounds what is lost by linearizing.
const STEP: f64 = 0.05;
/// Commands older than this need not be remembered, s.
pub const MEMORY: f64 = LATEST;

type State = SVector<f64, 7>;
type Covariance = SMatrix<f64, 7, 7>;

/// Geometry of the drive as the file has it, and what poses are worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Of the left and the right wheel, m.
    pub wheel_radii: [f64; 2],
    /// m.
    pub track_width: f64,
    /// Standard deviation of a pose's coordinates, m.
    pub noise: f64,
    /// Standard deviation of its heading, rad.
    pub turn_noise: f64,
}

/// A command: when the robot begins to execute it, s, and the rates of the left and the right wheel, rad/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Executed {
    /// s.
    pub from: f64,
    /// rad/s.
    pub wheels: [f64; 2],
}

/// By how much the drive differs from the file's, as shares.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shares {
    /// Radii of the left and the right wheel.
    pub radii: [f64; 2],
    /// The track.
    pub track: f64,
}

/// The filter's state.
#[derive(Debug, Clone, PartialEq)]
pub struct Observer {
    /// When, s.
    time: f64,
    /// x, y, yaw; shares of the left and right radius and of the track; latency beyond what was told, s.
    state: State,
    covariance: Covariance,
    /// Poses in a row that were far off.
    far: usize,
}

impl Observer {
    /// From a first pose.
    pub fn new(drive: &Drive, time: f64, pose: Pose2) -> Self {
        let (n2, t2) = (real::powi(drive.noise, 2), real::powi(drive.turn_noise, 2));
        let (scale, apart) = (real::powi(SCALE, 2), real::powi(DIFFERENCE, 2));
        let diagonal =
            [n2, n2, t2, scale + 0.25 * apart, scale + 0.25 * apart, real::powi(TRACK, 2), real::powi(LATE, 2)];
        let mut covariance = Covariance::from_diagonal(&State::from(diagonal));
        // Radii that differ in common mean by SCALE, from each other by DIFFERENCE.
        covariance[(3, 4)] = scale - 0.25 * apart;
        covariance[(4, 3)] = covariance[(3, 4)];
        Self { time, state: State::from([pose.x, pose.y, pose.yaw, 0.0, 0.0, 0.0, 0.0]), covariance, far: 0 }
    }

    /// When, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The pose.
    pub fn pose(&self) -> Pose2 {
        Pose2::new(self.state[0], self.state[1], self.state[2])
    }

    /// How the drive differs from the file's.
    pub fn shares(&self) -> Shares {
        let share = |k: usize| self.state[k].clamp(-MOST, MOST);
        Shares { radii: [share(3), share(4)], track: share(5) }
    }

    /// The state at a later time, after the commands of `history` (in order of time; none before the first).
    pub fn driven(&self, drive: &Drive, history: &VecDeque<Executed>, until: f64) -> Self {
        let mut out = self.clone();
        let mut next = history.partition_point(|command| command.from <= out.time);
        while out.time < until {
            let wheels = next.checked_sub(1).map_or([0.0; 2], |k| history[k].wheels);
            let change = history.get(next).map_or(f64::INFINITY, |command| command.from);
            let end = until.min(change).min(out.time + STEP);
            out.step(drive, wheels, end - out.time);
            out.time = end;
            if change <= end {
                next += 1;
            }
        }
        out
    }

    fn step(&mut self, drive: &Drive, wheels: [f64; 2], time: f64) {
        let shares = self.shares();
        let track = drive.track_width * (1.0 + shares.track);
        let (speed, rate) = self.twist(drive, wheels);
        let from = self.pose();
        let to = from.after_twist(speed, rate, time);
        // Derivatives: of the pose by pose, exact; by speed and rate, exact in speed, of a chord's middle in rate.
        let (dx, dy) = (to.x - from.x, to.y - from.y);
        let (sin, cos) = real::sin_cos(from.yaw + 0.5 * rate * time);
        let by_speed = Vector3::new(time * cos, time * sin, 0.0);
        let by_rate = Vector3::new(-0.5 * time * dy, 0.5 * time * dx, time);
        let mut jacobian = Covariance::identity();
        jacobian[(0, 2)] = -dy;
        jacobian[(1, 2)] = dx;
        for (side, rate) in wheels.into_iter().enumerate() {
            let rim = drive.wheel_radii[side] * rate;
            let sign = if side == 0 { -1.0 } else { 1.0 };
            let column = by_speed * (0.5 * rim) + by_rate * (sign * rim / track);
            jacobian.fixed_view_mut::<3, 1>(0, 3 + side).copy_from(&column);
        }
        jacobian.fixed_view_mut::<3, 1>(0, 5).copy_from(&(by_rate * (-rate / (1.0 + shares.track))));
        self.covariance = jacobian * self.covariance * jacobian.transpose();
        let way = speed.abs() * time;
        let place = real::powi(SLIP, 2) * way + real::powi(CREEP.0, 2) * time;
        let turn =
            real::powi(TURN_SLIP, 2) * (way + drive.track_width * rate.abs() * time) + real::powi(CREEP.1, 2) * time;
        for (k, noise) in [place, place, turn].into_iter().enumerate() {
            self.covariance[(k, k)] += noise;
        }
        self.state[0] = to.x;
        self.state[1] = to.y;
        self.state[2] = to.yaw;
    }

    /// Counts a pose that was not believed.
    pub fn missed(&mut self) {
        self.far += 1;
    }

    /// Takes a pose of the state's own time into account. False: it was far off and is not believed, and nothing has changed.
    pub fn see(&mut self, drive: &Drive, history: &VecDeque<Executed>, pose: Pose2) -> bool {
        let (expected, by_latency) = self.expected(drive, history);
        let off = Vector3::new(pose.x - expected.x, pose.y - expected.y, wrap_angle(pose.yaw - expected.yaw));
        let noise = Vector3::new(drive.noise, drive.noise, drive.turn_noise).map(|n| n * n);
        // Poses by states: of the pose the identity (a late arc's own turn is left out), of the latency the way back.
        let mut by_state = SMatrix::<f64, 3, 7>::identity();
        by_state.set_column(6, &by_latency);
        let spread_of =
            |covariance: &Covariance| by_state * covariance * by_state.transpose() + Matrix3::from_diagonal(&noise);
        let mut spread = spread_of(&self.covariance);
        let (sigmas, metres, radians) = FAR;
        let is_far = off.xy().norm() > metres + sigmas * (spread[(0, 0)] + spread[(1, 1)]).sqrt()
            || off.z.abs() > radians + sigmas * spread[(2, 2)].sqrt();
        if is_far && self.far + 1 < BELIEVED {
            return false;
        }
        self.far = 0;
        if is_far {
            // The robot is where it is seen; what its drive is like remains known.
            let known: Vec<f64> = self.state.iter().skip(3).copied().collect();
            *self = Self::new(drive, self.time, pose);
            known.into_iter().enumerate().for_each(|(k, value)| self.state[3 + k] = value);
            return true;
        }
        let Some(mut inverse) = spread.try_inverse() else { return false };
        if (off.transpose() * inverse * off)[0] > SURPRISE {
            // A push, a slip: the pose must take it, not what is believed of the wheels.
            (0..3).for_each(|k| self.covariance[(k, k)] += off[k] * off[k]);
            spread = spread_of(&self.covariance);
            inverse = spread.try_inverse().unwrap_or(inverse);
        }
        let gain = self.covariance * by_state.transpose() * inverse;
        self.state += gain * off;
        // Joseph's form: stays symmetric and positive.
        let keep = Covariance::identity() - gain * by_state;
        self.covariance =
            keep * self.covariance * keep.transpose() + gain * Matrix3::from_diagonal(&noise) * gain.transpose();
        true
    }

    /// The pose that is expected to be measured, and its derivative by the latency.
    fn expected(&self, drive: &Drive, history: &VecDeque<Executed>) -> (Pose2, Vector3<f64>) {
        let late = self.late();
        // The command in force half of the latency ago stands for all that were since: exact to second order.
        let then = history.partition_point(|command| command.from <= self.time - 0.5 * late);
        let wheels = then.checked_sub(1).map_or([0.0; 2], |k| history[k].wheels);
        let (speed, rate) = self.twist(drive, wheels);
        let back = self.pose().after_twist(speed, rate, -late);
        let (sin, cos) = real::sin_cos(back.yaw);
        (back, Vector3::new(-speed * cos, -speed * sin, -rate))
    }

    /// Latency beyond what was told, s.
    pub fn late(&self) -> f64 {
        self.state[6].clamp(-LATEST, LATEST)
    }

    /// Speed and turn rate that rates of the wheels make.
    fn twist(&self, drive: &Drive, wheels: [f64; 2]) -> (f64, f64) {
        let shares = self.shares();
        let rims = [0, 1].map(|side| drive.wheel_radii[side] * (1.0 + shares.radii[side]) * wheels[side]);
        (0.5 * (rims[0] + rims[1]), (rims[1] - rims[0]) / (drive.track_width * (1.0 + shares.track)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRIVE: Drive =
        Drive { wheel_radii: [0.1; 2], track_width: 0.4, noise: 0.005, turn_noise: 0.5 * std::f64::consts::PI / 180.0 };

    /// Rates of the wheels: ahead, bends to both sides, a spin.
    fn history() -> VecDeque<Executed> {
        let wheels = [[3.0, 3.2], [4.0, 2.5], [-1.5, 1.5], [3.0, 4.5], [5.0, 5.0]];
        wheels.into_iter().enumerate().map(|(k, wheels)| Executed { from: 2.0 * k as f64, wheels }).collect()
    }

    /// The true pose with wrong wheels and track.
    fn truth(shares: Shares, until: f64) -> Pose2 {
        let mut observer = Observer::new(&DRIVE, 0.0, Pose2::new(1.0, -2.0, 3.0));
        let given = [shares.radii[0], shares.radii[1], shares.track];
        observer.state.fixed_view_mut::<3, 1>(3, 0).copy_from(&Vector3::from(given));
        observer.driven(&DRIVE, &history(), until).pose()
    }

    #[test]
    fn the_covariance_moves_by_the_derivatives_of_the_motion() {
        let (observer, h) = (Observer::new(&DRIVE, 0.0, Pose2::new(0.3, 0.1, 0.4)), 1e-6);
        let (wheels, time) = ([3.0, 4.5], 0.04);
        let after = |k: usize, change: f64| {
            let mut moved = observer.clone();
            moved.state[k] += change;
            moved.step(&DRIVE, wheels, time);
            moved.state
        };
        // One state uncertain at a time: its column of the Jacobian, squared, is what the covariance becomes.
        for k in 0..7 {
            let mut only = observer.clone();
            only.covariance = Covariance::zeros();
            only.step(&DRIVE, wheels, time);
            let noise = only.covariance;
            let mut only = observer.clone();
            only.covariance = Covariance::zeros();
            only.covariance[(k, k)] = 1.0;
            only.step(&DRIVE, wheels, time);
            let column = (after(k, h) - after(k, -h)) / (2.0 * h);
            let off = (only.covariance - noise - column * column.transpose()).norm();
            assert!(off < 2e-5, "state {k}: {off}");
        }
    }

    #[test]
    fn wrong_wheels_and_track_are_found_from_noisy_poses() {
        let shares = Shares { radii: [0.008, 0.011], track: -0.01 };
        let mut rng = crate::math::noise::Noise::new(7);
        let mut observer = Observer::new(&DRIVE, 0.0, truth(shares, 0.0));
        for k in 1..=200 {
            let time = 0.05 * f64::from(k);
            let pose = truth(shares, time);
            observer = observer.driven(&DRIVE, &history(), time);
            let [a, b, c] = rng.normals();
            observer.see(
                &DRIVE,
                &history(),
                Pose2::new(pose.x + 0.005 * a, pose.y + 0.005 * b, pose.yaw + DRIVE.turn_noise * c),
            );
        }
        let found = observer.shares();
        for (k, (found, meant)) in
            [(found.radii[0], 0.008), (found.radii[1], 0.011), (found.track, -0.01)].into_iter().enumerate()
        {
            let sigma = observer.covariance[(3 + k, 3 + k)].sqrt();
            assert!((found - meant).abs() < 3.0 * sigma && sigma < 0.006, "{k}: {found} of {meant}, {sigma}");
        }
        assert!(observer.pose().distance(truth(shares, 10.0)) < 0.005);
    }

    #[test]
    fn one_pose_far_off_is_not_believed_and_many_are() {
        let mut observer = Observer::new(&DRIVE, 0.0, Pose2::default());
        let away = Pose2::new(2.0, 0.0, 0.0);
        let (mut seen, still) = (Vec::new(), VecDeque::new());
        for _ in 0..BELIEVED {
            seen.push(observer.see(&DRIVE, &still, away));
            if seen.last() == Some(&false) {
                observer.missed();
            }
        }
        assert_eq!(seen, [false, false, false, false, true]);
        assert_eq!(observer.pose(), away);
    }

    #[test]
    fn headings_are_the_same_by_whole_turns() {
        let mut observer = Observer::new(&DRIVE, 0.0, Pose2::new(0.0, 0.0, 3.0));
        assert!(observer.see(&DRIVE, &VecDeque::new(), Pose2::new(0.0, 0.0, 3.02 - std::f64::consts::TAU)));
        assert!((observer.pose().yaw - 3.01).abs() < 1e-6, "half way, both being worth the same");
    }
}
