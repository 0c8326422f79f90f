//! What a sample exceeds of the limits of base, wheels and joints: squares of what is too much.

use super::hermite::{Basis, DATA};
use super::integral::{ByData, Integral};
use super::layout::HEADING;
use super::problem::Problem;
use super::rows::{Contact, Limit, Missed, Row, Rows};
use crate::math::real;

/// Backing up weighs as much as exceeding the speed limit by so many times as much.
const BACKWARDS: f64 = 10.0;

/// Joints are kept off the ends of their range by this share of half of it: the penalty is soft, the range is not.
const INSET: f64 = 0.02;
/// The share of half a joint's range by which a position beyond counts like a speed of twice its limit.
const STIFF_PART: f64 = 0.05;

impl<F> Problem<'_, F> {
    /// Limits of base and wheels: each is linear in one derivative of heading and arc length. At rest the speed is what it is, and
    /// the jerk must not point backwards.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn base_limits(
        &mut self,
        [piece, sample]: [usize; 2],
        rest: bool,
        basis: &Basis,
        heading: &[f64; 4],
        arc: &[f64; 4],
        rates: &[f64; 4],
        weight: f64,
    ) -> f64 {
        let limits = &self.limits;
        let direction = self.directions[piece];
        let arm = limits.half_track;
        let (local, contacts) = (&mut self.local, &mut self.contacts);
        let mut cost = 0.0;
        // `by . (heading, arc length)` of an order exceeds its bound by `value`; the sum is homogeneous in time of minus the order.
        let mut row = |order: usize, by: [f64; 2], value: f64, bound: f64| {
            let of = Missed::Limit(Limit { order, first: HEADING, by, bound });
            contacts.add_limit(Contact { piece, sample, of, short: value });
            let scaled = by.map(|b| b * rates[order]);
            let jacobian: ByData = std::array::from_fn(|k| scaled[k / DATA] * basis.rows[order][k % DATA]);
            let by_time = 0.5 * value - order as f64 * (value + bound);
            cost += local.square_of_base(&jacobian, by_time, value, weight);
        };
        let (turn, along) = (heading[1] * rates[1], direction * arc[1] * rates[1]);
        let side = turn.signum();
        let over = |value: f64, limit: f64| value / limit - 1.0;
        let speed = over(along, limits.speed);
        if speed > 0.0 {
            row(1, [0.0, direction / limits.speed], speed, 1.0);
        }
        let floor = self.floors[piece];
        if along < floor && !rest {
            // As if it were by so many limits: there is nothing to gain from it.
            let unit = limits.speed / BACKWARDS;
            row(1, [0.0, -direction / unit], (floor - along) / unit, -floor / unit);
        }
        let push = direction * arc[3] * rates[3] / self.rim_jerk;
        if push < 0.0 && rest {
            row(3, [0.0, -direction / self.rim_jerk], -push, 0.0);
        }
        let at_rest = limits.turn_slope * limits.speed;
        let eq14 = over(side * turn + limits.turn_slope * along, at_rest);
        if eq14 > 0.0 {
            row(1, [side / at_rest, direction * limits.turn_slope / at_rest], eq14, 1.0);
        }
        let cap = over(side * turn, limits.angular_speed);
        if cap > 0.0 {
            row(1, [side / limits.angular_speed, 0.0], cap, 1.0);
        }
        let rim = over(along + arm * side * turn, limits.rim_speed);
        if rim > 0.0 {
            row(1, [side * arm / limits.rim_speed, direction / limits.rim_speed], rim, 1.0);
        }
        let orders = [
            (2, limits.acceleration, limits.angular_acceleration, limits.rim_acceleration),
            (3, f64::INFINITY, f64::INFINITY, self.rim_jerk),
        ];
        for (order, base, turning, rim) in orders {
            let (turn, along) = (heading[order] * rates[order], arc[order] * rates[order]);
            if over(along.abs(), base) > 0.0 {
                row(order, [0.0, along.signum() / base], over(along.abs(), base), 1.0);
            }
            if over(turn.abs(), turning) > 0.0 {
                row(order, [turn.signum() / turning, 0.0], over(turn.abs(), turning), 1.0);
            }
            for arm in [arm, -arm] {
                let wheel = along + arm * turn;
                if over(wheel.abs(), rim) > 0.0 {
                    row(order, [wheel.signum() * arm / rim, wheel.signum() / rim], over(wheel.abs(), rim), 1.0);
                }
            }
        }
        cost
    }

    /// What the base exceeds of the speed allowed where it is: linear in the speed, and less allowed the nearer a zone is.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn zone_limit(
        &mut self,
        piece: usize,
        basis: &Basis,
        arc: &[f64; 4],
        rates: &[f64; 4],
        path: &Integral<'_>,
        start: [f64; 2],
        weight: f64,
    ) -> f64 {
        let moved = path.position();
        let Some((square, slope)) = self.zones.square_at([start[0] + moved[0], start[1] + moved[1]]) else {
            return 0.0;
        };
        let (direction, allowed) = (self.directions[piece], square.sqrt());
        let share = direction * arc[1] * rates[1] / allowed;
        let value = share - 1.0;
        if value <= 0.0 {
            return 0.0;
        }
        // d(share) = d(speed) / allowed - share d(square) / 2 square.
        let by_place = slope.map(|s| -0.5 * share * s / square);
        let (size, time) = (self.local.size, self.local.time);
        let jacobian = &mut self.jacobian[..size];
        jacobian.fill(0.0);
        for (axis, own) in by_place.into_iter().enumerate() {
            for (entry, by) in jacobian.iter_mut().zip(path.by_data(axis)) {
                *entry += own * by;
            }
            jacobian[time + 1 + axis] = own;
        }
        for (entry, by) in jacobian[DATA..2 * DATA].iter_mut().zip(&basis.rows[1]) {
            *entry += direction * rates[1] / allowed * by;
        }
        // The weight grows with the duration, the speed falls with it.
        jacobian[time] = 0.5 * value - share;
        self.local.add(jacobian, weight * value, weight);
        0.5 * weight * value * value
    }

    /// Limits of the joints: speed, acceleration, jerk, position. Leaves the joints' values in `joints`.
    pub(super) fn joint_limits(
        &mut self,
        [piece, sample]: [usize; 2],
        basis: &Basis,
        rates: &[f64; 4],
        weight: f64,
    ) -> f64 {
        let mut cost = 0.0;
        for (index, limits) in self.limits.joints.iter().enumerate() {
            let first = DATA * (2 + index);
            let unit = basis.at(&self.data[2 + index]);
            self.joints[index] = unit[0];
            let (local, contacts) = (&mut self.local, &mut self.contacts);
            let mut row = |order: usize, factor: f64, value: f64, bound: f64| {
                let of = Missed::Limit(Limit { order, first: 2 + index, by: [factor, 0.0], bound });
                contacts.add_limit(Contact { piece, sample, of, short: value });
                let jacobian = basis.rows[order].map(|b| factor * rates[order] * b);
                let by_time = 0.5 * value - order as f64 * (value + bound);
                cost += local.square_of_joint(first, &jacobian, by_time, value, weight);
            };
            let bounds = [limits.speed, limits.acceleration, self.joint_jerks[index]];
            for (order, bound) in (1..).zip(bounds) {
                let value = unit[order] * rates[order];
                if value.abs() > bound {
                    row(order, value.signum() / bound, value.abs() / bound - 1.0, 1.0);
                }
            }
            // Positions have no natural size; a part of half the range is it. Unbounded: none.
            let half_range = 0.5 * (limits.upper - limits.lower);
            let bounded = half_range.is_finite() && half_range > 1e-6;
            let (inset, size) = if bounded { (INSET * half_range, STIFF_PART * half_range) } else { (0.0, 1.0) };
            let (lower, upper) = (limits.lower + inset, limits.upper - inset);
            if unit[0] > upper {
                row(0, 1.0 / size, (unit[0] - upper) / size, upper / size);
            } else if unit[0] < lower {
                row(0, -1.0 / size, (lower - unit[0]) / size, -lower / size);
            }
        }
        cost
    }

    /// Adds a limit's row by its piece's own coordinates.
    pub(super) fn linearise_limit(
        &self,
        contact: Contact,
        limit: Limit,
        basis: &Basis,
        duration: f64,
        time: f64,
        rows: &mut Rows,
    ) {
        let scale = real::powi(time, -(limit.order as i32));
        let of = || limit.by.into_iter().zip(limit.first..).filter(|(by, _)| *by != 0.0);
        let reached: f64 = of().map(|(by, dimension)| by * scale * basis.at(&self.data[dimension])[limit.order]).sum();
        let row = Row { contact, weight: self.weights.motion * duration, value: reached - limit.bound };
        let jacobian = rows.push(row);
        for (by, dimension) in of() {
            for (entry, row) in jacobian[DATA * dimension..].iter_mut().zip(&basis.rows[limit.order]) {
                *entry = by * scale * row;
            }
        }
        jacobian[self.local.time] = -(limit.order as f64) * reached;
    }
}
