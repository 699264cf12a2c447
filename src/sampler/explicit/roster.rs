//! A list of some of a partition's sets, kept while sets are renumbered.

use serde::{Deserialize, Serialize};

const ABSENT: u32 = u32::MAX;

/// The list.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Roster {
    list: Vec<u32>,
    /// Where each set of the partition stands in the list.
    place: Vec<u32>,
}

impl Roster {
    /// The sets, in no order of meaning.
    pub(super) fn list(&self) -> &[u32] {
        &self.list
    }

    /// A set that takes the last number, and whether it is listed.
    pub(super) fn push_set(&mut self, listed: bool) {
        let set_ix = self.place.len() as u32;
        self.place.push(if listed {
            self.list.push(set_ix);
            self.list.len() as u32 - 1
        } else {
            ABSENT
        });
    }

    /// Set `to` goes, and the last one takes its number.
    pub(super) fn swap_remove_set(&mut self, to: usize) {
        let place = self.place[to];
        if place != ABSENT {
            self.list.swap_remove(place as usize);
            if let Some(&moved) = self.list.get(place as usize) {
                self.place[moved as usize] = place;
            }
        }
        self.place.swap_remove(to);
        if let Some(&place) = self.place.get(to)
            && place != ABSENT
        {
            self.list[place as usize] = to as u32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_the_renumbering() {
        let mut roster = Roster::default();
        // What the list should hold, by set.
        let mut plain: Vec<bool> = Vec::new();
        for step in 0..500_usize {
            if plain.len() < 4 || step * 7 % 5 < 2 {
                plain.push(step % 3 == 0);
                roster.push_set(step % 3 == 0);
            } else {
                let to = step * 31 % plain.len();
                plain.swap_remove(to);
                roster.swap_remove_set(to);
            }
            let mut listed = roster.list().to_vec();
            listed.sort_unstable();
            let expected: Vec<u32> = (0..plain.len() as u32)
                .filter(|&set| plain[set as usize])
                .collect();
            assert_eq!(listed, expected);
        }
    }
}
