//! Kubernetes: an Indexed Job, whose pods take their shard from `JOB_COMPLETION_INDEX`.
//!
//! A pod that loses its node is made again and goes on where its records end. What fails by the sweep's
//! own fault is not tried again.

use serde_json::{Value, json};

use super::SubmitCommand;

/// Pods at a time at most; the cluster's own limits hold beside it.
const MAX_PARALLEL: u64 = 100;
/// How often the pod of one shard is made again.
const MAX_RETRIES: u64 = 5;
/// What trying again does not mend: command line, failed chains, content of a file.
const FINAL_EXITS: [u8; 3] = [1, 2, 65];

/// The manifest.
pub fn manifest(command: &SubmitCommand, image: &str, claim: &str) -> Value {
    let mut arguments = vec!["sweep".to_owned(), command.file.display().to_string()];
    if let Some(data) = &command.data {
        arguments.extend(["--data".to_owned(), data.display().to_string()]);
    }
    if let Some(out) = &command.out {
        arguments.extend(["--out".to_owned(), out.display().to_string()]);
    }
    arguments.extend(["--shards".to_owned(), command.shards.to_string()]);
    arguments.extend(["--threads".to_owned(), command.cores.to_string()]);
    let stem = command.file.file_stem().unwrap_or_default();
    let cpu = command.cores.to_string();
    json!({
        "apiVersion": "batch/v1",
        "kind": "Job",
        "metadata": {"name": name(&stem.to_string_lossy())},
        "spec": {
            "completionMode": "Indexed",
            "completions": command.shards,
            "parallelism": command.shards.min(MAX_PARALLEL),
            "backoffLimitPerIndex": MAX_RETRIES,
            "podFailurePolicy": {"rules": [
                {"action": "Ignore", "onPodConditions": [{"type": "DisruptionTarget", "status": "True"}]},
                {"action": "FailIndex", "onExitCodes": {
                    "containerName": "ptm", "operator": "In", "values": FINAL_EXITS,
                }},
            ]},
            "template": {"spec": {
                "restartPolicy": "Never",
                "containers": [{
                    "name": "ptm",
                    "image": image,
                    "command": ["ptm"],
                    "args": arguments,
                    "workingDir": "/work",
                    "resources": {"requests": {"cpu": cpu}},
                    "volumeMounts": [{"name": "work", "mountPath": "/work"}],
                }],
                "volumes": [{"name": "work", "persistentVolumeClaim": {"claimName": claim}}],
            }},
        },
    })
}

/// A name that Kubernetes takes: small letters, digits and dashes, of at most 63 in all with the number
/// of a pod behind it.
fn name(sweep: &str) -> String {
    let lower = sweep.to_lowercase();
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
    let plain: String = lower.chars().map(plain).take(40).collect();
    let name = format!("ptm-{}", plain.trim_matches('-'));
    name.trim_matches('-').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_that_kubernetes_takes() {
        assert_eq!(name("noisy"), "ptm-noisy");
        assert_eq!(name("Größe 2_b."), "ptm-gr--e-2-b");
        assert_eq!(name("ü"), "ptm");
        assert!(name(&"x".repeat(100)).len() < 50);
    }
}
