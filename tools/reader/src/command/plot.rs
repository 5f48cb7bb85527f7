//! `plot`: fields against time, arrays over their axis at chosen times, matrices as images.

use std::{collections::BTreeSet, io, path::PathBuf};

use percuss_picture::{Curve, Medium, Panel, draw, draw_image};

use crate::{
    axis::Axis,
    channel::Channel,
    command::trace::{Align, Outcome, Request as Traced, TraceError, names, trace},
    convention,
    extent::{Extent, Extents},
    field::{Positions, Selection, SelectionError},
    messages::Recording,
    recording::{Budget, Damage, Limits, OpenError},
    select::{self, Pattern, UnknownTopic, Window},
    slice::{Moment, MomentError, Profile, Slice, moments, profile, slice},
    table::{Cell, Heading, Sink},
    wire::{COUNT, UNKNOWN},
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
    let title = request.title.clone().unwrap_or_else(|| names(paths).join(", "));
    if let Some(times) = &request.at_times {
        return at_times(paths, request, times, &title, limits, medium);
    }
    if shows_last_frame(paths, request, limits)? {
        if request.window.from.is_some() || request.window.to.is_some() || request.window.every > 1 {
            let text = "--from, --to and --every choose times of curves; choose a frame with --at-time";
            return Err(PlotError::Unfit(text.into()));
        }
        return at_times(paths, request, &[], &title, limits, medium);
    }
    let (mut panel, outcome) = traces(paths, request, limits)?;
    panel.title = title;
    let picture = draw(&[panel], medium).map_err(PlotError::Draw)?;
    let Outcome { damages, undecoded, left_out, .. } = outcome;
    Ok(Drawn { picture, damages, undecoded, left_out })
}

/// Takes a table as curves.
struct Curves {
    headings: Vec<Heading>,
    curves: Vec<Curve>,
    budget: Budget,
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
                // a list grows to twice its length
                if !self.budget.spend(2 * size_of::<(f64, f64)>()) {
                    return Err(io::Error::new(
                        io::ErrorKind::OutOfMemory,
                        "the curves have more points than --max-memory allows; choose fields or times, or draw every n-th \
                         point (--every)",
                    ));
                }
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
) -> Result<(Panel, Outcome), PlotError> {
    let traced = Traced {
        topics: request.topics.clone(),
        selection: request.selection.clone(),
        window: request.window,
        align: Align::Exact,
        stack: false,
        follow: false,
    };
    let budget = Budget::new(limits.kept());
    let mut table = Curves { headings: Vec::new(), curves: Vec::new(), budget };
    let outcome = trace(paths, &traced, limits, &mut table)?;
    let all_chosen = request.selection.fields.is_empty();
    let is_counter = |heading: &Heading| {
        let name = heading.name.rsplit([':', '.']).next().unwrap_or_default();
        all_chosen && matches!(name, convention::STEP | "log_time")
    };
    let (mut curves, mut headings) = (Vec::new(), Vec::new());
    for (curve, heading) in table.curves.into_iter().zip(&table.headings[1.min(table.headings.len())..]) {
        if !is_counter(heading) && !curve.points.is_empty() {
            curves.push(curve);
            headings.push(heading.clone());
        }
    }
    if curves.is_empty() {
        let left_out: Vec<String> = outcome.left_out.iter().map(|error| format!("; {error}")).collect();
        let text = format!("no field of these topics holds numbers in this time{}", left_out.concat());
        return Err(PlotError::Nothing(text));
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
    Ok((panel, outcome))
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

/// True if what is asked for is a matrix, whole or along lines, without a time: that of the last message is drawn.
fn shows_last_frame(paths: &[PathBuf], request: &Request, limits: Limits) -> Result<bool, PlotError> {
    let Some(path) = paths.first().filter(|_| !request.topics.is_empty()) else { return Ok(false) };
    let recording = Recording::open(path, limits)?;
    let ids = select::channels(&recording, &request.topics)?;
    let [id] = ids.as_slice() else { return Ok(false) };
    let channel = &recording.channels[id];
    let Some(layout) = &channel.layout else { return Ok(false) };
    let is_wanted = |leaf: &usize| {
        let fields = &request.selection.fields;
        fields.is_empty() || fields.contains(&layout.leaves[*leaf].path)
    };
    let axes = (0..layout.leaves.len()).filter(is_wanted).map(|leaf| Axis::of(leaf, layout, channel));
    let matrix = axes.into_iter().find(|axis| matches!(axis, Axis::Matrix { .. }));
    let at = &request.selection.at;
    let Some(axis) = matrix else { return Ok(false) };
    let lines = at.iter().filter(|at| at.are_lines(&axis)).count();
    if lines > 0 && lines < at.len() {
        let text = "points and lines do not go into one picture: give both coordinates to each --at for curves over \
                    time, or one for lines at one time";
        return Err(PlotError::Unfit(text.into()));
    }
    Ok(if at.is_empty() { paths.len() == 1 } else { lines > 0 })
}

/// Profiles and images at some times, as they are found.
#[derive(Default)]
struct Found {
    profiles: Vec<(String, Profile)>,
    images: Vec<Slice>,
    /// Which fields and positions of the selection have been of use.
    fields: BTreeSet<usize>,
    at: BTreeSet<usize>,
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
    let default = [convention::INTERFACE.parse().expect("a plain topic")];
    let topics = if request.topics.is_empty() { &default[..] } else { &request.topics };
    let (mut found, mut damages) = (Found::default(), Vec::new());
    for (path, name) in paths.iter().zip(names(paths)) {
        let file = if paths.len() > 1 { format!("{name}: ") } else { String::new() };
        let recording = Recording::open(path, limits)?;
        let ids = select::channels(&recording, topics)?;
        for &id in &ids {
            if !holds_arrays(&recording.channels[&id]) {
                continue;
            }
            let (moments, damaged) = moments(&recording, id, times)?;
            damages.extend(damaged.into_iter().map(|damage| (path.clone(), damage)));
            found.take(&file, &recording, id, &moments, request)?;
        }
        let channels: Vec<&Channel> = ids.iter().map(|id| &recording.channels[id]).collect();
        found.check(&channels, &request.selection)?;
    }
    let coordinates: BTreeSet<_> = found.profiles.iter().map(|(_, profile)| &profile.coordinate).collect();
    if coordinates.len() > 1 {
        let names: Vec<&str> = coordinates.into_iter().map(String::as_str).collect();
        let text =
            format!("profiles over {} have no axis in common; draw them one by one", names.join(" and "));
        return Err(PlotError::Unfit(text));
    }
    let picture = match (found.profiles.as_slice(), found.images.as_slice()) {
        ([], [image]) => image_of(image, request, medium),
        ([], []) => {
            let text = "no array or matrix of numbers in these topics; choose others with --topic";
            Err(PlotError::Nothing(text.into()))
        }
        ([], _) => Err(PlotError::Unfit("one image at a time: give one time and one topic".into())),
        (profiles, []) => {
            let panel = profiles_panel(profiles, request, title);
            draw(&[panel], medium).map_err(PlotError::Draw)
        }
        (_, [image, ..]) => Err(PlotError::Unfit(format!(
            "profiles and the image of `{}` do not go into one picture; draw them one by one",
            image.topic
        ))),
    };
    Ok(Drawn { picture: picture?, damages, undecoded: 0, left_out: Vec::new() })
}

/// True if a channel has something that can be drawn at one time.
fn holds_arrays(channel: &Channel) -> bool {
    let mut leaves = channel.layout.iter().flat_map(|layout| &layout.leaves);
    leaves.any(|leaf| leaf.lists > 0 && leaf.kind.is_number() && !leaf.path.ends_with(COUNT))
}

impl Found {
    /// The fields of a channel at some times.
    fn take(
        &mut self,
        file: &str,
        recording: &Recording,
        id: u16,
        moments: &[Moment],
        request: &Request,
    ) -> Result<(), PlotError> {
        let channel = &recording.channels[&id];
        let Some(layout) = &channel.layout else { return Ok(()) };
        let selection = &request.selection;
        let mut leaves = Vec::new();
        for (leaf, field) in layout.leaves.iter().enumerate() {
            let is_data = field.path != UNKNOWN && !field.path.ends_with(COUNT);
            let chosen = selection.fields.iter().position(|name| *name == field.path);
            self.fields.extend(chosen);
            if is_data && (selection.fields.is_empty() || chosen.is_some()) {
                leaves.push(leaf);
            }
        }
        let is_matrix = |&leaf: &usize| matches!(Axis::of(leaf, layout, channel), Axis::Matrix { .. });
        // other frames may reach farther
        let extents = match leaves.iter().any(is_matrix) {
            true => Extents::read(recording, &[id])?,
            false => Extents::default(),
        };
        for (moment, &leaf) in moments.iter().flat_map(|moment| leaves.iter().map(move |leaf| (moment, leaf)))
        {
            let axis = Axis::of(leaf, layout, channel);
            let at: Vec<(usize, &Positions)> =
                selection.at.iter().enumerate().filter(|(_, at)| at.fit(&axis)).collect();
            self.at.extend(at.iter().map(|(i, _)| i));
            if let Some((_, at)) = at.iter().find(|(_, at)| !at.are_lines(&axis)) {
                let text = format!(
                    "`{}` at {at} and one time is a number; leave out --at-time for curves over time, or --at for \
                     the array",
                    layout.leaves[leaf].path
                );
                return Err(PlotError::Unfit(text));
            }
            if let Some(profile) = profile(channel, leaf, moment) {
                self.profiles.push((file.to_owned(), profile));
            } else if let Some(slice) = slice(channel, leaf, moment) {
                let extent = extents.of(id, leaf);
                let slice = slice.whole(&extent, recording.limits()).ok_or_else(too_large)?;
                if selection.at.is_empty() {
                    self.images.push(slice);
                    continue;
                }
                for (_, at) in at {
                    let lines = lines(&slice, at, &extent)?;
                    self.profiles.extend(lines.into_iter().map(|line| (file.to_owned(), line)));
                }
            } else if is_matrix(&leaf) {
                let (topic, time) = (&channel.topic, moment.time);
                let text =
                    format!("`{topic}` at time {time} has not as many elements as its rows and columns say");
                return Err(PlotError::Unfit(text));
            }
        }
        Ok(())
    }

    /// Refuses what none of the channels of a file has.
    fn check(&self, channels: &[&Channel], selection: &Selection) -> Result<(), SelectionError> {
        let unused = |used: &BTreeSet<usize>, count: usize| (0..count).find(|i| !used.contains(i));
        if let (Some(i), Some(channel)) = (unused(&self.fields, selection.fields.len()), channels.first()) {
            return Err(SelectionError::unknown_field(channel, &selection.fields[i]));
        }
        match unused(&self.at, selection.at.len()) {
            Some(i) => Err(SelectionError::no_axis(channels, &selection.at[i])),
            None => Ok(()),
        }
    }
}

fn too_large() -> PlotError {
    PlotError::Unfit("the matrix with all its rows and columns is larger than --max-memory allows".into())
}

/// A matrix along lines at the positions of one of its coordinates.
fn lines(slice: &Slice, at: &Positions, extent: &Extent) -> Result<Vec<Profile>, SelectionError> {
    let mut lines = Vec::new();
    for (name, positions) in &at.coordinates {
        let along = slice.coordinates.iter().position(|known| known == name);
        if let Some(reach) = along.and_then(|along| extent.reaches.get(along)) {
            SelectionError::check(reach, &slice.topic, &slice.name, name, positions)?;
        }
        lines.extend(positions.iter().filter_map(|&position| slice.line(name, position)));
    }
    Ok(lines)
}

fn image_of(image: &Slice, request: &Request, medium: Medium) -> Result<Vec<u8>, PlotError> {
    if request.log != (false, false) || request.x_range.is_some() {
        return Err(PlotError::Unfit("--log and --x-range are for curves, not for an image".into()));
    }
    let mut image = image.image();
    if let Some(title) = &request.title {
        image.title.clone_from(title);
    }
    draw_image(&image, request.range, medium).map_err(PlotError::Draw)
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
