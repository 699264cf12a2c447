//! Exit codes and the one line of an error.

use std::any::Any;
use std::io::ErrorKind;

use crate::dataset::DataError;
use crate::detections::DetectionsError;
use crate::import::ImportError;
use crate::input::InputError;
use crate::job::JobError;
use crate::report::ReportError;
use crate::run::{FolderError, JournalError, RunError};
use crate::settings::SettingError;
use crate::sweep::SweepError;
use crate::table::{ReadError, TableError};
use crate::world::WorldError;

use super::terminal;

/// How a run ends. Scripts depend on the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// All done.
    Done,
    /// The command line or the environment must change.
    Usage,
    /// Finished, but some chains failed, or an exact table is not as well known as was asked for.
    SomeFailed,
    /// `compare` found a difference.
    Differs,
    /// An input file's content is wrong.
    Data,
    /// A bug of ours.
    Bug,
    /// It may go better later: the disk is full, or somebody else is at it.
    TryAgain,
    /// Stopped by this signal; everything finished so far is kept.
    Signal(i32),
}

impl Exit {
    fn number(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Usage => 1,
            Self::SomeFailed => 2,
            Self::Differs => 3,
            Self::Data => 65,
            Self::Bug => 70,
            Self::TryAgain => 75,
            Self::Signal(signal) => 128 + signal as u8,
        }
    }
}

/// Why a run cannot go on: its exit code and one line.
#[derive(Debug)]
pub struct Failure {
    exit: Exit,
    message: String,
}

impl Failure {
    /// The command line or the environment must change.
    pub fn usage(message: impl Into<String>) -> Self {
        Self {
            exit: Exit::Usage,
            message: message.into(),
        }
    }

    /// The content of an input file is wrong.
    pub fn data(message: impl Into<String>) -> Self {
        Self {
            exit: Exit::Data,
            message: message.into(),
        }
    }

    /// It may go better later.
    pub fn try_again(message: impl Into<String>) -> Self {
        Self {
            exit: Exit::TryAgain,
            message: message.into(),
        }
    }

    /// The file system says no: a full disk or a limit on a file's size passes, the rest must
    /// change.
    pub fn file_system(source: &std::io::Error, message: String) -> Self {
        match source.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
                Self::try_again(message)
            }
            _ => Self::usage(message),
        }
    }

    /// Everything has been said.
    pub fn silent(exit: Exit) -> Self {
        Self {
            exit,
            message: String::new(),
        }
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

impl From<SettingError> for Failure {
    fn from(error: SettingError) -> Self {
        Self::usage(error.to_string())
    }
}

impl From<SweepError> for Failure {
    fn from(error: SweepError) -> Self {
        match error {
            SweepError::Read { .. } | SweepError::NeedsData { .. } => {
                Self::usage(error.to_string())
            }
            _ => Self::data(error.to_string()),
        }
    }
}

impl From<DataError> for Failure {
    fn from(error: DataError) -> Self {
        match &error {
            DataError::Detections(DetectionsError::Input(InputError::Read { .. }))
            | DataError::World(WorldError::Read { .. } | WorldError::Name { .. }) => {
                Self::usage(error.to_string())
            }
            DataError::Detections(_)
            | DataError::InSweep { .. }
            | DataError::World(_)
            | DataError::Model(_)
            | DataError::StartFile(_) => Self::data(error.to_string()),
            DataError::Simulation(_) | DataError::Start(_) => Self::usage(error.to_string()),
        }
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        match error {
            ReadError::Read { .. } => Self::usage(error.to_string()),
            ReadError::Content { .. } => Self::data(error.to_string()),
        }
    }
}

impl From<JournalError> for Failure {
    fn from(error: JournalError) -> Self {
        let message = error.to_string();
        match error {
            JournalError::Io { source, .. } => Self::file_system(&source, message),
            JournalError::Damaged { .. }
            | JournalError::OtherVersion { .. }
            | JournalError::Conflict { .. } => Self::data(message),
        }
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Journal(error) => error.into(),
            RunError::Data(error) => error.into(),
        }
    }
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        match error {
            InputError::Read { .. } => Self::usage(error.to_string()),
            InputError::Content(_) => Self::data(error.to_string()),
        }
    }
}

impl From<ImportError> for Failure {
    fn from(error: ImportError) -> Self {
        match error {
            ImportError::Input(error) => error.into(),
            ImportError::Choice { .. } => Self::usage(error.to_string()),
            _ => Self::data(error.to_string()),
        }
    }
}

impl From<FolderError> for Failure {
    fn from(error: FolderError) -> Self {
        let message = error.to_string();
        match error {
            FolderError::Io { source, .. } => Self::file_system(&source, message),
            FolderError::InUse { .. } => Self::try_again(message),
            FolderError::Damaged { .. } => Self::data(message),
            FolderError::Journal(error) => error.into(),
            _ => Self::usage(message),
        }
    }
}

impl From<TableError> for Failure {
    fn from(error: TableError) -> Self {
        let message = error.to_string();
        match error {
            TableError::Io { source, .. } => Self::file_system(&source, message),
            TableError::Encode { .. } => Self::usage(message),
        }
    }
}

impl From<JobError> for Failure {
    fn from(error: JobError) -> Self {
        match error {
            JobError::Settings(error) => error.into(),
            JobError::Sweep(error) => error.into(),
            JobError::Data(error) => error.into(),
            JobError::Refused(message) => Self::data(message),
            JobError::Input(error) => error.into(),
            JobError::Read(error) => error.into(),
            JobError::Folder(error) => error.into(),
            JobError::Run(error) => error.into(),
            JobError::Table(error) => error.into(),
            JobError::Report(error) => error.into(),
        }
    }
}

impl From<ReportError> for Failure {
    fn from(error: ReportError) -> Self {
        Self::file_system(&error.source, error.to_string())
    }
}

/// Prints what is to be said and gives the code of the process.
pub fn code(outcome: Result<Result<Exit, Failure>, Box<dyn Any + Send>>) -> u8 {
    let mut exit = match outcome {
        Ok(Ok(exit)) => exit,
        Ok(Err(failure)) => {
            if !failure.message.is_empty() {
                errln!("ptm: {}", shortened(&failure.message.replace('\n', " ")));
            }
            failure.exit
        }
        Err(panic) => {
            let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
            let text = text
                .or_else(|| panic.downcast_ref::<String>().cloned())
                .unwrap_or_default();
            let text = shortened(&text.replace('\n', " "));
            errln!("ptm: a bug of ours, please report it: {text}");
            Exit::Bug
        }
    };
    if let Some(why) = terminal::output_failure() {
        errln!("ptm: standard output: cannot be written ({why}); choose another place");
        if matches!(exit, Exit::Done | Exit::SomeFailed | Exit::Differs) {
            exit = Exit::Usage;
        }
    }
    exit.number()
}

/// A line that can be read, whatever a file held that it cites: its beginning says what and where, its end what
/// to do.
fn shortened(message: &str) -> String {
    const MOST: usize = 1200;
    const END: usize = 300;
    let n = message.chars().count();
    if n <= MOST {
        return message.to_owned();
    }
    let begin: String = message.chars().take(MOST - END).collect();
    let end: String = message.chars().skip(n - END).collect();
    format!("{begin} […] {end}")
}
