//! Which topics, which times, which of many messages: chosen alike by every verb.

use globset::{GlobBuilder, GlobMatcher};

use crate::messages::Recording;

/// A pattern of topics or fields: `*` stands for anything, `?` for one character, `[ab]` for one of some.
#[derive(Clone, Debug)]
pub struct Pattern {
    text: String,
    matcher: Option<GlobMatcher>,
}

impl std::str::FromStr for Pattern {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if !text.contains(['*', '?', '[', '{']) {
            return Ok(Self { text: text.into(), matcher: None });
        }
        let glob = GlobBuilder::new(text).literal_separator(false).build().map_err(|e| e.to_string())?;
        Ok(Self { text: text.into(), matcher: Some(glob.compile_matcher()) })
    }
}

impl Pattern {
    /// True if a name fits; the pattern's own text always does.
    pub fn fits(&self, name: &str) -> bool {
        name == self.text || self.matcher.as_ref().is_some_and(|matcher| matcher.is_match(name))
    }

    /// The pattern as it was written.
    pub fn text(&self) -> &str {
        &self.text
    }
}

/// There is no such topic.
#[derive(Debug, thiserror::Error)]
#[error("`{}` has no topic `{topic}`; it has {known}", file.display())]
pub struct UnknownTopic {
    /// Recording.
    pub file: std::path::PathBuf,
    /// Topic or pattern asked for.
    pub topic: String,
    /// Topics that exist.
    pub known: String,
}

/// Ids of the channels whose topics fit any of the patterns, in the order of the patterns.
///
/// # Errors
///
/// A pattern fits nothing.
pub fn channels(recording: &Recording, patterns: &[Pattern]) -> Result<Vec<u16>, UnknownTopic> {
    let mut ids = Vec::new();
    for pattern in patterns {
        let fitting = recording.channels.iter().filter(|(_, channel)| pattern.fits(&channel.topic));
        let before = ids.len();
        let mut found = false;
        for (&id, _) in fitting {
            found = true;
            if !ids[..before].contains(&id) {
                ids.push(id);
            }
        }
        if !found {
            let known: Vec<&str> =
                recording.channels.values().map(|channel| channel.topic.as_str()).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            let (file, topic) = (recording.path.clone(), pattern.text.clone());
            return Err(UnknownTopic { file, topic, known });
        }
    }
    Ok(ids)
}
