//! Which mission comes after which: one that starts where another one ends.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::find::Found;
use crate::diag::{Diagnostic, Diagnostics};
use crate::mission;

/// Missions in an order in which each comes after the one that it starts from; else as they were.
pub struct Order {
    /// The place before of the mission at each place.
    from: Vec<usize>,
    /// Of the mission at each place: the place of the one that it starts from, and which of that one's files it reads.
    pub after: Vec<Option<(usize, PathBuf)>>,
}

impl Order {
    /// A list in this order that was as the missions were before.
    pub fn sorted<T>(&self, list: Vec<T>) -> Vec<T> {
        let mut slots: Vec<Option<T>> = list.into_iter().map(Some).collect();
        self.from.iter().filter_map(|from| slots[*from].take()).collect()
    }
}

/// The order. `reads`: files that each mission reads, `folders`: where each one's output goes, all spelled alike.
///
/// # Errors
/// Missions that wait for each other.
pub fn order(missions: &[Found], reads: &[Vec<PathBuf>], folders: &[PathBuf]) -> Result<Order, Diagnostics> {
    let makers: BTreeMap<&Path, usize> = folders.iter().map(PathBuf::as_path).zip(0..).collect();
    let before: Vec<Option<(usize, &PathBuf)>> =
        reads.iter().map(|files| files.iter().find_map(|file| Some((*makers.get(file.parent()?)?, file)))).collect();
    // By the old places: where each one went.
    let mut place: Vec<Option<usize>> = vec![None; missions.len()];
    let mut from = Vec::with_capacity(missions.len());
    for mission in 0..missions.len() {
        let mut chain = vec![mission];
        // Back to one that starts from none, or is placed already.
        while let Some((first, _)) = before[chain[chain.len() - 1]]
            && place[first].is_none()
        {
            if let Some(at) = chain.iter().position(|own| *own == first) {
                return Err(cycle(missions, &chain[at..]));
            }
            chain.push(first);
        }
        for own in chain.into_iter().rev().filter(|own| place[*own].is_none()).collect::<Vec<_>>() {
            place[own] = Some(from.len());
            from.push(own);
        }
    }
    let after = |own: &usize| before[*own].and_then(|(first, file)| Some((place[first]?, file.clone())));
    let after = from.iter().map(after).collect();
    Ok(Order { from, after })
}

fn cycle(missions: &[Found], chain: &[usize]) -> Diagnostics {
    let name = |mission: &usize| format!("`{}`", missions[*mission].path.display());
    let message = match chain {
        [own] => format!("{} starts where it ends itself", name(own)),
        _ => {
            let rest: Vec<String> = chain[1..].iter().chain(&chain[..1]).map(name).collect();
            format!("{} starts where {} ends", name(&chain[0]), rest.join(" ends, which starts where "))
        }
    };
    let hint = "one of them must say where it starts by itself: `start: {x_m: 0.5, y_m: 0.5, yaw: 0deg}`";
    // Where the first of them says so.
    let path = &missions[chain[0]].path;
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let at = mission::parse(&path.display().to_string(), &text).ok().and_then(|mission| mission.spans.start_file);
    Diagnostic::error("build/cycle", message).maybe_at(at.as_ref()).hint(hint).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ordered(before: &[Option<usize>]) -> Result<Order, Diagnostics> {
        let name = |k: usize| format!("m{k}");
        let missions: Vec<Found> =
            (0..before.len()).map(|k| Found { name: name(k), path: format!("{}.yaml", name(k)).into() }).collect();
        let folders: Vec<PathBuf> = (0..before.len()).map(|k| format!("out/{}", name(k)).into()).collect();
        let reads: Vec<Vec<PathBuf>> = before
            .iter()
            .map(|first| {
                let mut files = vec![PathBuf::from("maps/a.pcd")];
                files.extend(first.map(|k| folders[k].join("commands.csv")));
                files
            })
            .collect();
        order(&missions, &reads, &folders)
    }

    #[test]
    fn missions_that_wait_for_each_other_are_named() {
        let said = |before: &[Option<usize>]| match ordered(before) {
            Err(faults) => faults.0[0].message.clone(),
            Ok(_) => panic!("{before:?} is no order"),
        };
        assert_eq!(said(&[None, Some(1)]), "`m1.yaml` starts where it ends itself");
        assert_eq!(
            said(&[Some(1), Some(2), Some(1)]),
            "`m1.yaml` starts where `m2.yaml` ends, which starts where `m1.yaml` ends"
        );
    }

    proptest! {
        #[test]
        fn each_comes_after_the_one_it_starts_from_and_independent_ones_stay(
            before in (1usize..12).prop_flat_map(|n| prop::collection::vec(prop::option::of(0..n), n)),
        ) {
            let cyclic = (0..before.len()).any(|k| {
                let mut at = before[k];
                (0..before.len()).any(|_| {
                    let here = at;
                    at = at.and_then(|first| before[first]);
                    here == Some(k)
                })
            });
            match ordered(&before) {
                Err(_) => prop_assert!(cyclic),
                Ok(order) => {
                    prop_assert!(!cyclic);
                    let sorted = order.sorted((0..before.len()).collect::<Vec<_>>());
                    let mut all = sorted.clone();
                    all.sort_unstable();
                    prop_assert!(all.into_iter().eq(0..before.len()));
                    for (place, mission) in sorted.iter().enumerate() {
                        let first = order.after[place].as_ref().map(|(first, _)| sorted[*first]);
                        prop_assert_eq!(first, before[*mission]);
                        prop_assert!(order.after[place].as_ref().is_none_or(|(first, _)| *first < place));
                    }
                    if before.iter().all(|b| b.is_none()) {
                        prop_assert!(sorted.is_sorted());
                    }
                }
            }
        }
    }
}
