//! A queue for searches whose least estimate never falls (Ahuja, Mehlhorn, Orlin & Tarjan 1990: a radix heap).

/// Entries in order of their priorities; the newest first among equals. Nothing may be pushed below what was popped last.
///
/// An entry waits in the bucket of the highest bit in which its priority differs from the last popped; each time it is looked
/// at again it moves to a lower one, so 32 times at most.
pub(super) struct RadixHeap {
    buckets: [Vec<(u32, u32)>; 33],
    last: u32,
}

impl RadixHeap {
    pub fn new() -> Self {
        Self { buckets: std::array::from_fn(|_| Vec::new()), last: 0 }
    }

    /// Forgets all entries but keeps the memory.
    pub fn clear(&mut self) {
        self.buckets.iter_mut().for_each(Vec::clear);
        self.last = 0;
    }

    pub fn push(&mut self, priority: u32, entry: u32) {
        debug_assert!(priority >= self.last, "{priority} after {}", self.last);
        self.buckets[bucket(priority, self.last)].push((priority, entry));
    }

    /// The least priority and its entry.
    pub fn pop(&mut self) -> Option<(u32, u32)> {
        if self.buckets[0].is_empty() {
            let first = self.buckets.iter().position(|b| !b.is_empty())?;
            let waiting = std::mem::take(&mut self.buckets[first]);
            self.last = waiting.iter().map(|(priority, _)| *priority).min()?;
            for (priority, entry) in &waiting {
                self.buckets[bucket(*priority, self.last)].push((*priority, *entry));
            }
            // Its memory is for the next ones.
            self.buckets[first] = waiting;
            self.buckets[first].clear();
        }
        self.buckets[0].pop()
    }
}

fn bucket(priority: u32, last: u32) -> usize {
    (u32::BITS - (priority ^ last).leading_zeros()) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::cmp::Reverse;
    use std::collections::BinaryHeap;

    proptest! {
        #[test]
        fn it_pops_in_the_order_of_a_binary_heap(
            steps in prop::collection::vec((any::<bool>(), prop_oneof![0u32..4, 0u32..3000, any::<u32>()]), 1..300),
        ) {
            let (mut found, mut expected) = (RadixHeap::new(), BinaryHeap::new());
            let mut least = 0u32;
            for (entry, (push, more)) in steps.into_iter().enumerate() {
                if push {
                    let priority = least.saturating_add(more);
                    found.push(priority, entry as u32);
                    expected.push(Reverse(priority));
                } else {
                    let popped = found.pop().map(|(priority, _)| priority);
                    prop_assert_eq!(popped, expected.pop().map(|Reverse(priority)| priority));
                    least = popped.unwrap_or(least);
                }
            }
            while let Some(Reverse(priority)) = expected.pop() {
                prop_assert_eq!(found.pop().map(|(priority, _)| priority), Some(priority));
            }
            prop_assert!(found.pop().is_none());
        }
    }
}
