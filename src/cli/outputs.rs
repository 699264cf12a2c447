//! The files that a command writes where its user has said: looked at before anything is run,
//! written whole.

use std::path::{Path, PathBuf};

use crate::files::{check_writable, is_for_a_file, write_durable};

use super::Failure;
use super::terminal::{output, shown_json};

/// Fails early if a file cannot be written, before anything is run, or if one would replace another
/// or the input.
pub fn check_outputs(input: Option<&Path>, outputs: &[&PathBuf]) -> Result<(), Failure> {
    let inputs = input.map(Path::to_path_buf);
    let mut taken: Vec<PathBuf> = inputs.iter().map(|path| same_file(path)).collect();
    for path in outputs {
        let file = same_file(path);
        // A device, as /dev/null, may take everything.
        if taken.contains(&file) && (path.is_file() || !path.exists()) {
            return Err(Failure::usage(format!(
                "{}: is already the place of another file of this run; choose another",
                path.display()
            )));
        }
        taken.push(file);
        check_writable(path).map_err(|error| unwritable(path, &error))?;
    }
    Ok(())
}

/// One name for all ways to name a file, whether or not it exists yet.
fn same_file(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    let folder = folder.unwrap_or(Path::new(".")).canonicalize();
    let named = match (folder, path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_path_buf(),
    };
    named.canonicalize().unwrap_or(named)
}

/// Makes a folder for outputs, and those above it.
pub fn make_folder(path: &Path) -> Result<(), Failure> {
    if let Some(file) = path.ancestors().find(|part| part.exists())
        && !file.is_dir()
    {
        let file = file.display();
        return Err(Failure::usage(format!(
            "{file} is a file, not a folder; give the path of a folder"
        )));
    }
    std::fs::create_dir_all(path).map_err(|error| unwritable(path, &error))
}

/// Writes what the user has named a place for, whole and for good.
pub fn write_output(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    write_durable(path, bytes).map_err(|error| unwritable(path, &error))
}

/// Where the map of detections goes: where the user says, or beside them if they are in a file.
pub fn map_beside(given: Option<&PathBuf>, detections: &Path) -> Option<PathBuf> {
    let beside = || is_for_a_file(detections).then(|| detections.with_extension("png"));
    given.cloned().or_else(beside)
}

/// A result as one line of JSON, into a file or, for `-`, to standard output.
pub fn write_json(path: &Path, result: &impl serde::Serialize) -> Result<(), Failure> {
    let mut text = serde_json::to_string(result).expect("finite numbers and texts make JSON");
    text.push('\n');
    let text = shown_json(&text);
    if path == Path::new("-") {
        output(&text);
        return Ok(());
    }
    write_output(path, text.as_bytes())
}

/// An output that cannot be written.
pub fn unwritable(path: &Path, error: &std::io::Error) -> Failure {
    let path = path.display();
    let message = format!("{path}: cannot be written ({error}); choose another place");
    Failure::file_system(error, message)
}
