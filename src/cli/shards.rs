//! Which shard of a sweep this process is: from a flag, or from the scheduler that started it.

use crate::run::Shard;

use super::Failure;

/// The part of the chains that is run here; `variable` reads the environment.
pub fn shard(
    given: Option<Shard>,
    count: Option<u64>,
    variable: impl Fn(&str) -> Option<String>,
) -> Result<Option<Shard>, Failure> {
    if given.is_some() {
        return Ok(given);
    }
    let number = |name: &str| -> Result<Option<u64>, Failure> {
        let Some(text) = variable(name).filter(|text| !text.is_empty()) else {
            return Ok(None);
        };
        let wrong = || {
            Failure::usage(format!(
                "{name}: got {text:?}, expected a whole number; give --shard K/N yourself"
            ))
        };
        text.parse().map(Some).map_err(|_| wrong())
    };
    let mut task = None;
    for name in ["SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX", "HQ_TASK_ID"] {
        if let Some(id) = number(name)? {
            task = Some((name, id));
            break;
        }
    }
    match (task, count) {
        (None, None) => Ok(None),
        (None, Some(_)) => Err(Failure::usage(
            "--shards: got no number of a task from Slurm, Kubernetes or HyperQueue, expected one in the \
             environment; give --shard K/N instead",
        )),
        // N numbers in a row, wherever they begin, are N different shards.
        (Some((_, id)), Some(count)) => Ok(Shard::new(id % count, count)),
        (Some(("SLURM_ARRAY_TASK_ID", id)), None) => {
            let of = |name: &str| {
                number(name)?.ok_or_else(|| {
                    Failure::usage(format!("{name}: is not set; give --shard K/N yourself"))
                })
            };
            let (first, last) = (of("SLURM_ARRAY_TASK_MIN")?, of("SLURM_ARRAY_TASK_MAX")?);
            let count = of("SLURM_ARRAY_TASK_COUNT")?;
            let step = number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1).max(1);
            let shard = Shard::new(id.saturating_sub(first) / step, count);
            let is_whole = last.saturating_sub(first) / step + 1 == count;
            shard.filter(|_| is_whole).map(Some).ok_or_else(|| {
                Failure::usage(format!(
                    "SLURM_ARRAY_TASK_COUNT: got {count} tasks from {first} to {last}, an array with gaps; give \
                     --shards N with the number of shards in all, or --shard K/N"
                ))
            })
        }
        (Some((name, _)), None) => Err(Failure::usage(format!(
            "{name}: is set, so this is a part of a sweep; give --shards N with the number of parts, or \
             --shard 1/1 to run all of it here"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Variables<'a> = &'a [(&'a str, &'a str)];

    fn of(count: Option<u64>, variables: &[(&str, &str)]) -> Result<String, String> {
        let variable = |name: &str| {
            let found = variables.iter().find(|(key, _)| *key == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        let shard = shard(None, count, variable).map_err(|failure| failure.to_string())?;
        Ok(shard.map_or_else(|| "all".to_owned(), |shard| shard.to_string()))
    }

    #[test]
    fn schedulers_say_which_shard_it_is() {
        let slurm = |id, min, max, count| {
            [
                ("SLURM_ARRAY_TASK_ID", id),
                ("SLURM_ARRAY_TASK_MIN", min),
                ("SLURM_ARRAY_TASK_MAX", max),
                ("SLURM_ARRAY_TASK_COUNT", count),
            ]
        };
        let step = [
            &slurm("9", "5", "13", "3")[..],
            &[("SLURM_ARRAY_TASK_STEP", "4")],
        ]
        .concat();
        let cases: [(Option<u64>, Variables<'_>, &str); 8] = [
            (None, &[], "all"),
            (None, &[("HQ_TASK_ID", "")], "all"),
            (None, &slurm("0", "0", "7", "8"), "1/8"),
            (None, &slurm("3", "1", "8", "8"), "3/8"),
            (None, &step, "2/3"),
            // A list of what is missing says nothing of how many there are in all.
            (Some(8), &slurm("7", "2", "7", "2"), "8/8"),
            (Some(4), &[("JOB_COMPLETION_INDEX", "3")], "4/4"),
            (Some(4), &[("HQ_TASK_ID", "4")], "1/4"),
        ];
        for (count, variables, expected) in cases {
            assert_eq!(
                of(count, variables),
                Ok(expected.to_owned()),
                "{variables:?}"
            );
        }
        let refused: [(Option<u64>, Variables<'_>); 6] = [
            (Some(4), &[]),
            (None, &[("HQ_TASK_ID", "4")]),
            (None, &[("JOB_COMPLETION_INDEX", "0")]),
            (None, &[("JOB_COMPLETION_INDEX", "-1")]),
            (None, &[("SLURM_ARRAY_TASK_ID", "4")]),
            (None, &slurm("7", "2", "7", "2")),
        ];
        for (count, variables) in refused {
            let error = of(count, variables).expect_err("refused");
            assert!(error.contains("--shard"), "{error}");
        }
    }

    #[test]
    fn n_numbers_in_a_row_are_n_shards() {
        for first in [0, 1, 5, 1000] {
            let mut seen: Vec<String> = (first..first + 6)
                .filter_map(|id: u64| of(Some(6), &[("HQ_TASK_ID", &id.to_string())]).ok())
                .collect();
            seen.sort();
            assert_eq!(seen, ["1/6", "2/6", "3/6", "4/6", "5/6", "6/6"]);
        }
    }
}
