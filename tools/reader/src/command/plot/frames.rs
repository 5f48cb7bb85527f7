//! Arrays over their axis, and matrices as images, at some times.

use std::{collections::BTreeSet, path::PathBuf};

use percuss_picture::{Curve, Image, Medium, Panel, draw, draw_image};

use super::{
    Drawn, Request,
    axes::{Line, cut, labelled, panel, part, time_label, visible},
};
use crate::{
    axis::Axis,
    channel::Channel,
    command::trace::names,
    extent::{Extent, Extents},
    failure::Failure,
    field::{Positions, Selection, SelectionError},
    messages::Recording,
    pass::Moment,
    recording::Limits,
    select::Bound,
    slice::{Profile, Slice, mismatch, moments, profile, slice},
    units::Units,
    verb::Losses,
};

struct Frames {
    profiles: Vec<Named>,
    images: Vec<(Slice, String)>,
    /// What of the selection no channel has had yet.
    unused: Selection,
}

/// A profile, its file if there are several, and its time in words.
struct Named {
    file: String,
    time: String,
    profile: Profile,
}

/// Profiles, or an image, at some times.
pub(super) fn at_times(
    paths: &[PathBuf],
    request: &Request,
    times: &[Bound],
    title: &str,
    limits: Limits,
    medium: Medium,
) -> Result<Drawn, Failure> {
    let unused = request.selection.clone();
    let mut frames = Frames { profiles: Vec::new(), images: Vec::new(), unused };
    let mut losses = Losses::default();
    for (path, name) in paths.iter().zip(names(paths)) {
        let file = if paths.len() > 1 { format!("{name}: ") } else { String::new() };
        let (recording, ids) = request.open_arrays(path, limits)?;
        for &id in ids.iter().filter(|id| holds_arrays(&recording.channels[id])) {
            // other frames may reach farther
            let holds_matrix = Axis::matrices(&recording.channels[&id]).next().is_some();
            let (moments, extents, damaged) = moments(&recording, id, times, holds_matrix)?;
            losses.damages.extend(damaged.into_iter().map(|damage| (path.clone(), damage)));
            frames.take(&file, &recording, id, (&moments, &extents), request)?;
        }
        let channels: Vec<&Channel> = ids.iter().map(|id| &recording.channels[id]).collect();
        frames.unused.refuse_rest(&channels)?;
    }
    let (picture, remark) = frames.draw(request, title, medium)?;
    Ok(Drawn { picture, losses, notes: remark.into_iter().collect() })
}

/// True if a channel has something that can be drawn at one time.
fn holds_arrays(channel: &Channel) -> bool {
    let mut leaves = channel.layout.iter().flat_map(|layout| &layout.leaves);
    leaves.any(|leaf| leaf.lists > 0 && leaf.kind.is_number() && leaf.is_data())
}

impl Frames {
    fn take(
        &mut self,
        file: &str,
        recording: &Recording,
        id: u16,
        (moments, extents): (&[Moment], &Extents),
        request: &Request,
    ) -> Result<(), Failure> {
        let channel = &recording.channels[&id];
        let Some(layout) = &channel.layout else { return Ok(()) };
        let selection = &request.selection;
        let (mut leaves, hidden) = (Vec::new(), channel.axis_parts());
        for (leaf, field) in layout.leaves.iter().enumerate() {
            self.unused.fields.retain(|name| *name != field.path);
            let is_shown = match selection.fields.as_slice() {
                [] => !hidden.contains(field.path.as_str()),
                names => names.contains(&field.path),
            };
            if field.is_data() && is_shown {
                leaves.push((leaf, Axis::of(leaf, layout, channel)));
            }
        }
        for moment in moments {
            for (leaf, axis) in &leaves {
                let fitting: Vec<&Positions> = selection.at.iter().filter(|at| at.fit(axis)).collect();
                self.unused.at.retain(|at| !fitting.contains(&at));
                fitting.iter().try_for_each(|at| at.check_units(channel))?;
                if let Some(at) = fitting.iter().find(|at| !at.are_lines(axis)) {
                    let path = &layout.leaves[*leaf].path;
                    return Err(Failure::Usage(format!(
                        "`{path}` at {at} and one time is a number; leave out --at-time for curves over time, or --at \
                         for the array"
                    )));
                }
                let mismatch = || Failure::Usage(mismatch(channel, *leaf, moment));
                if axis.flaw(*leaf, &moment.values).is_some() {
                    return Err(mismatch());
                }
                if let Some(profile) = profile(channel, *leaf, moment) {
                    self.profiles.push(Named::new(file, channel, profile, &request.units));
                } else if axis.is_matrix() {
                    let slice = slice(channel, *leaf, moment).ok_or_else(mismatch)?;
                    let extent = extents.get(id, *leaf);
                    let slice = slice.whole(&extent, recording.limits()).ok_or_else(too_large)?;
                    let layers = recording.layers(&slice.axes[0].name);
                    let slice = Slice { layers, ..slice };
                    for at in &fitting {
                        let lines = lines(&slice, at, &extent)?.into_iter();
                        let named = lines.map(|line| Named::new(file, channel, line, &request.units));
                        self.profiles.extend(named);
                    }
                    if fitting.is_empty() {
                        let time = time_label(slice.time, channel.time_unit(), &request.units);
                        self.images.push((slice, time));
                    }
                }
            }
        }
        Ok(())
    }

    fn draw(
        &self,
        request: &Request,
        title: &str,
        medium: Medium,
    ) -> Result<(Vec<u8>, Option<String>), Failure> {
        let coordinates: BTreeSet<_> = self.profiles.iter().map(|named| &named.profile.axis.name).collect();
        if coordinates.len() > 1 {
            let names: Vec<&str> = coordinates.into_iter().map(String::as_str).collect();
            let text =
                format!("profiles over {} have no axis in common; draw them one by one", names.join(" and "));
            return Err(Failure::Usage(text));
        }
        match (self.profiles.as_slice(), self.images.as_slice()) {
            ([], [(image, time)]) => image_of(image, time, request, medium),
            ([], []) => {
                let text = "no array or matrix of numbers in these topics; choose others with --topic";
                Err(Failure::nothing(text))
            }
            ([], _) => Err(Failure::Usage("one image at a time: give one time and one topic".into())),
            (profiles, []) => {
                request.check_curves()?;
                let panel = profiles_panel(profiles, request);
                let picture = draw(&[Panel { title: title.into(), ..panel }], medium);
                Ok((picture.map_err(Failure::drawing)?, None))
            }
            (_, [(image, _), ..]) => Err(Failure::Usage(format!(
                "profiles and the image of `{}` do not go into one picture; draw them one by one",
                image.topic
            ))),
        }
    }
}

pub(super) fn too_large() -> Failure {
    Failure::Usage("the matrix with all its rows and columns is larger than --max-memory allows".into())
}

/// A matrix along lines at the positions of one of its coordinates.
fn lines(slice: &Slice, at: &Positions, extent: &Extent) -> Result<Vec<Profile>, SelectionError> {
    let mut lines = Vec::new();
    for (name, positions) in &at.coordinates {
        let along = slice.axes.iter().position(|axis| axis.name == *name);
        if let Some(reach) = along.and_then(|along| extent.reaches.get(along)) {
            SelectionError::check(reach, &slice.topic, &slice.name, name, positions)?;
        }
        lines.extend(positions.iter().filter_map(|&position| slice.line(name, position)));
    }
    Ok(lines)
}

fn image_of(
    slice: &Slice,
    time: &str,
    request: &Request,
    medium: Medium,
) -> Result<(Vec<u8>, Option<String>), Failure> {
    if request.log != (false, false) {
        return Err(Failure::Usage("--log is for curves, not for an image".into()));
    }
    let title = request.title.clone().unwrap_or_else(|| format!("{} at {time}", slice.topic));
    let [rows, columns] = slice.axes.clone();
    let quantities = [rows, columns, slice.heading()];
    let image = slice.image();
    let is_chosen = request.x_range.is_some() || request.y_range.is_some();
    let (image, is_cut) = match visible(&image, request.range).filter(|_| !is_chosen) {
        Some(seen) => (part(image, seen), true),
        None => (cut(image, request.x_range, request.y_range)?, false),
    };
    let remark = "drawn where something can be seen; --x-range and --y-range draw another part";
    let remark = is_cut.then(|| remark.to_owned());
    let (image, range) = labelled(Image { title, ..image }, &quantities, request);
    Ok((draw_image(&image, range, medium).map_err(Failure::drawing)?, remark))
}

impl Named {
    fn new(file: &str, channel: &Channel, profile: Profile, units: &Units) -> Self {
        Self { file: file.to_owned(), time: time_label(profile.time, channel.time_unit(), units), profile }
    }
}

fn profiles_panel(profiles: &[Named], request: &Request) -> Panel {
    let names: BTreeSet<&str> = profiles.iter().map(|named| named.profile.field.name.as_str()).collect();
    let line = |Named { file, time, profile }: &Named| {
        let field = if names.len() > 1 { format!("{}, ", profile.field.name) } else { String::new() };
        let curve = Curve {
            name: format!("{file}{field}{time}"),
            points: profile.points.clone(),
            ..Curve::default()
        };
        Line { curve, heading: profile.field.clone() }
    };
    let x = profiles.first().map(|named| named.profile.axis.clone()).unwrap_or_default();
    panel(&x, profiles.iter().map(line).collect(), Vec::new(), request)
}
