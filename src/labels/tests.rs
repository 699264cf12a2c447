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
            "f0, line 2: got \"0\", expected a whole number of at least 1 as the weight; write how many steps the draw stands for",
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
