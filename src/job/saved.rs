//! Data, samples and diagnoses as bytes and back, as Python pickles them.
//!
//! The bytes are for the version that wrote them: a line that says so, then postcard. A sample holds
//! its chains and is pooled anew when it is read, which gives the same bits; a diagnosis of others'
//! chains holds what was found.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::{JobError, Sampled};
use crate::dataset::DataSet;
use crate::results::labels::LabelsResult;
use crate::results::sample::pool;
use crate::run::{ChainOutcome, SampledChain};
use crate::settings::{Settings, Value};

fn head(what: &str) -> String {
    format!("topometric {} {what}\n", env!("CARGO_PKG_VERSION"))
}

fn written(what: &str, content: &impl Serialize) -> Vec<u8> {
    let bytes = postcard::to_extend(content, head(what).into_bytes());
    bytes.expect("memory takes any bytes")
}

fn read<T: DeserializeOwned>(what: &str, bytes: &[u8]) -> Result<T, JobError> {
    let content = bytes.strip_prefix(head(what).as_bytes());
    let content = content.and_then(|content| postcard::from_bytes(content).ok());
    content.ok_or_else(|| {
        let version = env!("CARGO_PKG_VERSION");
        JobError::Refused(format!(
            "{what}: got bytes that version {version} did not write, expected its own; save it anew"
        ))
    })
}

impl DataSet {
    /// As bytes, without the notes of its reader.
    pub fn to_bytes(&self) -> Vec<u8> {
        written("data", &(&self.detections, &self.scene))
    }

    /// Of such bytes.
    ///
    /// # Errors
    /// Bytes of another version, or of something else.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, JobError> {
        let (detections, scene) = read("data", bytes)?;
        Ok(Self::new(detections, scene))
    }
}

#[derive(Serialize)]
struct ChainsOut<'a> {
    settings: Vec<(&'a str, String)>,
    chains: &'a [SampledChain],
    seconds: f64,
}

#[derive(Deserialize)]
struct ChainsIn {
    settings: Vec<(String, String)>,
    chains: Vec<SampledChain>,
    seconds: f64,
}

impl Sampled {
    /// As bytes, without the data.
    pub fn to_bytes(&self) -> Vec<u8> {
        let text = |value: &Value| value.to_string();
        let settings = self.settings.iter();
        let content = ChainsOut {
            settings: settings
                .map(|(key, value)| (key.name, text(value)))
                .collect(),
            chains: &self.chains,
            seconds: self.result.seconds,
        };
        written("sample", &content)
    }

    /// Of such bytes and the data that were sampled.
    ///
    /// # Errors
    /// Bytes of another version, or of something else.
    pub fn from_bytes(bytes: &[u8], data: &DataSet) -> Result<Self, JobError> {
        let content: ChainsIn = read("sample", bytes)?;
        let mut settings = Settings::default();
        for (name, text) in &content.settings {
            settings.set_text(name, text)?;
        }
        let chains = content.chains;
        let result = pool(&chains, data, &settings, content.seconds, &|_| ());
        Ok(Self {
            settings,
            chains,
            result,
        })
    }
}

impl LabelsResult {
    /// As bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        // Its form in JSON is a contract that postcard does not know.
        let found = serde_json::to_string(self).expect("numbers and texts");
        written("diagnosis", &(found, &self.outcomes))
    }

    /// Of such bytes.
    ///
    /// # Errors
    /// Bytes of another version, or of something else.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, JobError> {
        let (found, outcomes): (String, Vec<ChainOutcome>) = read("diagnosis", bytes)?;
        let found: Self = serde_json::from_str(&found)
            .map_err(|error| JobError::Refused(format!("diagnosis: {error}; save it anew")))?;
        Ok(Self { outcomes, ..found })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{Watch, diagnose, sample};
    use crate::labels::LabelChain;
    use crate::settings::BurnInRule;

    fn sampled() -> (DataSet, Sampled) {
        let mut settings = Settings::default();
        for (name, value) in [("samples", "3000"), ("noise", "0.5"), ("exact_up_to", "0")] {
            settings.set_text(name, value).expect("a setting");
        }
        let data = DataSet::load(&settings, 0).expect("a world");
        let sampled = sample(&data, &settings, &Watch::NOBODY).expect("chains");
        (data, sampled.expect("nobody stops it"))
    }

    fn json(of: &impl Serialize) -> String {
        serde_json::to_string(of).expect("numbers and texts")
    }

    #[test]
    fn what_was_written_comes_back() {
        let (data, sampled) = sampled();
        let again = DataSet::from_bytes(&data.to_bytes()).expect("our bytes");
        assert_eq!(again.detections, data.detections);
        assert_eq!(again.to_bytes(), data.to_bytes());
        assert!(again.scene.is_some() && again.truth.is_some());
        let restored = Sampled::from_bytes(&sampled.to_bytes(), &again).expect("our bytes");
        assert_eq!(json(&restored.result), json(&sampled.result));
        assert_eq!(restored.settings, sampled.settings);
        assert_eq!(restored.outcomes(), sampled.outcomes());
        let chains = sampled.chains.into_iter().map(|own| LabelChain {
            name: "a chain".to_owned(),
            start: own.trace.frequencies(0)[0].topology.clone(),
            trace: own.trace,
        });
        let found = diagnose(chains.collect(), BurnInRule::Auto, &|_| ()).expect("draws");
        let restored = LabelsResult::from_bytes(&found.to_bytes()).expect("our bytes");
        assert_eq!(json(&restored), json(&found));
        assert_eq!(restored.outcomes, found.outcomes);
    }

    #[test]
    fn other_bytes_are_refused_in_one_line() {
        let (data, sampled) = sampled();
        let bytes = data.to_bytes();
        for wrong in [
            &[][..],
            &bytes[..bytes.len() / 2],
            b"topometric 0.0.0 data\n",
        ] {
            let error = DataSet::from_bytes(wrong).expect_err("no data").to_string();
            assert!(error.starts_with("data: got bytes that version"), "{error}");
        }
        let error = Sampled::from_bytes(&bytes, &data).err().expect("no sample");
        assert!(error.to_string().starts_with("sample: got bytes"));
        let error = LabelsResult::from_bytes(&sampled.to_bytes()).expect_err("no diagnosis");
        assert!(error.to_string().starts_with("diagnosis: got bytes"));
    }
}
