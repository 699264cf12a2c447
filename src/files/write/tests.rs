use super::*;

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("read");
    let name = |entry: Result<std::fs::DirEntry>| entry.expect("read").file_name();
    let mut names: Vec<_> = entries.map(name).collect();
    names.sort();
    let text = |name: std::ffi::OsString| name.to_string_lossy().into_owned();
    names.into_iter().map(text).collect()
}

#[test]
fn a_file_is_replaced_and_readable_as_any_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
    std::fs::write(&plain, "old").expect("written");
    for text in ["first", "second"] {
        write_whole(&ours, text.as_bytes()).expect("written");
        assert_eq!(std::fs::read_to_string(&ours).expect("read"), text);
    }
    let mode = |path: &Path| std::fs::metadata(path).expect("there").permissions();
    assert_eq!(mode(&ours), mode(&plain));
    assert_eq!(names(folder.path()), ["ours", "plain"]);
}

#[test]
fn one_of_several_makes_a_new_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a");
    let makes = |text: &str| write_new(&path, text.as_bytes()).expect("a good folder");
    assert_eq!([makes("first"), makes("second")], [true, false]);
    assert_eq!(std::fs::read_to_string(&path).expect("read"), "first");
    assert_eq!(names(folder.path()), ["a"]);
}

#[test]
fn a_check_leaves_nothing_behind() {
    let folder = tempfile::tempdir().expect("a folder");
    check_writable(&folder.path().join("a")).expect("can be written");
    assert!(names(folder.path()).is_empty());
    let missing = check_writable(&folder.path().join("none/a")).expect_err("no folder");
    assert_eq!(
        missing.to_string(),
        "No such file or directory (os error 2)"
    );
    let is_folder = check_writable(folder.path()).expect_err("a folder");
    assert_eq!(is_folder.kind(), ErrorKind::IsADirectory);
}

#[cfg(unix)]
mod unix {
    use super::*;
    use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
    use std::process::Command;

    #[test]
    fn a_link_stays_and_what_it_leads_to_is_replaced() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("elsewhere")).expect("made");
        std::fs::write(path("elsewhere/file"), "old").expect("written");
        symlink("elsewhere/file", path("link")).expect("made");
        symlink(path("link"), path("second")).expect("made");
        symlink("elsewhere/missing", path("dangling")).expect("made");
        for (link, target) in [
            ("link", "elsewhere/file"),
            ("second", "elsewhere/file"),
            ("dangling", "elsewhere/missing"),
        ] {
            check_writable(&path(link)).expect("can be written");
            write_whole(&path(link), link.as_bytes()).expect("written");
            assert!(path(link).is_symlink());
            assert!(!path(target).is_symlink());
            assert_eq!(std::fs::read_to_string(path(target)).expect("read"), link);
        }
        symlink("round", path("round")).expect("made");
        assert!(write_whole(&path("round"), b"").is_err());
        assert_eq!(names(&path("elsewhere")), ["file", "missing"]);
    }

    #[test]
    fn permissions_of_the_replaced_file_are_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a");
        std::fs::write(&path, "old").expect("written");
        for mode in [0o600, 0o666, 0o755] {
            let set = std::fs::set_permissions(&path, Permissions::from_mode(mode));
            set.expect("ours");
            write_durable(&path, b"new").expect("written");
            let now = std::fs::metadata(&path).expect("there").permissions();
            assert_eq!(now.mode() & 0o777, mode);
        }
    }

    #[test]
    fn a_fifo_is_written_in_place_and_checked_without_being_opened() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("fifo");
        let made = Command::new("mkfifo").arg(&path).status();
        assert!(made.expect("mkfifo").success());
        let reader = std::thread::spawn({
            let path = path.clone();
            move || std::fs::read_to_string(path).expect("read")
        });
        check_writable(&path).expect("can be written");
        write_whole(&path, b"text").expect("written");
        assert_eq!(reader.join().expect("a reader"), "text");
        let kind = std::fs::symlink_metadata(&path).expect("there").file_type();
        assert!(kind.is_fifo());
        assert_eq!(names(folder.path()), ["fifo"]);
    }

    #[test]
    fn devices_are_written_in_place() {
        let place = |path: &str| place_of(Path::new(path)).expect("there");
        assert_eq!(place("/dev/null"), Place::Open("/dev/null".into()));
        for name in ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"] {
            assert_eq!(place(name), Place::Output);
        }
        assert_eq!(place("/dev/stderr"), Place::ErrorOutput);
        assert_eq!(place("/dev/fd/7"), Place::Open("/dev/fd/7".into()));
        write_whole(Path::new("/dev/null"), b"text").expect("written");
        let kind = std::fs::metadata("/dev/null").expect("there").file_type();
        assert!(kind.is_char_device());
    }
}
