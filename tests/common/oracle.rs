//! The posteriors of `tests/oracle`, which no code of this project computed.
#![allow(dead_code, reason = "every test binary uses a part of this")]

use std::collections::HashMap;

use serde_json::Value;
use topometric::detections::Covariance;
use topometric::model::{CovarianceModel, MetricModel, Model, Penalty, PenaltyShape};
use topometric::partition::Topology;

/// A posterior that no code of this project computed.
pub struct Oracle {
    pub model: Model,
    pub probabilities: HashMap<Topology, f64>,
    pub rows: Vec<(Topology, f64, f64, f64)>,
    pub expected_n_sets: f64,
}

fn oracle(text: &str) -> Oracle {
    let json: Value = serde_json::from_str(text).expect("an oracle file");
    let number = |value: &Value| value.as_f64().expect("a number");
    let shape: PenaltyShape = json["penalty_shape"]
        .as_str()
        .expect("a text")
        .parse()
        .expect("a shape");
    let detections = json["detections"].as_array().expect("a list");
    let positions_m: Vec<[f64; 2]> = detections
        .iter()
        .map(|d| [number(&d["x"]), number(&d["y"])])
        .collect();
    let penalty = Penalty {
        shape,
        radius_m: number(&json["penalty_radius"]),
        height: number(&json["penalty_height"]),
    };
    let (sigma_o, sigma_t) = (number(&json["sigma_o"]), number(&json["sigma_t"]));
    let model = if json["model"] == "covariance" {
        let covariances_m2: Vec<Covariance> = detections
            .iter()
            .map(|d| Covariance {
                xx: number(&d["cov_xx"]),
                xy: number(&d["cov_xy"]),
                yy: number(&d["cov_yy"]),
            })
            .collect();
        CovarianceModel::new(&positions_m, &covariances_m2, sigma_o, sigma_t, penalty)
            .expect("good covariances")
            .into()
    } else {
        MetricModel::new(&positions_m, sigma_o, sigma_t, penalty).into()
    };
    let partitions = json["partitions"].as_array().expect("a list");
    let rows: Vec<_> = partitions
        .iter()
        .map(|row| {
            let labels = row["labels"].as_array().expect("a list");
            let labels: Vec<u64> = labels
                .iter()
                .map(|l| l.as_u64().expect("a label"))
                .collect();
            let topology = Topology::canonical(&labels);
            (
                topology,
                number(&row["probability"]),
                number(&row["ln_unnormalised"]),
                number(&row["se"]),
            )
        })
        .collect();
    Oracle {
        model,
        probabilities: rows.iter().map(|row| (row.0.clone(), row.1)).collect(),
        rows,
        expected_n_sets: number(&json["expected_number_of_sets"]),
    }
}

/// Case `m1`.
pub fn m1() -> Oracle {
    oracle(include_str!("../oracle/m1.json"))
}

/// Case `m3`.
pub fn m3() -> Oracle {
    oracle(include_str!("../oracle/m3.json"))
}

/// Case `c1`.
pub fn c1() -> Oracle {
    oracle(include_str!("../oracle/c1.json"))
}
