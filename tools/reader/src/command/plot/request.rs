//! What to draw, and why there is no picture.

use std::path::PathBuf;

use crate::{
    command::trace::TraceError,
    field::{Selection, SelectionError},
    recording::{Damage, OpenError},
    select::{Pattern, Window},
    slice::MomentError,
};

/// What to draw.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// Topics; the drag of percuss if none.
    pub topics: Vec<Pattern>,
    /// Fields and positions.
    pub selection: Selection,
    /// Times of profiles and images; curves over time if none.
    pub at_times: Option<Vec<f64>>,
    /// Times, and every n-th row.
    pub window: Window,
    /// Logarithmic axes, horizontal and vertical.
    pub log: (bool, bool),
    /// Ends of the horizontal axis.
    pub x_range: Option<(f64, f64)>,
    /// Ends of the vertical axis, or of the colours of an image.
    pub range: Option<(f64, f64)>,
    /// Title; the names of the files if none.
    pub title: Option<String>,
}

/// A picture and what was wrong with its files.
pub struct Drawn {
    /// The picture.
    pub picture: Vec<u8>,
    /// What is damaged, by file.
    pub damages: Vec<(PathBuf, Damage)>,
    /// Messages that could not be decoded.
    pub undecoded: u64,
    /// Fields that are left out of whole topics, and why.
    pub left_out: Vec<SelectionError>,
}

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// The numbers cannot be had.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// There is nothing to draw.
    #[error("nothing to draw: {0}")]
    Nothing(String),
    /// What is asked for does not go into one picture.
    #[error("{0}")]
    Unfit(String),
    /// There are no messages at a time.
    #[error(transparent)]
    Moment(#[from] MomentError),
    /// The picture cannot be drawn.
    #[error("cannot draw: {0}")]
    Draw(String),
}

impl From<OpenError> for PlotError {
    fn from(error: OpenError) -> Self {
        Self::Trace(error.into())
    }
}

impl From<SelectionError> for PlotError {
    fn from(error: SelectionError) -> Self {
        Self::Trace(error.into())
    }
}
