//! Detailed balance in closed form: every weight and ratio that a move reports, at states of a
//! chain, against π(T, X) from its definition and the density of what is drawn.

use super::super::particles::Present;
use super::*;
use crate::model::location_law::LocationLaw;
use crate::model::moments::Moments;
use crate::sampler::choices::Choices;

/// All shapes and priors, for each a model, its moves, a state and a generator.
pub(super) fn each(mut test: impl FnMut(&Model, Prior, &mut Explicit, &mut State, &mut Generator)) {
    for (number, prior) in (0..).zip(priors()) {
        for shape in [PenaltyShape::Quadratic, PenaltyShape::Cubic] {
            for model in [
                crowd(shape),
                wide(shape),
                crowd_of_ellipses(shape),
                wide_of_ellipses(shape),
            ] {
                let mut explicit = Explicit::new(&model, prior, 3);
                let n = model.n_detections() as u32;
                let labels: Vec<u32> = (0..n).map(|i| i / 3).collect();
                let mut state = start(&model, prior, &labels);
                test(
                    &model,
                    prior,
                    &mut explicit,
                    &mut state,
                    &mut rng(10 + number),
                );
            }
        }
    }
}

/// ln of the density of the normal law that a location is drawn from.
pub(super) fn ln_normal(x_m: [f64; 2], law: &LocationLaw) -> f64 {
    let l = law.factor_m;
    let first = (x_m[0] - law.mean_m[0]) / l[0];
    let second = (x_m[1] - law.mean_m[1] - l[1] * first) / l[2];
    -0.5 * (first * first + second * second) - (std::f64::consts::TAU * l[0] * l[2]).ln()
}

/// ln w = ln π(T', X') − ln(R·q) up to one constant, of every particle and of far places.
#[test]
fn particles_are_weighed_by_target_over_proposal() {
    let (mut n_checks, mut n_far, mut n_rings) = (0, 0, 0);
    each(|model, prior, explicit, state, rng| {
        for round in 0..120 {
            wander(explicit, state, rng);
            let n = state.partition.n_detections();
            let i = rng.below(n) as u32;
            if round % 4 == 0 {
                // Into a set at random, which may be far.
                explicit.particles.look(&explicit.laws, state, i);
                let to = rng.below(state.partition.n_sets()) as u32;
                let x_m = explicit.laws.z_m(i);
                explicit.put(state, Some(to), x_m);
            }
            explicit.particles.look(&explicit.laws, state, i);
            explicit.particles.draw(&explicit.laws, state, rng);
            let particles = explicit.particles.particles.clone();
            let candidates = explicit.particles.candidates.clone();
            let mut constants = Vec::new();
            let alone = explicit.laws.alone(i);
            for particle in &particles {
                let x_m = particle.x_m;
                let (ln_r, ln_q) = match particle.stratum {
                    Stratum::New => {
                        let plain = ln_normal(x_m, &alone);
                        let over = explicit.particles.ln_over_mixture(x_m);
                        n_rings += usize::from(over != 0.0);
                        // q = γ/(γ/q).
                        (6.0_f64.ln(), plain - over)
                    }
                    Stratum::Joins(ix) => (2.0_f64.ln(), ln_normal(x_m, &candidates[ix].law)),
                };
                let to = match particle.stratum {
                    Stratum::New => None,
                    Stratum::Joins(ix) => Some(candidates[ix].set_ix),
                };
                let mut after = state.clone();
                explicit.put(&mut after, to, x_m);
                let ln_target = ln_joint(model, prior, &after);
                constants.push(ln_target - ln_r - ln_q - particle.ln_weight);
            }
            // A far place: ln_back is ln Σw + ln(ε n/(N−1)) − ln w_F.
            let far = if explicit.particles.present == Present::Far {
                Some(state.partition.set_of()[i as usize])
            } else {
                (0..state.partition.n_sets() as u32).find(|set| {
                    state.partition.set_of()[i as usize] != *set
                        && candidates.iter().all(|candidate| candidate.set_ix != *set)
                })
            };
            if let Some(set_ix) = far {
                let candidate = explicit.far(state, set_ix);
                let x_m = if explicit.particles.present == Present::Far {
                    state.placement().x_m[i as usize]
                } else {
                    candidate.law.place([0.3, -0.8])
                };
                let ln_back = explicit.ln_back(state, &candidate, x_m);
                let is_own = state.partition.set_of()[i as usize] == set_ix;
                let n_there = state.partition.sets()[set_ix as usize].len() - usize::from(is_own);
                let ln_sum = explicit.particles.ln_largest
                    + explicit.particles.weights.iter().sum::<f64>().ln();
                let ln_chance = (0.02 * n_there as f64 / (n - 1) as f64).ln();
                let ln_far = ln_sum + ln_chance - ln_back;
                let mut after = state.clone();
                explicit.put(&mut after, Some(set_ix), x_m);
                let ln_q = ln_normal(x_m, &candidate.law);
                constants.push(ln_joint(model, prior, &after) - ln_q - ln_far);
                n_far += 1;
            }
            for constant in &constants {
                let apart = (constant - constants[0]).abs();
                assert!(apart < 1e-8 * (1.0 + constant.abs()), "{constants:?}");
                n_checks += 1;
            }
        }
    });
    assert!(
        n_checks > 10_000 && n_far > 100 && n_rings > 1000,
        "{n_checks} {n_far} {n_rings}"
    );
}

/// Candidates and ring look the same from every place of the detection itself, which the weights
/// rely on.
#[test]
fn candidates_do_not_depend_on_where_the_detection_is() {
    each(|_, _, explicit, state, rng| {
        for _ in 0..60 {
            wander(explicit, state, rng);
            let i = rng.below(state.partition.n_detections()) as u32;
            let mut seen = Vec::new();
            explicit.particles.look(&explicit.laws, state, i);
            explicit.particles.draw(&explicit.laws, state, rng);
            let n = explicit.particles.particles.len();
            for k in 0..n.min(12) {
                let mut after = state.clone();
                explicit.take(&mut after, k);
                explicit.particles.look(&explicit.laws, &after, i);
                let set_of = |set_ix: u32| {
                    let members = &after.partition.sets()[set_ix as usize];
                    members.iter().copied().filter(|&j| j != i).min()
                };
                let candidates = explicit.particles.candidates.iter();
                let mut sets: Vec<_> = candidates
                    .map(|c| (set_of(c.set_ix), (c.ln_z * 1e6).round()))
                    .collect();
                sets.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
                let ring = explicit.particles.ln_over_mixture([0.7, 0.2]);
                seen.push((sets, (ring * 1e9).round()));
                explicit.particles.look(&explicit.laws, state, i);
                // The same particles as before.
                explicit
                    .particles
                    .draw(&explicit.laws, state, &mut super::rng(5));
            }
            assert!(seen.windows(2).all(|pair| pair[0] == pair[1]), "{seen:?}");
        }
    });
}

/// v_i/V before and after a flip are those of the states themselves.
#[test]
fn scores_after_a_flip_are_those_of_the_state_after_it() {
    let mut n_checks = 0;
    each(|_, _, explicit, state, rng| {
        for _ in 0..100 {
            wander(explicit, state, rng);
            let i = rng.below(state.partition.n_detections()) as u32;
            explicit.particles.look(&explicit.laws, state, i);
            let Present::In(present) = explicit.particles.present else {
                continue;
            };
            explicit.particles.draw(&explicit.laws, state, rng);
            let side = explicit.particles.side(present != Stratum::New);
            for k in side {
                let stratum = explicit.particles.particles[k].stratum;
                assert_ne!(stratum == Stratum::New, present == Stratum::New);
                let got = explicit.scores(state, k);
                let mut after = state.clone();
                explicit.take(&mut after, k);
                for (got, state) in got.into_iter().zip([&*state, &after]) {
                    let placement = state.placement();
                    let set =
                        &state.partition.sets()[state.partition.set_of()[i as usize] as usize];
                    let expected = placement.leaving_of(i, set.len()) / placement.total_leaving();
                    assert!((got / expected - 1.0).abs() < 1e-9, "{got} {expected}");
                    n_checks += 1;
                }
            }
        }
    });
    assert!(n_checks > 2000, "{n_checks}");
}

/// A detection is drawn with probability v/V.
#[test]
fn detections_are_drawn_by_their_scores() {
    let model = wide(PenaltyShape::Quadratic);
    let mut explicit = Explicit::new(&model, Prior::Uniform, 2);
    let mut state = start(&model, Prior::Uniform, &[0; 40]);
    let mut rng = rng(2);
    for _ in 0..30 {
        wander(&mut explicit, &mut state, &mut rng);
    }
    let (partition, placement) = (&state.partition, state.placement());
    let n_draws = 400_000;
    let mut counts = [0.0_f64; 40];
    for _ in 0..n_draws {
        counts[placement.draw_leaving(partition, &mut rng) as usize] += 1.0;
    }
    for (i, count) in (0..).zip(counts) {
        let set = &partition.sets()[partition.set_of()[i as usize] as usize];
        let p = placement.leaving_of(i, set.len()) / placement.total_leaving();
        let (expected, sd) = (p * n_draws as f64, (p * n_draws as f64).sqrt());
        assert!(
            (count - expected).abs() < 5.0 * sd + 1.0,
            "{i}: {count} {expected}"
        );
    }
}

/// P(T)·Π I₀·w·q of a block is π(T, X) up to one constant: ratio and weights of both sides.
#[test]
fn blocks_are_weighed_by_target_over_proposal() {
    let mut n_checks = 0;
    each(|model, prior, explicit, state, rng| {
        for _ in 0..150 {
            wander(explicit, state, rng);
            let mut change = Change::default();
            let rule = SplitRule::Uniform;
            let (_, proposal) =
                crate::sampler::split_merge::propose(rule, &state.partition, &mut change, rng);
            let crate::sampler::moves::Proposal::Change { .. } = proposal else {
                continue;
            };
            // Accept whatever is proposed, and look at both states.
            let before = state.clone();
            assert!(
                explicit
                    .blocks
                    .run(&explicit.laws, state, &change, f64::INFINITY, rng)
            );
            let (gone, come) = (change.removed().len(), change.added().len());
            let ln_closed = state.ln_target() - before.ln_target();
            // The way back, described from the state after.
            let mut back = Change::default();
            for set_ix in state.partition.n_sets() - come..state.partition.n_sets() {
                back.remove(set_ix as u32);
            }
            for &set in change.removed() {
                let members = &before.partition.sets()[set as usize];
                back.add().extend_from_slice(members);
            }
            assert_eq!(back.added().len(), gone);
            let ln_back = explicit.blocks.ln_closed(&explicit.laws, state, &back);
            assert!((ln_closed + ln_back).abs() < 1e-9, "{ln_closed} {ln_back}");
            let ln_w_after = explicit.blocks.ln_present(&explicit.laws, state, &back);
            let q_after = ln_density(model, state, &explicit.blocks, &back);
            explicit.blocks.ln_closed(&explicit.laws, &before, &change);
            let ln_w_before = explicit.blocks.ln_present(&explicit.laws, &before, &change);
            let q_before = ln_density(model, &before, &explicit.blocks, &change);
            let got = ln_closed + (ln_w_after + q_after) - (ln_w_before + q_before);
            let expected = ln_joint(model, prior, state) - ln_joint(model, prior, &before);
            assert!(
                (got - expected).abs() < 1e-8 * (1.0 + expected.abs()),
                "{got} {expected}"
            );
            n_checks += 1;
        }
    });
    assert!(n_checks > 1000, "{n_checks}");
}

/// ln q of the present locations of the sets that a change removes: normal laws with the tilt. In the
/// metric model from their definition, N(X*, Σ) = exp(−E)/∫exp(−E).
fn ln_density(model: &Model, state: &State, blocks: &blocks::Blocks, change: &Change) -> f64 {
    let x_m = state.placement().locations_m();
    let (mut sum, mut means) = (0.0, Vec::new());
    for &set in change.removed() {
        let members = &state.partition.sets()[set as usize];
        for &i in members {
            let others = members.iter().copied().filter(|&j| j != i);
            sum += match model {
                Model::Metric(_) => {
                    let ln_alone = (model.precisions().0 / std::f64::consts::PI).ln();
                    ln_alone - energy(model, i, &others.collect::<Vec<_>>(), x_m)
                }
                Model::Covariance(covariance) => {
                    let law = covariance.joining(i, others, &mut Vec::new());
                    ln_normal(x_m[i as usize], &law)
                }
            };
        }
        if let Model::Metric(metric) = model {
            sum -= metric.ln_gaussian(members);
        }
        means.push(Moments::of(members.iter().map(|&i| x_m[i as usize])).mean_m);
    }
    if let Some(tilt) = &blocks.present.tilt {
        let difference = [0, 1].map(|axis| means[0][axis] - means[1][axis]);
        sum -= tilt.ln_correction(difference);
    }
    sum
}
