//! The parts of a figure of the page.

use percuss_picture::{Curve, Image, Panel};

use crate::lab::{Made, Points};

/// A figure of the paper, computed.
#[derive(Default)]
pub struct Figure {
    /// Number in the paper, or a word for a figure that it does not have: also the name of its files.
    pub id: String,
    /// Title.
    pub title: String,
    /// Remark.
    pub text: String,
    /// Diagrams, one below the other.
    pub panels: Vec<Panel>,
    /// A matrix instead of diagrams, and the values at the ends of its colours.
    pub image: Option<(Image, (f64, f64))>,
    /// Recordings it was drawn from.
    pub made: Vec<Made>,
    /// Commands of runs whose recordings are not kept.
    pub commands: Vec<String>,
    /// Statements of the paper with the computed values.
    pub statements: Vec<Statement>,
}

/// A statement of the paper and the computed value.
pub struct Statement {
    /// Value in the paper.
    pub paper: String,
    /// Computed value.
    pub computed: String,
    /// Do they agree?
    pub verdict: Verdict,
    /// Convergence check or closed form behind the computed number.
    pub check: String,
}

/// Do a statement and a computation agree?
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Within the precision of the paper's digits and figures.
    Agrees,
    /// They do not.
    Differs,
    /// The paper states no value to compare with.
    Given,
}

impl Verdict {
    /// Agrees if `computed` is within the relative distance `tolerance` of `stated`.
    pub fn of(computed: f64, stated: f64, tolerance: f64) -> Self {
        if ((computed - stated) / stated).abs() <= tolerance { Self::Agrees } else { Self::Differs }
    }

    /// Agrees if `condition` holds.
    pub fn that(condition: bool) -> Self {
        if condition { Self::Agrees } else { Self::Differs }
    }

    /// In one word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Agrees => "agrees",
            Self::Differs => "differs",
            Self::Given => "computed only",
        }
    }
}

impl Figure {
    /// Number in the paper, if it has one, and title.
    pub fn heading(&self) -> String {
        let Self { id, title, .. } = self;
        if id.starts_with(|first: char| first.is_ascii_digit()) {
            format!("Fig. {id}: {title}")
        } else {
            title.clone()
        }
    }

    /// The commands behind it.
    pub fn commands(&self) -> impl Iterator<Item = &str> {
        self.made.iter().map(|made| &made.command).chain(&self.commands).map(String::as_str)
    }

    /// Remark, with the curves that the axes cut.
    pub fn remark(&self) -> String {
        let mut text = self.text.clone();
        for panel in &self.panels {
            let Some((_, top)) = panel.y_range else { continue };
            let (x0, x1) = panel.x_range.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
            let highest = |curve: &Curve| {
                let shown = curve.points.iter().filter(|p| (x0..=x1).contains(&p.0) && p.1.is_finite());
                shown.map(|p| p.1).fold(f64::NEG_INFINITY, f64::max)
            };
            let cut = panel.curves.iter().filter(|curve| !curve.name.is_empty() && highest(curve) > top);
            let cut: Vec<String> =
                cut.map(|curve| format!("{} (highest {:.1})", curve.name, highest(curve))).collect();
            if !cut.is_empty() {
                let title =
                    if self.panels.len() > 1 { format!(" of {}", panel.title) } else { String::new() };
                text.push_str(&format!(
                    " The vertical axis{title} ends at {top}, which cuts {}.",
                    cut.join(", ")
                ));
            }
        }
        text
    }
}

/// A statement with its verdict.
pub fn statement(
    paper: impl Into<String>,
    computed: impl Into<String>,
    verdict: Verdict,
    check: impl Into<String>,
) -> Statement {
    Statement { paper: paper.into(), computed: computed.into(), verdict, check: check.into() }
}

/// A curve.
pub fn curve(name: impl Into<String>, points: Points, colour: usize) -> Curve {
    Curve { name: name.into(), points, dashed: false, colour: Some(colour) }
}

/// A closed form, drawn with dashes in black over the curve it belongs to.
pub fn exact(name: impl Into<String>, points: Points) -> Curve {
    /// Number of black among the colours of pictures.
    const BLACK: usize = 6;
    Curve { name: name.into(), points, dashed: true, colour: Some(BLACK) }
}

/// A diagram of stress against time.
pub fn over_time(title: &str, curves: Vec<Curve>) -> Panel {
    Panel {
        title: title.into(),
        x_label: "t [R/c_p]".into(),
        y_label: "p = −σ_zz [γc_p²]".into(),
        curves,
        ..Panel::default()
    }
}

/// A diagram of stress against radius.
pub fn over_radius(title: &str, curves: Vec<Curve>) -> Panel {
    Panel { x_label: "r [R]".into(), ..over_time(title, curves) }
}
