//! `animate`: the section, the profile of the interface stress and the drag of a recording, moving side by side on fixed scales.
//!
//! The scales come from a first reading of the whole recording: the colours are those of the viewers, if it has them, the section is
//! the part of it in which anything is seen in any frame.

use std::{
    cell::RefCell,
    collections::{BTreeSet, VecDeque},
    fs,
    io::{self, IsTerminal, Write as _},
    ops::Range,
    path::PathBuf,
    process::{Child, Command, Stdio},
};

use clap::Args;
use percuss_output::number::whole;
use percuss_picture::{Colours, Diagram, Film, Image, Moment as Shown, Raster, Section, Side, Stage};
use percuss_table::Heading;

use crate::{
    axis::Axis,
    command::{
        report::body::{Body, Outline},
        view::{Bounds, Curve, Points, downsampled, find, find_leaf, main_field, prefixed, thinned},
    },
    convention::{self, DISPLACEMENT, DRAG, INTERFACE, RADIUS, VELOCITY},
    failure::Failure,
    messages::Recording,
    pass::{Moment, Pass},
    prefix::short,
    recording::{Budget, Damage, Limits},
    select::{self, Bound, Pattern, Window},
    slice::{Profile, Slice, profile, slice},
    units::Units,
    verb::{Exit, Verb, Write, by_extension, loss, say},
};

const ANIMATE_EXAMPLES: &str = "\
Examples:
  percuss-read animate ball.mcap -o ball.gif
  percuss-read animate ball.mcap -o ball.mp4 --fps 30 --width 1920
  percuss-read animate fig5.mcap --from 1 --to 3 --range 1.5 -o fig5.gif

All frames have the same scales. The section is shown as far as it moves. MP4 needs ffmpeg on the PATH.";

/// Section, profile and drag as a moving picture: GIF, MP4
#[derive(Debug, Args)]
#[command(after_help = ANIMATE_EXAMPLES)]
#[command(mut_arg("output", |film| film.help("Output: .gif or .mp4").required(true)))]
pub struct Animate {
    /// Recording
    pub(crate) file: PathBuf,
    /// Topic of the section, a field with two axes [default: /field/stress, else the first field]
    #[arg(long, value_name = "TOPIC")]
    topic: Option<Pattern>,
    /// First time, in the unit that is recorded or with one, 32us
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    from: Option<Bound>,
    /// Last time, like the first
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    to: Option<Bound>,
    /// Frames at most, evenly over what is recorded
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = whole(2_u32..=10_000))]
    frames: u32,
    /// Frames a second
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = whole(1_u16..=50))]
    fps: u16,
    /// Width of the picture, in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 960, value_parser = whole(320_u32..=3840))]
    width: u32,
    /// The colours end at this value and its negative, in the unit of the recording [default: as in viewers]
    #[arg(long, value_name = "X", value_parser = positive)]
    range: Option<f64>,
    #[command(flatten)]
    units: Units,
    #[command(flatten)]
    write: Write,
}

impl Verb for Animate {
    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        self.write.refuse_inputs([&self.file])?;
        let output = self.write.named()?;
        let is_gif = by_extension(output, &[("gif", true), ("mp4", false)], None)?;
        self.write.refuse_existing()?;
        let animation = Animation::new(self, limits)?;
        let (frames, size) = (animation.frames.len(), animation.film.size());
        let (mut bytes, mut count, is_counted) = (Vec::new(), 0, io::stderr().is_terminal());
        let mut count = || {
            count += 1;
            if is_counted {
                eprint!("\rframe {count} of {frames}{}", if count == frames { "\n" } else { "" });
            }
        };
        let damages = if is_gif {
            // a hundredth of a second is the unit
            let delay = (100 + self.fps / 2) / self.fps;
            let mut moving = percuss_picture::Moving::new(&mut bytes, size, delay).map_err(unwritten)?;
            let damages = animation.draw(|raster| {
                count();
                moving.add(&raster)
            })?;
            moving.finish().map_err(unwritten)?;
            damages
        } else {
            let film = Mp4::begin(size, self.fps)?;
            let mut input = film.child.stdin.as_ref();
            let drawn = animation.draw(|raster| {
                count();
                let written = input.as_mut().map_or(Ok(()), |input| input.write_all(&raster.rgba));
                written.map_err(|error| error.to_string())
            });
            // a codec that fails says more than a pipe that is closed
            bytes = film.finish()?;
            drawn?
        };
        self.write.whole(&bytes)?;
        let size = bytes.len() as f64 * 1e-6;
        say(&format!("{}: {frames} frames, {size:.1} MB", output.display()));
        Ok(loss(&self.file, &damages))
    }
}

fn unwritten(why: String) -> Failure {
    Failure::Failed(format!("cannot write the film: {why}"))
}

/// A film that ffmpeg writes, into a file of its own until it is whole.
struct Mp4 {
    child: Child,
    folder: tempfile::TempDir,
}

impl Mp4 {
    fn begin((width, height): (u32, u32), fps: u16) -> Result<Self, Failure> {
        let failed = |error: io::Error| unwritten(error.to_string());
        let folder = tempfile::tempdir().map_err(failed)?;
        let (size, rate) = (format!("{width}x{height}"), fps.to_string());
        let child = Command::new("ffmpeg")
            .args(["-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgba"])
            .args(["-s", &size, "-r", &rate, "-i", "-"])
            .args(["-pix_fmt", "yuv420p", "-fflags", "+bitexact", "-flags:v", "+bitexact"])
            .args(["-movflags", "+faststart"])
            .arg(folder.path().join("film.mp4"))
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn();
        match child {
            Ok(child) => Ok(Self { child, folder }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let text = "MP4 needs ffmpeg, which is not on the PATH; install it, or write a .gif";
                Err(Failure::Usage(text.into()))
            }
            Err(error) => Err(failed(error)),
        }
    }

    fn finish(self) -> Result<Vec<u8>, Failure> {
        let failed = |error: io::Error| unwritten(error.to_string());
        // closes its input, which ends the film
        let done = self.child.wait_with_output().map_err(failed)?;
        if !done.status.success() {
            let text = String::from_utf8_lossy(&done.stderr).trim().to_owned();
            return Err(unwritten(format!("ffmpeg: {text}")));
        }
        fs::read(self.folder.path().join("film.mp4")).map_err(failed)
    }
}

/// A finite number above 0.
fn positive(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    if number > 0.0 && number.is_finite() { Ok(number) } else { Err(format!("`{text}` is not above 0")) }
}

/// Points of a profile in a frame, about.
const PROFILE_POINTS: usize = 500;
/// Share of a profile that its axis shows: a stress that is infinite at an edge would flatten all else.
const SHOWN: f64 = 0.97;
/// Room above the largest number of an axis, relative to it.
const ROOM: f64 = 1.06;
/// Room for a body above the section, relative to the depth of the section.
const HEADROOM: f64 = 0.4;

/// Depth of a body in the section, at most, relative to the depth of the section.
const DEEPEST: f64 = 0.02;

/// A section that moves: its channel, and what it is drawn with.
struct Moving {
    leaf: usize,
    /// Rows and columns that are shown.
    part: [Range<usize>; 2],
    section: Section,
    /// How deep the body is drawn at most: in the linear theory a displacement may be any multiple of what is small.
    deepest: f64,
    /// True if the indenter has a field, and is not drawn over it.
    gives: bool,
    /// Factors of lengths and values.
    factors: [f64; 2],
}

struct Animation {
    recording: Recording,
    /// Channel whose messages are the frames.
    clock: u16,
    moving: Option<Moving>,
    /// Channel and leaf of the profiles, and how they are drawn.
    profile: Option<(u16, usize, ProfileScale)>,
    film: Film,
    frames: Vec<Frame>,
    body: Body,
    drag: Curve,
    /// Factors of times and lengths.
    factors: [f64; 2],
    damages: Vec<Damage>,
}

struct Frame {
    time: f64,
    /// Among the messages of its channel.
    number: u64,
    label: String,
}

impl Animation {
    /// Reads a recording once for its scales.
    fn new(request: &Animate, limits: Limits) -> Result<Self, Failure> {
        let path = &request.file;
        let recording = Recording::open(path, limits)?;
        let mut damages = recording.damages.clone();
        let field = field(&recording, request)?;
        let clock = field.map(|(id, _)| id).or_else(|| find(&recording, |topic| topic == INTERFACE));
        let clock = clock.ok_or_else(|| {
            let what = "it has no field and no profile; choose a field with two axes with --topic";
            Failure::Usage(format!("nothing to animate in `{}`: {what}", path.display()))
        })?;
        let channel = &recording.channels[&clock];
        let window = Window { from: request.from, to: request.to, every: 1 };
        window.check(channel)?;
        let mut bounds = Bounds::default();
        let mut times = Vec::new();
        let mut force = Points::of(&recording, DRAG, &["force", RADIUS]);
        let mut motion = Points::of(&recording, VELOCITY, &[DISPLACEMENT]);
        let mut outline = Outline::default();
        let mut scale = Scale::default();
        let mut pass = Pass::over(&recording, Window::default());
        pass.each(clock, |moment, budget| {
            if !holds(window, moment.time) {
                return Ok(());
            }
            if let Some((_, leaf)) = field {
                let Some(slice) = slice(channel, leaf, moment) else { return Ok(()) };
                bounds.take(slice);
            }
            // a list grows to twice its length
            if !budget.spend(2 * size_of::<(f64, u64)>()) {
                return Err(recording.no_room("the times of the frames"));
            }
            times.push((moment.time, moment.number));
            Ok(())
        });
        let surface = find_leaf(&recording, INTERFACE, "stress");
        if let Some((id, leaf)) = surface {
            let (channel, scale) = (&recording.channels[&id], &mut scale);
            pass.each(id, move |moment, _| {
                if holds(window, moment.time)
                    && let Some(profile) = profile(channel, leaf, moment)
                {
                    scale.take(profile);
                }
                Ok(())
            });
        }
        force.watch(&recording, &mut pass);
        motion.watch(&recording, &mut pass);
        outline.watch(&recording, &mut pass);
        damages.extend(pass.run()?.damages);
        times.sort_by(|a, b| a.0.total_cmp(&b.0));
        times.dedup_by_key(|(time, _)| *time);
        let mut chosen = evenly(&times, request.frames as usize);
        let (Some(&(first, _)), Some(&(last, _))) = (chosen.first(), chosen.last()) else {
            return Err(Failure::Usage(format!("`{}` has no frames in this time", channel.topic)));
        };
        // as they stand in the file
        chosen.sort_by_key(|(_, number)| *number);
        let times: Vec<f64> = chosen.iter().map(|(time, _)| *time).collect();
        let depths = motion.curve(DISPLACEMENT);
        let body = outline.body(depths, force.curve(RADIUS), &times);
        let time = Heading::new(channel.time_name(), channel.time_unit());
        let (time, per_time) = prefixed(&time, last.abs(), &request.units);
        let unit = time.unit.as_deref().unwrap_or_default();
        let label = |at: f64| format!("t = {}", format!("{} {unit}", short(at * per_time)).trim_end());
        let frames =
            chosen.iter().map(|&(time, number)| Frame { time, number, label: label(time) }).collect();
        let moving = match field {
            Some(field) => Moving::of(&recording, field, &mut bounds, &body, request)?,
            None => None,
        };
        let profile = surface.zip(scale.scaled(request)).map(|((id, leaf), scale)| (id, leaf, scale));
        let points = force.curve("force").iter().filter(|(time, _)| holds(window, *time));
        let points: Curve = points.copied().collect();
        let force = find(&recording, |topic| topic == DRAG)
            .map(|id| Heading::new("drag", recording.channels[&id].unit("force")));
        let span = (first * per_time, last * per_time);
        let (drag, points) = drag(&points, &force.unwrap_or_default(), (&time, per_time), span, request);
        let run = recording.entries(convention::RUN);
        let title = run.and_then(|run| run.get("title")).cloned();
        let stage = Stage {
            title: title
                .unwrap_or_else(|| path.file_name().unwrap_or_default().to_string_lossy().into_owned()),
            section: moving.as_ref().map(|moving| moving.section.clone()),
            diagrams: profile.iter().map(|(.., scale)| scale.diagram.clone()).chain(drag).collect(),
            width: request.width,
        };
        let film = Film::new(&stage).map_err(Failure::drawing)?;
        let per_length = profile.as_ref().map_or(1.0, |(.., scale)| scale.factors[0]);
        let per_length = moving.as_ref().map_or(per_length, |moving| moving.factors[0]);
        let factors = [per_time, per_length];
        Ok(Self { recording, clock, moving, profile, film, frames, body, drag: points, factors, damages })
    }

    /// Draws the frames one after the other; answers what of the recording is damaged.
    fn draw(&self, take: impl FnMut(Raster) -> Result<(), String>) -> Result<Vec<Damage>, Failure> {
        let drawing = Drawing { animation: self, take, next: 0, waiting: VecDeque::new(), latest: None };
        let drawing = RefCell::new(drawing);
        let mut pass = Pass::over(&self.recording, Window::default());
        let numbers: BTreeSet<u64> = self.frames.iter().map(|frame| frame.number).collect();
        if let Some((id, leaf, scale)) = &self.profile {
            let channel = &self.recording.channels[id];
            let take = |moment: &Moment, _: &mut Budget| {
                let Some(profile) = profile(channel, *leaf, moment) else { return Ok(()) };
                drawing.borrow_mut().profile(moment.time, scale.points(profile))
            };
            // before the frame of the same message
            if *id == self.clock { pass.numbers(*id, numbers.clone(), take) } else { pass.each(*id, take) }
        }
        let channel = &self.recording.channels[&self.clock];
        pass.numbers(self.clock, numbers, |moment, _| {
            let values = match &self.moving {
                Some(moving) => slice(channel, moving.leaf, moment).map(|slice| moving.values(&slice)),
                None => Some(Vec::new()),
            };
            values.map_or(Ok(()), |values| drawing.borrow_mut().section(values))
        });
        let damages = pass.run()?.damages;
        drawing.borrow_mut().draw_down_to(0)?;
        Ok([self.damages.as_slice(), &damages].concat())
    }

    fn frame(
        &self,
        i: usize,
        values: &[f64],
        profile: Option<&Curve>,
        take: &mut impl FnMut(Raster) -> Result<(), String>,
    ) -> Result<(), Failure> {
        let [per_time, per_length] = self.factors;
        let now = self.frames[i].time * per_time;
        let gives = self.moving.as_ref().is_some_and(|moving| moving.gives);
        let depth = self.body.depths.get(i).filter(|depth| depth.is_finite() && !gives);
        let deepest = self.moving.as_ref().map_or(0.0, |moving| moving.deepest);
        let contact = self.body.radii.get(i).copied().unwrap_or(0.0) * per_length;
        let passed = self.drag.partition_point(|(time, _)| *time <= now);
        let drag = (!self.drag.is_empty()).then(|| self.drag[..passed].to_vec());
        let profile = self.profile.as_ref().map(|_| profile.cloned().unwrap_or_default());
        let curves: Vec<Curve> = profile.into_iter().chain(drag).collect();
        let depth = depth.map(|depth| (depth * per_length).min(deepest));
        let shown = Shown { time: &self.frames[i].label, values, depth, contact, curves: &curves };
        take(self.film.frame(&shown)).map_err(unwritten)
    }
}

/// Sections that wait for the next profile, at most.
const WAITING: usize = 4;

/// Frames that are being drawn: each has the profile nearest to it, the one before or after its section.
struct Drawing<'a, F> {
    animation: &'a Animation,
    take: F,
    next: usize,
    waiting: VecDeque<(usize, Vec<f64>)>,
    latest: Option<(f64, Curve)>,
}

impl<F: FnMut(Raster) -> Result<(), String>> Drawing<'_, F> {
    fn time(&self, i: usize) -> f64 {
        self.animation.frames[i].time
    }

    fn section(&mut self, values: Vec<f64>) -> Result<(), Failure> {
        let time = self.time(self.next);
        self.waiting.push_back((self.next, values));
        self.next += 1;
        let is_known = self.animation.profile.is_none()
            || self.latest.as_ref().is_some_and(|(latest, _)| *latest == time);
        self.draw_down_to(if is_known { 0 } else { WAITING })
    }

    fn profile(&mut self, time: f64, points: Curve) -> Result<(), Failure> {
        let before = self.latest.replace((time, points));
        while let Some(at) = self.waiting.front().map(|(i, _)| self.time(*i)).filter(|at| *at <= time) {
            let Some((i, values)) = self.waiting.pop_front() else { break };
            let nearer = before.as_ref().filter(|(before, _)| (at - before).abs() <= (time - at).abs());
            let points = nearer.or(self.latest.as_ref()).map(|(_, points)| points);
            self.animation.frame(i, &values, points, &mut self.take)?;
        }
        Ok(())
    }

    /// Draws what waits, until no more than so many do.
    fn draw_down_to(&mut self, most: usize) -> Result<(), Failure> {
        while self.waiting.len() > most
            && let Some((i, values)) = self.waiting.pop_front()
        {
            let points = self.latest.as_ref().map(|(_, points)| points);
            self.animation.frame(i, &values, points, &mut self.take)?;
        }
        Ok(())
    }
}

impl Moving {
    /// The section of a field; `None` if it never has a value.
    fn of(
        recording: &Recording,
        (id, leaf): (u16, usize),
        bounds: &mut Bounds,
        body: &Body,
        request: &Animate,
    ) -> Result<Option<Self>, Failure> {
        let channel = &recording.channels[&id];
        let range = request.range.or(recording.colour_range(&channel.topic)).or_else(|| bounds.quantile());
        let part = range.and_then(|range| bounds.part(range));
        let (Some(range), Some(frame)) = (range, bounds.largest.take()) else { return Ok(None) };
        let (value, per_value) = prefixed(&frame.heading(), range, &request.units);
        let Slice { rows, columns, axes: [row, _], .. } = frame;
        let count = |side: &Side, reach: Option<f64>| {
            let reach = reach.unwrap_or(f64::INFINITY);
            (0..side.length()).take_while(|i| side.at(*i) <= reach).count().max(2).min(side.length())
        };
        // an indenter that gives has a field too, from a negative depth on
        let gives = bounds.whole.top < 0.0;
        let top = part.map_or(f64::NEG_INFINITY, |part| part.top);
        let first = (0..rows.length()).take_while(|i| rows.at(*i) < top).count();
        let down = count(&rows, part.map(|part| part.depth));
        let part = [first.min(down - 1)..down, 0..count(&columns, part.map(|part| part.width))];
        let (rows, columns) = (rows.part(part[0].clone()), columns.part(part[1].clone()));
        let largest = |side: &Side| side.at(side.length() - 1).abs();
        let length = Heading { name: "r".into(), ..row.clone() };
        let (length, per_length) = prefixed(&length, largest(&rows).max(largest(&columns)), &request.units);
        let layers = recording.layers(&row.name).into_iter();
        let scaled = rows.scaled(per_length);
        let depth = scaled.at(scaled.length() - 1);
        let tall = body.outline.last().map_or(0.0, |[_, f]| f * per_length);
        let image = Image {
            title: channel.topic.clone(),
            value_label: value.with_unit(),
            row_label: Heading { name: row.name, ..length.clone() }.with_unit(),
            column_label: length.with_unit(),
            rows: scaled,
            columns: columns.scaled(per_length),
            is_equal: true,
            colours: Colours::Diverging,
            layers: layers.map(|layer| layer.scaled(per_length)).collect(),
            ..Image::default()
        };
        let headroom = match gives || body.outline.is_empty() {
            true => 0.0,
            false => (HEADROOM * depth).min(tall.max(0.15 * depth)),
        };
        let outline = body.outline.iter().map(|point| point.map(|length| length * per_length)).collect();
        let section = Section { image, range: range * per_value, headroom, outline };
        let (deepest, factors) = (DEEPEST * depth, [per_length, per_value]);
        Ok(Some(Self { leaf, part, section, deepest, gives, factors }))
    }

    /// The values of a frame that are shown: 0 where it has none, which is at rest.
    fn values(&self, slice: &Slice) -> Vec<f64> {
        let [rows, columns] = &self.part;
        let (height, width) = (slice.rows.length(), slice.columns.length());
        let mut values = Vec::new();
        for j in rows.clone() {
            let value = |i: usize| {
                let is_known = j < height && i < width;
                if is_known { slice.values[j * width + i] * self.factors[1] } else { 0.0 }
            };
            values.extend(columns.clone().map(value));
        }
        values
    }
}

/// Channel and leaf of the field that is asked for, else of the stress or the first field; `None` without any.
fn field(recording: &Recording, request: &Animate) -> Result<Option<(u16, usize)>, Failure> {
    if let Some(topic) = &request.topic {
        let matrix = |id: u16| Axis::matrices(&recording.channels[&id]).next().map(|leaf| (id, leaf));
        let ids = select::channels(recording, std::slice::from_ref(topic))?;
        let found = ids.into_iter().find_map(matrix);
        let none = || Failure::Usage(format!("`{}` is no field with two axes", topic.text()));
        return found.map(Some).ok_or_else(none);
    }
    Ok(main_field(recording))
}

fn holds(window: Window, time: f64) -> bool {
    let (from, to) = window.numbers();
    from.is_none_or(|from| time >= from) && to.is_none_or(|to| time <= to)
}

/// As many of some as there may be, evenly, the first and the last among them.
fn evenly<T: Copy>(all: &[T], most: usize) -> Vec<T> {
    let count = all.len().min(most);
    (0..count).map(|i| all[i * (all.len() - 1) / (count - 1).max(1)]).collect()
}

/// What profiles reach: headings of axis and stress, largest position, least and largest stress.
#[derive(Default)]
struct Scale {
    headings: Option<[Heading; 2]>,
    reach: f64,
    ends: (f64, f64),
}

struct ProfileScale {
    diagram: Diagram,
    /// Of positions and stresses.
    factors: [f64; 2],
}

impl Scale {
    fn take(&mut self, profile: Profile) {
        let points = thinned(&profile.points, PROFILE_POINTS);
        self.reach = points.iter().map(|point| point.0).fold(self.reach, f64::max);
        let (low, high) = shown(&points);
        self.ends = (self.ends.0.min(low), self.ends.1.max(high));
        self.headings = Some([profile.axis, profile.field]);
    }

    /// In the units that are chosen, else with the prefixes that fit; `None` without a profile.
    fn scaled(self, request: &Animate) -> Option<ProfileScale> {
        let [axis, stress] = self.headings?;
        let (low, high) = self.ends;
        let (axis, per_length) = prefixed(&axis, self.reach, &request.units);
        let (stress, per_stress) = prefixed(&stress, high.max(-low), &request.units);
        let diagram = Diagram {
            labels: [axis.with_unit(), stress.with_unit()],
            ends: [(0.0, self.reach * per_length * ROOM), span(low * per_stress, high * per_stress)],
            rest: Vec::new(),
        };
        Some(ProfileScale { diagram, factors: [per_length, per_stress] })
    }
}

impl ProfileScale {
    fn points(&self, profile: Profile) -> Curve {
        let [per_length, per_stress] = self.factors;
        thinned(&profile.points, PROFILE_POINTS)
            .into_iter()
            .map(|(x, y)| (x * per_length, y * per_stress))
            .collect()
    }
}

/// Smallest and largest stress of a profile but for the outermost ones.
fn shown(points: &[(f64, f64)]) -> (f64, f64) {
    let mut values: Vec<f64> = points.iter().map(|point| point.1).filter(|value| value.is_finite()).collect();
    let Some(last) = values.len().checked_sub(1) else { return (0.0, 0.0) };
    let mut at =
        |share: f64| *values.select_nth_unstable_by((last as f64 * share) as usize, f64::total_cmp).1;
    (at(1.0 - SHOWN), at(SHOWN))
}

/// Ends of an axis with some room beyond.
fn span(low: f64, high: f64) -> (f64, f64) {
    if high > low { (low * ROOM, high * ROOM) } else { (low, low + 1.0) }
}

/// The drag as it is drawn, and its diagram.
fn drag(
    points: &[(f64, f64)],
    force: &Heading,
    (time, per_time): (&Heading, f64),
    (first, last): (f64, f64),
    request: &Animate,
) -> (Option<Diagram>, Curve) {
    let mut points = downsampled(points);
    let ends =
        points.iter().map(|point| point.1).fold((0.0, 0.0), |a: (f64, f64), b| (a.0.min(b), a.1.max(b)));
    let (force, per_force) = prefixed(force, ends.1.max(-ends.0), &request.units);
    for point in &mut points {
        *point = (point.0 * per_time, point.1 * per_force);
    }
    let diagram = Diagram {
        labels: [time.with_unit(), force.with_unit()],
        ends: [
            (first, if last > first { last } else { first + 1.0 }),
            span(ends.0 * per_force, ends.1 * per_force),
        ],
        rest: points.clone(),
    };
    (Some(diagram).filter(|_| !points.is_empty()), points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_even_and_hold_both_ends() {
        let times: Vec<f64> = (0..101).map(f64::from).collect();
        assert_eq!(evenly(&times, 5), [0.0, 25.0, 50.0, 75.0, 100.0]);
        assert_eq!(evenly(&times[..3], 5), [0.0, 1.0, 2.0]);
        assert_eq!((evenly(&times[..1], 5), evenly::<f64>(&[], 5)), (vec![0.0], Vec::new()));
    }

    #[test]
    fn an_infinite_edge_does_not_flatten_a_profile() {
        let mut points: Vec<(f64, f64)> = (0..100).map(|i| (f64::from(i), 1.0)).collect();
        points[99].1 = 1e6;
        assert_eq!(shown(&points), (1.0, 1.0));
        assert_eq!((shown(&[]), span(0.0, 0.0)), ((0.0, 0.0), (0.0, 1.0)));
    }
}
