//! A recording of whatever format: opened, its format told, and read, each once.

use std::path::{Path, PathBuf};

use super::error::ImportError;
use super::format::Format;
use super::recording::Recording;
use super::truth::read_truth;
use super::{g2o, mrclam, range_bearing};
use crate::input::{ReadSoFar, Source};

/// A recording that is about to be read.
pub struct Opened<'a> {
    path: PathBuf,
    format: Format,
    /// `None` for a folder.
    source: Option<Source<'a>>,
}

/// What a recording does not say of itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct Choices<'a> {
    /// The robot of a folder of MRCLAM.
    pub robot: Option<u32>,
    /// The truth of a range-bearing CSV.
    pub truth: Option<&'a Path>,
}

impl<'a> Opened<'a> {
    /// Opens what lies at a path, and tells its format unless it is given. `watch` hears after
    /// every block how far the reading of a file has come.
    ///
    /// # Errors
    /// A file that cannot be read, or that is no text.
    pub fn new(
        path: &Path,
        format: Option<Format>,
        watch: impl FnMut(ReadSoFar) + 'a,
    ) -> Result<Self, ImportError> {
        let is_folder = match format {
            Some(format) => format == Format::Mrclam,
            None => path.is_dir(),
        };
        if is_folder {
            return Ok(Self {
                path: path.to_owned(),
                format: Format::Mrclam,
                source: None,
            });
        }
        let mut source = Source::open_watched(path, watch)?;
        let format = format.map_or_else(|| Format::of_source(&mut source), Ok)?;
        Ok(Self {
            path: path.to_owned(),
            format,
            source: Some(source),
        })
    }

    /// The format.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Reads the recording.
    ///
    /// # Errors
    /// Whatever is wrong with it.
    pub fn read(self, choices: Choices<'_>) -> Result<Recording, ImportError> {
        let Some(source) = self.source else {
            return mrclam::read_mrclam(&self.path, choices.robot);
        };
        if self.format == Format::G2o {
            return g2o::parse(source);
        }
        let (mut recording, rows) = range_bearing::read(source)?;
        let truth = choices.truth.map(|path| read_truth(path, &rows));
        recording.truth = truth.transpose()?;
        Ok(recording)
    }
}
