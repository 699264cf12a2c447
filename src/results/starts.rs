//! Are the starts forgotten? Nested R-hat over cells that differ in their initial topology alone.
//!
//! Chains from one start can agree on a mode that none of them leaves; only chains from other starts can tell.
//! The start is the superchain of Margossian et al. (2024), see [`nested_r_hat`].
//!
//! Of two starts or more whose chains have each **converged by themselves**, at least two chains of each, nested R-hat
//! must stay below [`max_nested_r_hat`] in every quantity that is material to all of them together; starts at rest must be at
//! rest at one topology. Otherwise none
//! of them has converged. A start whose chains have not converged takes nothing back of another: whether a start
//! is a bad one is what a factor `init` is there to tell.

use std::collections::HashMap;

use super::convergence::{common_indices, material, n_sets};
use super::{ChainResult, Convergence, Doubt, Quantity, Verdict, WorldResult};
use crate::diagnostics::chains::{Chains, Stretch};
use crate::diagnostics::r_hat::{RHat, max_nested_r_hat, nested_r_hat};
use crate::diagnostics::undefined::Undefined;
use crate::run::ChainOutcome;
use crate::sweep::Sweep;

/// Nested R-hat of the chains on a world, all starts together.
#[derive(Clone, Copy, Debug)]
pub struct Starts {
    /// Initial topologies that have a chain.
    pub n_starts: usize,
    /// Of M.
    pub n_sets: Result<f64, Undefined>,
    /// Of ln target.
    pub ln_target: Result<f64, Undefined>,
}

impl Default for Starts {
    fn default() -> Self {
        let none = Err(Undefined::TooFew { n: 0, fewest: 2 });
        Self {
            n_starts: 0,
            n_sets: none,
            ln_target: none,
        }
    }
}

/// A chain with the start that it set out from.
struct Member<'a> {
    cell: usize,
    init: &'a str,
    outcome: &'a ChainOutcome,
}

/// Fills in `starts` of every world, and takes back the convergence of those where chains from another start have
/// converged elsewhere.
pub(super) fn add_starts(sweep: &Sweep, chains: &[ChainResult], worlds: &mut [WorldResult]) {
    let key = |cell: usize, replicate: u64| {
        let settings = &sweep.cells[cell].settings;
        (settings.canonical_text(|key| key.name != "init"), replicate)
    };
    let mut groups: HashMap<(String, u64), Vec<Member<'_>>> = HashMap::new();
    for chain in chains.iter().filter(|chain| !chain.is_repeat) {
        if let Some(outcome) = chain.outcome() {
            let init = sweep.cells[chain.cell].settings.text("init");
            let group = groups.entry(key(chain.cell, chain.replicate)).or_default();
            group.push(Member {
                cell: chain.cell,
                init,
                outcome,
            });
        }
    }
    let converged: HashMap<(usize, u64), (Convergence, String)> = worlds
        .iter()
        .filter(|world| world.has_converged())
        .filter_map(|world| {
            let diagnosis = world.diagnosis.as_ref()?;
            let found = (diagnosis.convergence.clone(), diagnosis.map_labels.clone());
            Some(((world.cell, world.replicate), found))
        })
        .collect();
    let found: HashMap<(String, u64), (Starts, Vec<Doubt>)> = groups
        .iter()
        .map(|(key, group)| {
            let of = |member: &Member<'_>| {
                let (convergence, map) = converged.get(&(member.cell, key.1))?;
                Some((convergence.clone(), map.as_str()))
            };
            (key.clone(), (starts(group), doubts(group, of)))
        })
        .collect();
    for world in worlds {
        let key = key(world.cell, world.replicate);
        let Some((starts, doubts)) = found.get(&key) else {
            continue;
        };
        world.starts = *starts;
        if doubts.is_empty() || !world.has_converged() {
            continue;
        }
        if let Some(diagnosis) = &mut world.diagnosis {
            diagnosis.convergence = Convergence::Not(doubts.clone());
        }
        let own = groups[&key]
            .iter()
            .filter(|member| member.cell == world.cell);
        let any_recovered = own.into_iter().any(|m| m.outcome.recovered == Some(true));
        let diagnosis = world.diagnosis.as_ref();
        world.verdict = Verdict::of_world(diagnosis, any_recovered, world.n_failed);
    }
}

/// Whether the starts whose chains have converged by themselves disagree. A start whose chains are still on their way
/// says nothing of the others. `converged` has how a member's cell has, with its MAP topology.
fn doubts<'a, 'b>(
    group: &'a [Member<'a>],
    converged: impl Fn(&Member<'_>) -> Option<(Convergence, &'b str)>,
) -> Vec<Doubt> {
    let judged: Vec<(&Member<'_>, Convergence, &str)> = group
        .iter()
        .filter_map(|member| converged(member).map(|(how, map)| (member, how, map)))
        .collect();
    let mut by_start: HashMap<&str, usize> = HashMap::new();
    for (member, ..) in &judged {
        *by_start.entry(member.init).or_default() += 1;
    }
    let fewest = by_start.values().copied().min().unwrap_or(0);
    if by_start.len() < 2 || fewest < 2 {
        return Vec::new();
    }
    let most = max_nested_r_hat(by_start.len(), fewest);
    let at_rest = |how: &Convergence| *how == Convergence::AtRest;
    if judged.iter().all(|(_, how, _)| at_rest(how)) {
        // Too little happens for any R-hat, and their estimates of ln target may be stuck apart.
        let is_other = |(_, _, map): &(&Member<'_>, Convergence, &str)| *map != judged[0].2;
        return if judged.iter().any(is_other) {
            vec![Doubt::Starts {
                of: None,
                value: None,
                most,
            }]
        } else {
            Vec::new()
        };
    }
    let outcomes: Vec<&ChainOutcome> = judged.iter().map(|(member, ..)| member.outcome).collect();
    let members: Vec<&Member<'_>> = judged.iter().map(|(member, ..)| *member).collect();
    let superchain = superchains(&members);
    let first_step = first_step(&outcomes);
    let (topologies, _) = common_indices(&outcomes, first_step);
    let worst = material(&outcomes, first_step, &topologies)
        .unwrap_or_default()
        .iter()
        .filter_map(|own| nested(own.quantity, nested_r_hat(&own.chains, &superchain), most))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    worst.map(|(_, doubt)| doubt).into_iter().collect()
}

/// How far nested R-hat is off, with the doubt that this is.
fn nested(of: Quantity, found: Result<RHat, Undefined>, most: f64) -> Option<(f64, Doubt)> {
    let doubt = |value| Doubt::Starts {
        of: Some(of),
        value,
        most,
    };
    match found {
        Ok(found) if found.value() > most => Some((found.value(), doubt(Some(found.value())))),
        Err(Undefined::StuckDisagree { .. }) => Some((f64::INFINITY, doubt(None))),
        _ => None,
    }
}

fn starts(group: &[Member<'_>]) -> Starts {
    starts_of(&group.iter().collect::<Vec<_>>())
}

/// The start of each member, as an index of the initial topology.
fn superchains(group: &[&Member<'_>]) -> Vec<usize> {
    let mut inits: Vec<&str> = group.iter().map(|member| member.init).collect();
    inits.sort_unstable();
    inits.dedup();
    let place = |init: &str| inits.iter().position(|own| *own == init).unwrap_or(0);
    group.iter().map(|member| place(member.init)).collect()
}

fn first_step(outcomes: &[&ChainOutcome]) -> u64 {
    let first = outcomes.iter().map(|outcome| outcome.series.first_step);
    first.max().unwrap_or(0)
}

fn starts_of(group: &[&Member<'_>]) -> Starts {
    let superchain = superchains(group);
    let outcomes: Vec<&ChainOutcome> = group.iter().map(|member| member.outcome).collect();
    let first_step = first_step(&outcomes);
    let of = |chains: Result<Chains, Undefined>| Ok(nested_r_hat(&chains?, &superchain)?.value());
    let ln_target = |outcome: &&ChainOutcome| -> Vec<Stretch> {
        let series = &outcome.series;
        series.stretches(&series.ln_target, first_step).collect()
    };
    let ln_target: Vec<Vec<Stretch>> = outcomes.iter().map(ln_target).collect();
    Starts {
        n_starts: superchain.iter().max().map_or(0, |most| most + 1),
        n_sets: of(n_sets(&outcomes, first_step)),
        ln_target: of(Chains::new(&ln_target)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::convergence::tests::{chain, drawn, judged};
    use super::*;

    /// Chains of the starts named, with how the chains of each start have converged.
    fn found(chains: &[(&'static str, ChainOutcome)]) -> (Starts, Vec<String>) {
        let members: Vec<Member<'_>> = chains
            .iter()
            .map(|(init, outcome)| Member {
                cell: usize::from(*init != "a"),
                init,
                outcome,
            })
            .collect();
        let of_cell = |cell: usize| {
            let own = members.iter().filter(|member| member.cell == cell);
            let own: Vec<ChainOutcome> = own.map(|member| member.outcome.clone()).collect();
            (!own.is_empty()).then(|| judged(&own))
        };
        let cells = [of_cell(0), of_cell(1)];
        let of = |member: &Member<'_>| {
            let own = cells[member.cell].as_ref()?;
            let shown = own.convergence.is_shown();
            shown.then(|| (own.convergence.clone(), own.map_labels.as_str()))
        };
        let words = doubts(&members, of).iter().map(Doubt::word).collect();
        (starts(&members), words)
    }

    /// Draws of two laws, half of them at the first or at the last topology, the rest anywhere.
    fn low(number: u64) -> ChainOutcome {
        chain(&drawn(4000, 14, 15, number), 0, number as usize)
    }
    fn high(number: u64) -> ChainOutcome {
        chain(&drawn(4000, 0, 15, number), 0, number as usize)
    }

    /// Starts take turns in the list: who grouped chains by their place, or all together, would find nothing.
    #[test]
    fn chains_are_grouped_by_their_start() {
        let chains = [("a", low(1)), ("b", high(2)), ("a", low(3)), ("b", high(4))];
        let (starts, words) = found(&chains);
        assert_eq!(starts.n_starts, 2);
        let nested = starts.ln_target.expect("they move");
        let stretches: Vec<Vec<Stretch>> = chains
            .iter()
            .map(|(_, c)| c.series.ln_target.iter().map(|x| (*x, 1)).collect())
            .collect();
        let pooled = Chains::new(&stretches).expect("draws");
        let grouped = |by: [usize; 4]| nested_r_hat(&pooled, &by).expect("draws").value();
        assert_eq!(nested, grouped([0, 1, 0, 1]));
        let most = max_nested_r_hat(2, 2);
        assert!(nested > 1.1 && grouped([0, 0, 1, 1]) < most, "{nested}");
        assert!(
            words == ["starts of M"] || words == ["starts of topology"],
            "{words:?}"
        );
    }

    #[test]
    fn starts_that_are_forgotten_are_not_doubted() {
        let (starts, words) = found(&[
            ("a", high(1)),
            ("b", high(2)),
            ("a", high(3)),
            ("b", high(4)),
        ]);
        assert_eq!((starts.n_starts, words.len()), (2, 0));
        // One start by itself, or a single chain from the other, tells nothing.
        assert_eq!(found(&[("a", high(1)), ("a", high(3))]).1.len(), 0);
        assert_eq!(
            found(&[("a", low(1)), ("a", low(3)), ("b", high(2))])
                .1
                .len(),
            0
        );
    }

    #[test]
    fn a_start_that_has_not_converged_takes_nothing_back() {
        let (starts, words) = found(&[
            ("a", high(1)),
            ("a", high(3)),
            ("b", chain(&[3; 4000], 0, 1)),
            ("b", chain(&[9; 4000], 0, 2)),
        ]);
        assert!(starts.n_sets.is_ok() && words.is_empty(), "{words:?}");
    }

    #[test]
    fn starts_at_rest_must_rest_at_one_topology() {
        let rest = |at: usize, start: usize| {
            let mut steps = vec![at; 600];
            steps[7] = at + 1;
            chain(&steps, 0, start)
        };
        let at = |a, b| {
            found(&[
                ("a", rest(a, 1)),
                ("a", rest(a, 2)),
                ("b", rest(b, 3)),
                ("b", rest(b, 4)),
            ])
            .1
        };
        assert_eq!(at(5, 5), Vec::<String>::new());
        assert_eq!(at(5, 8), ["starts of MAP topology"]);
    }
}
