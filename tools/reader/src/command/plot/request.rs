//! What to draw, and why there is no picture.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::{
    convention,
    failure::Failure,
    field::{Selection, SelectionError},
    measured::Sources,
    messages::Recording,
    recording::{Damage, Limits},
    select::{self, Bound, Pattern, Window, finite_time},
    units::Units,
};

/// What to draw.
#[derive(Args, Clone, Debug, Default)]
pub struct Request {
    /// Topics; if none, that of [`select::channels_or_default`](crate::select::channels_or_default).
    #[arg(skip)]
    pub topics: Vec<Pattern>,
    /// Fields and positions.
    #[arg(skip)]
    pub selection: Selection,
    /// Fields on an axis at the right, of the chosen topics or of another: FIELD or TOPIC.FIELD; may be repeated
    #[arg(long, value_name = "FIELD")]
    #[arg(conflicts_with_all = ["at_times", "map"])]
    pub right: Vec<String>,
    /// An array over its axis and over time, as an image; a matrix along a line, --at r=0 or --at z=0.5. Nearest-neighbour
    /// in both; missing elements are 0
    #[arg(long, conflicts_with_all = ["at_times", "every"])]
    pub map: bool,
    /// Times: arrays over their axis, or a matrix as an image, at the nearest messages; in the unit that is recorded or with one,
    /// 87us, whatever prefix the picture has
    #[arg(long = "at-time", value_name = "T", value_delimiter = ',', allow_negative_numbers = true, value_parser = finite_time)]
    #[arg(conflicts_with_all = ["from", "to", "every"])]
    pub at_times: Option<Vec<Bound>>,
    /// Times, and every n-th row.
    #[command(flatten)]
    pub window: Window,
    /// Log times as seconds since 1970 instead of from the start of the recording
    #[arg(long)]
    pub epoch: bool,
    /// Draw columns of a table (CSV, JSON lines, Parquet, .npz): the one along the horizontal axis; a column is named without its
    /// unit
    #[arg(long, value_name = "KEY", requires = "y")]
    #[arg(conflicts_with_all = ["topics", "fields", "at", "right", "map", "at_times", "from", "to", "every", "epoch"])]
    pub x: Option<String>,
    /// The column along the vertical axis
    #[arg(long, value_name = "KEY", requires = "x")]
    pub y: Option<String>,
    /// A column whose every value has a curve of its own, drawn from the least to the greatest of --x
    #[arg(long, value_name = "KEY", requires = "x")]
    pub by: Option<String>,
    /// Tables beside recordings.
    #[command(flatten)]
    pub sources: Sources,
    /// Time that is added to those of tables beside recordings, in the unit of the recording or with one, 5us
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = finite_time)]
    pub time_offset: Option<Bound>,
    /// Units that are chosen.
    #[command(flatten)]
    pub units: Units,
    /// Logarithmic axes, horizontal and vertical.
    #[arg(skip)]
    pub log: (bool, bool),
    /// Ends of the vertical axis, or of the colours of an image, in the unit of the recording: LOW,HIGH
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, allow_hyphen_values = true)]
    pub range: Option<(f64, f64)>,
    /// Ends of the horizontal axis, in the unit of the recording: LOW,HIGH [default of the image of a matrix: where it can be seen]
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, allow_hyphen_values = true)]
    pub x_range: Option<(f64, f64)>,
    /// Ends of the vertical axis of an image, in the unit of the recording: LOW,HIGH
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, allow_hyphen_values = true)]
    pub y_range: Option<(f64, f64)>,
    /// Title [default: the names of the files]
    #[arg(long)]
    pub title: Option<String>,
}

impl Request {
    /// A recording, and the topics whose arrays are drawn: the stress of the interface if none are named.
    pub(super) fn open_arrays(&self, path: &Path, limits: Limits) -> Result<(Recording, Vec<u16>), Failure> {
        let mut recording = Recording::open(path, limits)?;
        if self.epoch {
            recording.count_from(0);
        }
        let default = [convention::INTERFACE.parse().expect("a plain topic")];
        let topics = if self.topics.is_empty() { &default[..] } else { &self.topics };
        let ids = select::channels(&recording, topics)?;
        Ok((recording, ids))
    }

    /// Refuses what only images have.
    pub(super) fn check_curves(&self) -> Result<(), Failure> {
        match self.y_range {
            Some(_) => {
                Err(Failure::Usage("--y-range is for images; --range is the vertical axis of curves".into()))
            }
            None => Ok(()),
        }
    }
}

/// Two numbers, the lower first.
fn range(text: &str) -> Result<(f64, f64), String> {
    let numbers = text.split_once(',').and_then(|(low, high)| {
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        Some((number(low)?, number(high)?))
    });
    numbers
        .filter(|(low, high)| low < high)
        .ok_or_else(|| "write a range as LOW,HIGH, the lower end first".into())
}

/// A picture and what was wrong with its files.
#[derive(Default)]
pub struct Drawn {
    /// The picture.
    pub picture: Vec<u8>,
    /// What is damaged, by file.
    pub damages: Vec<(PathBuf, Damage)>,
    /// Messages that could not be decoded.
    pub undecoded: u64,
    /// Fields that are left out of whole topics, and why.
    pub left_out: Vec<SelectionError>,
    /// Rows of a table that lack one of the numbers of a point.
    pub lacking: usize,
    /// What is to be said of the picture.
    pub remark: Option<String>,
}
