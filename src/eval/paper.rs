//! The papers' own figures, as printed in \[SCR\] Tables I to III, and those of DDR-opt, the same first author's newer planner, on
//! scenes of Table III at the limits used here; and what TopAY does on its own benchmark.

/// Table I: M_j m/s^3, M_a m/s^2, M_alpha rad/s^2, length m, time s, M_mj rad/s^3.
pub const TABLE1_INITIAL: [f64; 6] = [0.614, 0.428, 2.683, 8.870, 9.516, 2.000];
/// The same, optimised.
pub const TABLE1_OPTIMISED: [f64; 6] = [0.193, 0.370, 0.724, 8.508, 10.196, 0.294];
/// Table I: scenes that succeed, %, and mean computation time, ms.
pub const TABLE1_SUCCESS: (f64, f64) = (93.0, 104.2);

/// A row of Table II.
pub struct DenseRow {
    /// Trajectories of 200 whose alpha exceeds its limit by less than 10 %, less than 25 %, more than 25 %.
    pub counts: [f64; 3],
    /// Time above the limit, %.
    pub time_above: f64,
    /// ms.
    pub computation: f64,
}

/// Without dense sampling.
pub const TABLE2_WITHOUT: DenseRow = DenseRow { counts: [10.0, 72.0, 128.0], time_above: 4.36, computation: 131.8 };
/// With dense sampling.
pub const TABLE2_WITH: DenseRow = DenseRow { counts: [152.0, 165.0, 35.0], time_above: 2.24, computation: 64.8 };
/// Trajectories of Table II.
pub const TABLE2_COUNT: f64 = 200.0;

/// Fig. 5: the least turn radius of the trajectory in the picture, m.
pub const FIG5_LEAST_RADIUS: f64 = 9.3e-3;

/// A planner's row of Table III.
pub struct PlannerRow {
    /// Boxes a scene.
    pub boxes: usize,
    /// Whose.
    pub planner: &'static str,
    /// m/s^3; two values are the range over all three densities.
    pub jerk: [f64; 2],
    /// rad/s^2; likewise.
    pub alpha: [f64; 2],
    /// ms.
    pub computation: f64,
    /// m and s, where given.
    pub length_time: Option<(f64, f64)>,
    /// s/m.
    pub pace: f64,
}

const fn scr(
    boxes: usize,
    planner: &'static str,
    jerk: f64,
    alpha: f64,
    ct_s: f64,
    length: f64,
    time: f64,
) -> PlannerRow {
    PlannerRow {
        boxes,
        planner,
        jerk: [jerk; 2],
        alpha: [alpha; 2],
        computation: ct_s * 1e3,
        length_time: Some((length, time)),
        pace: time / length,
    }
}

const fn ddr_opt(boxes: usize, computation: f64, pace: f64) -> PlannerRow {
    PlannerRow {
        boxes,
        planner: "DDR-opt",
        jerk: [0.72, 0.80],
        alpha: [0.69, 0.75],
        computation,
        length_time: None,
        pace,
    }
}

/// Table III. The paper states no limits of speed; DDR-opt's rows are at those of the scenes here.
pub const TABLE3: [PlannerRow; 9] = [
    scr(10, "paper, proposed", 0.554, 0.503, 0.051, 7.822, 9.355),
    scr(10, "paper, TEB", 7.794, 1.684, 6.287, 7.945, 5.184),
    ddr_opt(10, 50.0, 1.47),
    scr(20, "paper, proposed", 0.550, 0.548, 0.053, 7.720, 9.585),
    scr(20, "paper, TEB", 5.899, 1.753, 7.578, 7.794, 5.412),
    ddr_opt(20, 47.0, 1.49),
    scr(35, "paper, proposed", 0.574, 0.598, 0.058, 7.656, 10.332),
    scr(35, "paper, TEB", 6.987, 1.845, 20.208, 7.778, 5.855),
    ddr_opt(35, 49.0, 1.49),
];

/// What TopAY (arXiv 2507.02761v2, its published code) does with 120 pairs of start and goal of each of its own benchmark's kinds of
/// room, as measured with it by this project's owner on its own robot and maps.
pub struct TopAyRow {
    /// As `kind` of a scene.
    pub kind: &'static str,
    /// Success by its own test, which does not look at the arm's collisions, %.
    pub claimed: f64,
    /// Of the trajectories, free of collision against the exact boxes, %; with its obstacles padded by 3 cm.
    pub free: [f64; 2],
    /// One thread, to the first success, ms: median and 90th percentile.
    pub computation: [f64; 2],
    /// Mean time of the motion, s.
    pub time: f64,
}

/// Both kinds of rooms. Free without padding: 16 % of both together.
pub const TOPAY: [TopAyRow; 2] = [
    TopAyRow { kind: "cuboids", claimed: 94.0, free: [16.0, 58.0], computation: [309.0, 945.0], time: 11.8 },
    TopAyRow { kind: "tables", claimed: 75.0, free: [16.0, 65.0], computation: [346.0, 1265.0], time: 12.2 },
];
