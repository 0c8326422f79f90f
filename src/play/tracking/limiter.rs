//! Held speeds that follow what is wanted as fast as an actuator's limits permit, and never exceed them.
//!
//! Limits are those of a command file: of the held speed, of its change over the time from command to command, and of the change of
//! that change. A speed is admissible if from it the limit of speed can still be kept: what an acceleration `a` adds until it is taken back,
//! at most `a^2/(2 jerk)`, must fit below the limit. From an admissible speed there always is another, whatever the time to the next
//! command: taking the acceleration back as fast as permitted is one.

/// Limits of one actuator, in the units of its command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Per s.
    pub speed: f64,
    /// Per s^2.
    pub acceleration: f64,
    /// Per s^3.
    pub jerk: f64,
}

/// What is held.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Held {
    /// Speed.
    pub speed: f64,
    /// Its change from the command before, over the time between the two.
    pub acceleration: f64,
}

impl Bounds {
    /// The speeds that may be held next, `time` seconds after the last command.
    pub fn admissible(&self, held: Held, time: f64) -> [f64; 2] {
        let step = self.jerk * time;
        let high =
            self.acceleration.min(held.acceleration + step).min(towards(self.speed - held.speed, self.jerk, time));
        let low =
            (-self.acceleration).max(held.acceleration - step).max(-towards(self.speed + held.speed, self.jerk, time));
        // Empty by rounding only.
        let (low, high) = if low <= high { (low, high) } else { (0.5 * (low + high), 0.5 * (low + high)) };
        [low, high].map(|a| (held.speed + a * time).clamp(-self.speed, self.speed))
    }

    /// The speed to hold next on the way to `wanted`, which itself changes by `rate` per second, with this share of the jerk's limit for
    /// what is off; not yet limited otherwise.
    pub fn approach(&self, held: Held, wanted: f64, rate: f64, share: f64, time: f64) -> f64 {
        let off = wanted - held.speed - rate * time;
        held.speed + (rate + towards(off.abs(), share * self.jerk, time).copysign(off)) * time
    }
}

/// The greatest acceleration towards a speed that is `room` away, so that it is reached without overshoot: `a time + a^2/(2 jerk) = room`.
fn towards(room: f64, jerk: f64, time: f64) -> f64 {
    if room <= 0.0 {
        return room / time;
    }
    // Written so that nothing cancels where the room is small.
    let change = 2.0 * room / jerk;
    jerk * change / (time + (time * time + change).sqrt())
}

/// The pair of speeds nearest to the wanted one that both actuators may hold: of the same ratio if there is one, so that wheels keep
/// their curvature; else each as near as it can.
pub fn together(wanted: [f64; 2], boxes: [[f64; 2]; 2]) -> [f64; 2] {
    let inside = |side: usize| boxes[side][0] <= wanted[side] && wanted[side] <= boxes[side][1];
    if inside(0) && inside(1) {
        return wanted;
    }
    let (mut least, mut most) = (0.0f64, f64::INFINITY);
    for (value, [low, high]) in wanted.into_iter().zip(boxes) {
        if value == 0.0 {
            if low > 0.0 || high < 0.0 {
                most = f64::NEG_INFINITY;
            }
            continue;
        }
        let ends = [low / value, high / value];
        least = least.max(ends[0].min(ends[1]));
        most = most.min(ends[0].max(ends[1]));
    }
    let share = if least <= most { 1.0f64.clamp(least, most) } else { 1.0 };
    [0, 1].map(|side| (share * wanted[side]).clamp(boxes[side][0], boxes[side][1]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const BOUNDS: Bounds = Bounds { speed: 2.0, acceleration: 1.5, jerk: 4.0 };

    fn next(held: Held, wanted: f64, time: f64) -> Held {
        let [low, high] = BOUNDS.admissible(held, time);
        let speed = BOUNDS.approach(held, wanted, 0.0, 1.0, time).clamp(low, high);
        Held { speed, acceleration: (speed - held.speed) / time }
    }

    #[test]
    fn a_step_is_followed_without_overshoot_in_the_time_that_the_limits_need() {
        let (mut held, mut time, hold) = (Held::default(), 0.0, 0.01);
        while (held.speed - 1.0).abs() > 1e-9 {
            held = next(held, 1.0, hold);
            assert!(held.speed <= 1.0 + 1e-12);
            time += hold;
        }
        // Trapezoid of acceleration: 1/1.5 + 1.5/4 s.
        let least = 1.0 / 1.5 + 1.5 / 4.0;
        assert!((least..least + 0.1).contains(&time), "{time} {least}");
    }

    #[test]
    fn what_may_be_held_is_held() {
        let held = Held { speed: 0.5, acceleration: 0.4 };
        let wanted = held.speed + 0.41 * 0.05;
        let [low, high] = BOUNDS.admissible(held, 0.05);
        assert!(low < wanted && wanted < high);
        assert!((BOUNDS.approach(held, wanted, 0.41, 0.4, 0.05) - wanted).abs() < 1e-15);
    }

    #[test]
    fn two_wheels_keep_their_ratio_where_they_can() {
        assert_eq!(together([1.0, 2.0], [[-0.5, 0.5], [-0.5, 0.5]]), [0.25, 0.5]);
        assert_eq!(together([1.0, 2.0], [[0.0, 1.5], [0.0, 3.0]]), [1.0, 2.0]);
        assert_eq!(together([0.1, 0.2], [[0.3, 0.5], [0.3, 0.8]]), [0.3, 0.6]);
        // No common ratio: each by itself.
        assert_eq!(together([1.0, -1.0], [[0.2, 0.4], [0.2, 0.4]]), [0.4, 0.2]);
        assert_eq!(together([0.0, 1.0], [[0.1, 0.4], [0.2, 0.4]]), [0.1, 0.4]);
    }

    proptest! {
        #[test]
        fn no_limit_is_exceeded_whatever_is_wanted_and_whenever(
            steps in proptest::collection::vec((-5.0..5.0f64, 0.001..0.12f64), 1..200),
        ) {
            let mut held = Held::default();
            for (wanted, time) in steps {
                let before = held;
                held = next(held, wanted, time);
                prop_assert!(held.speed.abs() <= BOUNDS.speed);
                prop_assert!(held.acceleration.abs() <= BOUNDS.acceleration + 1e-9);
                let jerk = (held.acceleration - before.acceleration).abs() / time;
                prop_assert!(jerk <= BOUNDS.jerk * (1.0 + 1e-6), "{jerk}");
            }
        }
    }
}
