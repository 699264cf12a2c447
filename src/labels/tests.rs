//! What label files may look like, and what is refused.

use std::path::Path;

use super::*;

fn collected(files: &[&str]) -> Result<LabelChains, String> {
    let mut collector = Collector::new(100);
    for (number, text) in files.iter().enumerate() {
        let path = format!("f{number}");
        let source = Source::from_reader(text.as_bytes(), Path::new(&path));
        read(source.expect("text"), &mut collector).map_err(|error| error.to_string())?;
    }
    collector.finish()
}

/// Topologies draw by draw.
fn draws(chain: &LabelChain) -> Vec<String> {
    let mut draws = Vec::new();
    for (run, dwell) in chain.trace.dwell_times(0) {
        let topology = chain.trace.topologies.get(run.topology).expect("held");
        draws.extend((0..dwell).map(|_| topology.to_string()));
    }
    draws
}

#[test]
fn every_form_gives_the_same_chains() {
    let forms = [
        "chain,draw,a,b,c\n1,0,5,5,2\n1,1,5,2,2\n2,0,1,2,3\n2,1,1,2,3\n",
        "Chain;Labels;n_sets\n1;0,0,1;9\n2;0 1 2;9\n1;[7 8 8];9\n2;0,1,2;9\n",
        "chain\tweight\tlabels\n1\t1\tx,x,y\n1\t1\tx y y\n2\t2\t1.0 2.0 3.0\n",
        "[[[1,1,2],[0,4,4]],[[\"a\",\"b\",\"c\"],[1,2,3]]]",
        "{\"posterior\": {\"labels\": [[[1,1,2],[0,4,4]],[[2,1,0],[1.0,2.0,3.0]]]}}",
    ];
    for form in forms {
        let found = collected(&[form]).expect(form);
        assert_eq!((found.n_items, found.n_left_out), (3, 0), "{form}");
        let chains: Vec<Vec<String>> = found.chains.iter().map(draws).collect();
        assert_eq!(chains, [["0,0,1", "0,1,1"], ["0,1,2", "0,1,2"]], "{form}");
        assert_eq!(found.chains[1].name, "f0, chain 2", "{form}");
        assert_eq!(found.chains[0].start.to_string(), "0,0,1");
    }
    // Files without a column of chains are a chain each, and the longer one is cut.
    let found = collected(&["a,b\n1,1\n1,2\n", "a,b\n3,4\n", "[[1,1],[2,2],[1,2]]"]);
    let found = found.expect("three chains");
    assert_eq!((found.chains.len(), found.n_left_out), (3, 3));
    assert_eq!(found.chains[2].name, "f2");
    assert_eq!(draws(&found.chains[0]), ["0,0"]);
}

/// A draw with a weight is as many draws, also where the table of topologies is full.
#[test]
fn a_weight_is_so_many_draws() {
    for max_topologies in [100, 3] {
        let (mut heavy, mut plain) = (
            Collector::new(max_topologies),
            Collector::new(max_topologies),
        );
        for k in 0..4000_u32 {
            let labels = [0, k % 2, k % 3, k % 5, k % 7];
            let topology = crate::partition::Topology::canonical(&labels);
            let weight = u64::from(1 + k % 4);
            heavy.push("", &topology, (weight, 0.0)).expect("a draw");
            for _ in 0..weight {
                plain.push("", &topology, (1, 0.0)).expect("a draw");
            }
        }
        let [heavy, plain] = [heavy, plain].map(|own| own.finish().expect("one chain"));
        let seen = |own: &LabelChains| {
            let trace = &own.chains[0].trace;
            let sums = trace.sums(100);
            let mut pairs: Vec<_> = sums.pairs.into_iter().collect();
            pairs.sort_unstable();
            let rows = trace.frequencies(0).into_iter();
            let rows: Vec<_> = rows.map(|row| (row.topology, row.count)).collect();
            let snapshots = trace.snapshots().map(|own| {
                let states = own.after(0, trace.n_steps);
                let states = states.map(|(state, n)| (state.topology.clone(), n));
                states.collect::<Vec<_>>()
            });
            (trace.runs.clone(), rows, sums.n_sets.mean, pairs, snapshots)
        };
        assert!(seen(&heavy) == seen(&plain), "{max_topologies}");
        assert_eq!(
            heavy.chains[0].trace.snapshots().is_some(),
            max_topologies == 3
        );
        assert_eq!(heavy.chains[0].trace.n_steps, 10_000);
    }
    let mut collector = Collector::new(10);
    let topology = crate::partition::Topology::canonical(&[0, 0]);
    collector
        .push("", &topology, (MAX_WEIGHT, 0.0))
        .expect("a draw");
    let found = collector.finish().expect("one chain");
    assert_eq!(found.chains[0].trace.n_steps, MAX_WEIGHT);
}

/// Whatever a file holds, it is read or refused in one line.
#[test]
fn nothing_in_a_file_breaks_the_reader() {
    use rand::RngExt;
    let mut rng = crate::rng::Purpose::new("labels test", 1).generator();
    let words = [
        "chain",
        "labels",
        "weight",
        "draw",
        "ln_target",
        ",",
        ",",
        "\n",
        "\n",
        "0",
        "1",
        "2.0",
        "-1",
        "nan",
        "\"",
        "[",
        "]",
        "{",
        "}",
        ":",
        "a",
        " ",
        "é",
        "posterior",
        "null",
        "1e9",
    ];
    let mut n_read = 0;
    for _ in 0..20_000 {
        let text: String = (0..rng.random_range(1..40))
            .map(|_| words[rng.random_range(0..words.len())])
            .collect();
        match collected(&[&text]) {
            Ok(found) => n_read += usize::from(!found.chains.is_empty()),
            Err(error) => assert!(!error.contains('\n'), "{error}"),
        }
    }
    assert!(n_read > 100, "{n_read}");
}

#[test]
fn what_will_not_do_is_refused_in_one_line() {
    let message = |text: &str| collected(&[text]).err().expect(text);
    for (text, expected) in [
        (
            "chain,draw\n1,2\n",
            "f0, line 1: got chain,draw, expected columns with labels; add the column labels, or one column for each item",
        ),
        (
            "a,b\n1,1\n1\n",
            "f0, line 3: got 1 fields, expected 2 as in the header; write one field per column",
        ),
        (
            "a,b\n1,\n",
            "f0, line 2: got \"\", expected a label; give every item a label in every draw",
        ),
        (
            "labels\n0 0\n0 0 1\n",
            "f0, line 3: got 3 labels, expected 2 as in the draws before; give every draw one label for each item",
        ),
        (
            "weight,a\n0,1\n",
            "f0, line 2: got \"0\", expected a weight, a whole number from 1 to 1000000000000; write how many steps the draw stands for",
        ),
        (
            "[1,2]",
            "f0: got JSON without such an array, expected labels as an array chain × draw × item; write it as labels, or give the Parquet of ptm sample --trace",
        ),
        (
            "[[[1,2],[1,null]]]",
            "f0: got draw 2 of chain 1 that is no list of numbers or names, expected one label for each item; correct the draw",
        ),
        (
            "[[[1,2],[1]]]",
            "f0: got draw 2 of chain 1 with 1 labels, expected 2 as in the draws before; give every draw one label for each item",
        ),
    ] {
        assert_eq!(message(text), expected);
    }
    assert!(message("[[1,2").contains("no JSON"));
}
