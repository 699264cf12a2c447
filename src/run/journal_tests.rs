//! Tests of the journal.

use super::*;
use crate::run::FailureKind;

fn record(key: &str) -> ChainRecord {
    let reason = "a µ and a \"quote\"".to_owned();
    ChainRecord {
        key: key.to_owned(),
        status: ChainStatus::Failed {
            kind: FailureKind::Data,
            reason,
        },
    }
}

/// The names of a record of another version may be anything.
#[test]
fn what_is_no_record_of_ours_is_said_in_one_line() {
    let json = r#"{"key":"a","status":{"do\n":{}}}"#;
    let bytes = format!("{:08x} {json}\n", crc32fast::hash(json.as_bytes()));
    let error = Contents::parse(bytes.as_bytes(), "f").expect_err("no record");
    assert!(matches!(error, JournalError::OtherVersion { line: 1, .. }));
    assert!(!error.to_string().contains('\n'), "{error}");
}

#[test]
fn a_torn_last_line_is_cut_and_a_damaged_one_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("journal.jsonl");
    let journal = Journal::open(folder.path()).expect("a new journal");
    for key in ["a", "b", "c"] {
        journal.append(&record(key)).expect("a write");
    }
    drop(journal);
    let bytes = std::fs::read(&path).expect("the file");
    let two_lines = bytes
        .iter()
        .enumerate()
        .filter(|(_, b)| **b == b'\n')
        .nth(1)
        .expect("three")
        .0
        + 1;
    for length in two_lines..bytes.len() {
        std::fs::write(&path, &bytes[..length]).expect("a write");
        let journal = Journal::open(folder.path()).expect("a torn journal");
        assert_eq!(journal.get("b"), Some(&record("b")));
        assert_eq!(journal.get("c"), None);
        assert_eq!(journal.notes().len(), usize::from(length > two_lines));
        journal.append(&record("c")).expect("a write");
        drop(journal);
        assert_eq!(std::fs::read(&path).expect("the file"), bytes);
    }
    for place in 0..two_lines {
        let mut damaged = bytes.clone();
        damaged[place] ^= 4;
        std::fs::write(&path, &damaged).expect("a write");
        assert!(
            matches!(
                Journal::open(folder.path()),
                Err(JournalError::Damaged { .. })
            ),
            "byte {place}"
        );
    }
}

#[test]
fn a_shard_has_a_file_for_each_start() {
    let folder = tempfile::tempdir().expect("a folder");
    let journal = Journal::open(folder.path()).expect("a new journal");
    journal.append(&record("of all")).expect("a write");
    drop(journal);
    let shard = |k| Shard::new(k, 2).expect("k < 2");
    let first = Journal::open_shard(folder.path(), shard(0)).expect("a start");
    let second = Journal::open_shard(folder.path(), shard(0)).expect("another");
    let other = Journal::open_shard(folder.path(), shard(1)).expect("another shard");
    for (journal, key) in [(&first, "a"), (&second, "b"), (&other, "c")] {
        assert!(journal.get("of all").is_some());
        journal.append(&record(key)).expect("a write");
    }
    // The first is killed while it writes.
    let torn = folder.path().join("shards/1-of-2.1.jsonl");
    let bytes = std::fs::read(&torn).expect("the file");
    std::fs::write(&torn, [&bytes[..], &bytes[..9]].concat()).expect("a write");
    let third = Journal::open_shard(folder.path(), shard(0)).expect("a third");
    assert!(third.get("a").is_some() && third.get("b").is_some() && third.get("c").is_none());
    assert_eq!(third.notes().len(), 1);
    let names = shard_files(folder.path()).expect("the folder");
    let starts: Vec<_> = names
        .iter()
        .map(|file| (file.shard.index(), file.start))
        .collect();
    assert_eq!(starts, [(0, 1), (0, 2), (0, 3), (1, 1)]);
}

#[test]
fn a_whole_line_of_something_else_is_another_versions() {
    let json = "{\"key\":\"a\",\"status\":\"done\"}";
    let line = format!("{:08x} {json}\n", crc32fast::hash(json.as_bytes()));
    let wrong = Contents::parse(line.as_bytes(), "j").expect_err("no record");
    assert!(
        wrong
            .to_string()
            .starts_with("j:1: got a record of another version of ptm (")
    );
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_ends_the_journal_at_a_whole_line() {
    // /dev/full takes nothing and says that the disk is full.
    let mut journal = Journal::empty();
    let file = OpenOptions::new()
        .append(true)
        .open("/dev/full")
        .expect("a device");
    journal.write_to(Path::new("/dev/full"), file, 0);
    // Chains on other cores append after the one that failed; any of them may be the one that is heard.
    for _ in 0..2 {
        match journal.append(&record("a")) {
            Err(JournalError::Io { source, .. }) => {
                assert_eq!(source.kind(), ErrorKind::StorageFull);
            }
            other => panic!("{other:?}"),
        }
    }
}
