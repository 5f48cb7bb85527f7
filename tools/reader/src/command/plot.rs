//! `plot`: fields against time, arrays over their axis at chosen times, matrices as images.

use std::{
    collections::BTreeSet,
    io,
    path::{Path, PathBuf},
};

use percuss_picture::{Curve, Medium, Panel, draw, draw_image};

use crate::{
    axis::Axis,
    command::trace::{Align, Request as Traced, TraceError, trace},
    field::{Selection, SelectionError},
    messages::Recording,
    recording::{Damage, Limits, OpenError},
    select::{self, Pattern, UnknownTopic},
    slice::{Profile, Slice, moments, profile, row, slice},
    table::{Cell, Heading, Sink},
    wire::UNKNOWN,
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
    /// First time.
    pub from: Option<f64>,
    /// Last time.
    pub to: Option<f64>,
    /// Every n-th row.
    pub every: u64,
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
    /// The picture cannot be drawn.
    #[error("cannot draw: {0}")]
    Draw(String),
}

impl From<OpenError> for PlotError {
    fn from(error: OpenError) -> Self {
        Self::Trace(error.into())
    }
}

impl From<UnknownTopic> for PlotError {
    fn from(error: UnknownTopic) -> Self {
        Self::Trace(error.into())
    }
}

impl From<SelectionError> for PlotError {
    fn from(error: SelectionError) -> Self {
        Self::Trace(error.into())
    }
}

/// Draws a picture.
///
/// # Errors
///
/// A file cannot be read, or there is nothing in it to draw.
pub fn plot(
    paths: &[PathBuf],
    request: &Request,
    limits: Limits,
    medium: Medium,
) -> Result<Drawn, PlotError> {
    let names: Vec<String> = paths.iter().map(|path| name(path)).collect();
    let title = request.title.clone().unwrap_or_else(|| names.join(", "));
    if let Some(times) = &request.at_times {
        return at_times(paths, request, times, &title, limits, medium);
    }
    if let Some(drawn) = last_image(paths, request, limits, medium)? {
        return Ok(drawn);
    }
    let (mut panel, damages) = traces(paths, request, limits)?;
    panel.title = title;
    let picture = draw(&[panel], medium).map_err(PlotError::Draw)?;
    Ok(Drawn { picture, damages })
}

fn name(path: &Path) -> String {
    path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

/// Takes a table as curves.
#[derive(Default)]
struct Curves {
    headings: Vec<Heading>,
    curves: Vec<Curve>,
}

impl Sink for Curves {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        self.headings = headings.to_vec();
        let curve = |heading: &Heading| Curve { name: heading.name.clone(), ..Curve::default() };
        self.curves = headings.iter().skip(1).map(curve).collect();
        Ok(())
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        let Some((time, cells)) = cells.split_first() else { return Ok(()) };
        let time = time.number().unwrap_or(f64::NAN);
        for (curve, cell) in self.curves.iter_mut().zip(cells) {
            // an empty cell is a message of another topic, not a gap
            if let Some(number) = cell.number() {
                curve.points.push((time, number));
            }
        }
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Fields against time, without those that only count.
pub(crate) fn traces(
    paths: &[PathBuf],
    request: &Request,
    limits: Limits,
) -> Result<(Panel, Vec<(PathBuf, Damage)>), PlotError> {
    let traced = Traced {
        topics: request.topics.clone(),
        selection: request.selection.clone(),
        from: request.from,
        to: request.to,
        every: request.every.max(1),
        align: Align::Exact,
        stack: false,
        follow: false,
    };
    let mut table = Curves::default();
    let outcome = trace(paths, &traced, limits, &mut table)?;
    let all_chosen = request.selection.fields.is_empty();
    let is_counter = |heading: &Heading| {
        let name = heading.name.rsplit([':', '.']).next().unwrap_or_default();
        all_chosen && matches!(name, "step" | "log_time")
    };
    let (mut curves, mut headings) = (Vec::new(), Vec::new());
    for (curve, heading) in table.curves.into_iter().zip(&table.headings[1.min(table.headings.len())..]) {
        if !is_counter(heading) && !curve.points.is_empty() {
            curves.push(curve);
            headings.push(heading.clone());
        }
    }
    if curves.is_empty() {
        return Err(PlotError::Nothing("no field of these topics holds numbers in this time".into()));
    }
    let panel = Panel {
        x_label: table.headings.first().map_or_else(String::new, Heading::with_unit),
        y_label: common_label(&headings),
        curves,
        log_x: request.log.0,
        log_y: request.log.1,
        x_range: request.x_range,
        y_range: request.range,
        ..Panel::default()
    };
    Ok((panel, outcome.damages))
}

/// Name and unit that all columns share, as far as they do.
fn common_label(headings: &[Heading]) -> String {
    let base = |heading: &Heading| {
        let name = heading.name.rsplit(':').next().unwrap_or_default().to_owned();
        let name = name.split(['@', '[']).next().unwrap_or_default().to_owned();
        name.rsplit(['/', '.']).next().unwrap_or_default().to_owned()
    };
    let names: BTreeSet<String> = headings.iter().map(base).collect();
    let units: BTreeSet<Option<&String>> = headings.iter().map(|heading| heading.unit.as_ref()).collect();
    let name =
        if names.len() <= 3 { names.into_iter().collect::<Vec<_>>().join(", ") } else { "value".into() };
    let units: Vec<&str> = units.into_iter().map(|unit| unit.map_or("1", String::as_str)).collect();
    match units.as_slice() {
        ["1"] => name,
        units => format!("{name} [{}]", units.join(", ")),
    }
}

/// An image of the last message, if what is asked for is a matrix of one file.
fn last_image(
    paths: &[PathBuf],
    request: &Request,
    limits: Limits,
    medium: Medium,
) -> Result<Option<Drawn>, PlotError> {
    let [path] = paths else { return Ok(None) };
    if request.topics.is_empty() {
        return Ok(None);
    }
    let recording = Recording::open(path, limits)?;
    let ids = select::channels(&recording, &request.topics)?;
    let [id] = ids.as_slice() else { return Ok(None) };
    let channel = &recording.channels[id];
    let Some(layout) = &channel.layout else { return Ok(None) };
    let is_matrix =
        (0..layout.leaves.len()).any(|i| matches!(Axis::of(i, layout, channel), Axis::Matrix { .. }));
    if !is_matrix || !request.selection.fields.is_empty() || request.selection.at.is_some() {
        return Ok(None);
    }
    at_times(paths, request, &[], "", limits, medium).map(Some)
}

/// Profiles, or an image, at some times.
fn at_times(
    paths: &[PathBuf],
    request: &Request,
    times: &[f64],
    title: &str,
    limits: Limits,
    medium: Medium,
) -> Result<Drawn, PlotError> {
    let default = ["/interface/stress".parse().expect("a plain topic")];
    let topics = if request.topics.is_empty() { &default[..] } else { &request.topics };
    let (mut profiles, mut images, mut damages) = (Vec::new(), Vec::new(), Vec::new());
    for path in paths {
        let recording = Recording::open(path, limits)?;
        for id in select::channels(&recording, topics)? {
            let channel = &recording.channels[&id];
            let Some(layout) = &channel.layout else { continue };
            let (moments, found) = moments(&recording, id, times)?;
            damages.extend(found.into_iter().map(|damage| (path.clone(), damage)));
            let chosen = |leaf: &usize| {
                let path = &layout.leaves[*leaf].path;
                let fields = &request.selection.fields;
                path != UNKNOWN && (fields.is_empty() || fields.contains(path))
            };
            for (moment, leaf) in moments
                .iter()
                .flat_map(|moment| (0..layout.leaves.len()).filter(chosen).map(move |l| (moment, l)))
            {
                let file = if paths.len() > 1 { format!("{}: ", name(path)) } else { String::new() };
                if let Some(found) = profile(channel, leaf, moment) {
                    profiles.push((file, found));
                } else if let Some(found) = slice(channel, leaf, moment) {
                    match &request.selection.at {
                        Some(at) if at.coordinate == found.coordinates[0] => {
                            let rows = at.values.iter().filter_map(|&position| row(&found, position));
                            profiles.extend(rows.map(|row| (file.clone(), row)));
                        }
                        Some(_) => {}
                        None => images.push(found),
                    }
                }
            }
        }
    }
    let picture = match (profiles.as_slice(), images.as_slice()) {
        ([], [image]) => image_of(image, request, medium),
        ([], []) => {
            let text = "no array or matrix of numbers in these topics; choose others with --topic";
            Err(PlotError::Nothing(text.into()))
        }
        ([], _) => Err(PlotError::Nothing("one image at a time: give one time and one topic".into())),
        (profiles, _) => {
            let panel = profiles_panel(profiles, request, title);
            draw(&[panel], medium).map_err(PlotError::Draw)
        }
    };
    Ok(Drawn { picture: picture?, damages })
}

fn image_of(image: &Slice, request: &Request, medium: Medium) -> Result<Vec<u8>, PlotError> {
    draw_image(&image.image(), request.range, medium).map_err(PlotError::Draw)
}

fn profiles_panel(profiles: &[(String, Profile)], request: &Request, title: &str) -> Panel {
    let names: BTreeSet<&str> = profiles.iter().map(|(_, profile)| profile.name.as_str()).collect();
    let curve = |(file, profile): &(String, Profile)| {
        let field = if names.len() > 1 { format!("{}, ", profile.name) } else { String::new() };
        Curve {
            name: format!("{file}{field}time {:.6}", Round(profile.time)),
            points: profile.points.clone(),
            dashed: false,
            colour: None,
        }
    };
    let headings: Vec<Heading> = profiles.iter().map(|(_, profile)| profile.heading()).collect();
    let x = profiles.first().map(|(_, profile)| profile.axis_heading().with_unit());
    Panel {
        title: title.into(),
        x_label: x.unwrap_or_default(),
        y_label: common_label(&headings),
        curves: profiles.iter().map(curve).collect(),
        log_x: request.log.0,
        log_y: request.log.1,
        x_range: request.x_range,
        y_range: request.range,
    }
}

/// A number to six digits, without the zeros at the end.
struct Round(f64);

impl std::fmt::Display for Round {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let text = format!("{:.6}", self.0);
        f.write_str(if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text })
    }
}
