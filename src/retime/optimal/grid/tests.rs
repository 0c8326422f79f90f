use super::*;

const LIMITS: [[f64; 3]; 2] = [[1.0; 3], [2.0, 4.0, 8.0]];

fn problem<'a>(breaks: &'a [f64], limits: &'a [[f64; 3]]) -> Problem<'a> {
    Problem { breaks, limits, jerk_of_jump: 1.0, step: 0.05 }
}

#[test]
fn only_what_jumps_by_more_than_can_be_told_there_counts_as_a_jump() {
    let breaks = [0.0, 1.0, 2.0, 3.0, 4.0];
    // Speeds of 0.1 and 0.01 of the limit: the least times for a unit are that, and the greater one of them counts.
    for speeds in [[0.1, 0.1, 0.1, 0.1], [0.1, 0.01, 0.1, 0.01], [0.01, 0.1, 0.01, 0.1]] {
        // Second derivatives of the first row, third ones of the second, by stretch; what counts is 1e-6 of the limit times the
        // square of 0.1, and 2e-2 of it times the cube.
        for (second, third, expected) in [
            ([0.0, 9e-9, 9e-9, 0.0], [0.0; 4], [false, false, false]),
            ([0.0, 1.1e-8, 1.1e-8, 0.0], [0.0; 4], [true, false, true]),
            ([0.0; 4], [0.0, 0.0, 1.5e-4, 0.0], [false, false, false]),
            ([0.0; 4], [0.0, 0.0, 1.7e-4, 0.0], [false, true, true]),
        ] {
            let found = stretches(&problem(&breaks, &LIMITS), &mut |t: f64, out: &mut Vec<[f64; 3]>| {
                let i = (t as usize).min(3);
                out.push([speeds[i], second[i], 0.0]);
                out.push([speeds[i], 0.0, third[i]]);
            });
            let found = found.unwrap();
            for (i, expected) in expected.into_iter().enumerate() {
                let jumps = &found[i + 1].jumps;
                assert_eq!(jumps.is_some(), expected, "{speeds:?} {second:?} {third:?}, break {}", i + 1);
                if let Some(jumps) = jumps {
                    let jump: f64 = second[i + 1] - second[i];
                    assert!((jumps[0] - jump.abs()).abs() < 1e-18 && jumps[1] == 0.0, "{jumps:?}");
                }
            }
        }
    }
}

#[test]
fn knots_are_where_rows_jump_and_cells_are_as_long_as_asked_for() {
    // A unit of reference takes a second everywhere; a jump at 1.23, a break without one at 3.
    let rates = |t: f64, out: &mut Vec<[f64; 3]>| out.push([1.0, if t < 1.23 { 0.0 } else { 0.5 }, 0.0]);
    let grid = Grid::new(&problem(&[0.0, 1.23, 3.0, 10.0], &LIMITS[..1]), 1.0, &mut { rates }).unwrap();
    let at = grid.knots.iter().position(|knot| *knot == 1.23).unwrap();
    assert!((grid.jumps[at][0] - 0.5).abs() < 1e-12);
    assert!(grid.jumps.iter().enumerate().all(|(i, jumps)| i == at || jumps.is_empty()));
    assert!(grid.knots.iter().all(|knot| (knot - 3.0).abs() > 1e-6), "no jump, no knot");
    assert!((195..=206).contains(&grid.cells()), "{}", grid.cells());
    assert!(grid.knots.windows(2).all(|pair| (pair[1] - pair[0] - 0.05).abs() < 5e-3));
}

#[test]
fn neighbouring_cells_grow_no_faster_than_the_grading_and_none_is_longer_than_its_own_place_asks_for() {
    let stretch = |from: f64, to: f64, slowness: [f64; SAMPLES]| Stretch { from, to, slowness, jumps: None };
    let stretches = [
        stretch(0.0, 1.0, [1.0, 1.0, 9.0, 1.0]),
        stretch(1.0, 1.5, [1.0, 0.5, 0.2, 0.1]),
        stretch(1.5, 4.5, [0.1, 0.05, 3.0, 0.3]),
    ];
    let density = 4.0;
    // Lengths are 1 / (density slowness), and may grow by GRADING a unit of reference: from every sample to every other.
    let middles: Vec<f64> = stretches
        .iter()
        .flat_map(|s| (0..SAMPLES).map(|i| s.from + (i as f64 + 0.5) / SAMPLES as f64 * (s.to - s.from)))
        .collect();
    let own: Vec<f64> = stretches.iter().flat_map(|s| s.slowness).collect();
    let found = graded(&stretches, density);
    assert_eq!(found.len(), own.len());
    for (i, found) in found.iter().enumerate() {
        let lengths = (0..own.len())
            .map(|k| 1.0 / (density * own[k]) + GRADING * (middles[i] - middles[k]).abs())
            .fold(f64::INFINITY, f64::min);
        assert!((found * density * lengths - 1.0).abs() < 1e-12, "{i}: {found}");
    }
    assert!(found.iter().zip(&own).any(|(found, own)| found > own));
}

#[test]
fn unknowns_have_their_say_in_the_middle_of_cells_and_at_the_ends() {
    let rates = |_: f64, out: &mut Vec<[f64; 3]>| out.push([1.0, 0.0, 0.0]);
    let grid = Grid::new(&problem(&[2.0, 7.0], &LIMITS[..1]), 8.0, &mut { rates }).unwrap();
    let cells = grid.cells();
    assert_eq!(grid.unknowns(), cells + 2);
    let places: Vec<f64> = (0..grid.unknowns()).map(|i| grid.place(i)).collect();
    assert_eq!((places[0], places[cells + 1]), (2.0, 7.0));
    for i in 0..cells {
        assert_eq!(places[i + 1], 0.5 * (grid.knots[i] + grid.knots[i + 1]));
    }
    // All of them 1: b is 1, whatever the cell.
    for cell in 0..cells {
        let [p0, p1, p2] = grid.basis(cell).map(|weights| weights.iter().sum::<f64>());
        assert!((p0 - 1.0).abs() < 1e-14 && p1.abs() < 1e-13 && p2.abs() < 1e-12);
    }
}
