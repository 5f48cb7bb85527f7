//! The cases of a sweep, all checked before the first is run.

use std::{collections::BTreeMap, path::Path};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use super::{
    SweepError,
    request::Request,
    spec::{Axis, axes},
};
use crate::{
    advice::cost::Estimate,
    case::{Case, CaseBuilder, CaseErrors, builtin},
    recording::NUMERICS,
    units::Units,
};

#[derive(Debug, thiserror::Error)]
#[error("{count} of {cases} cases are wrong")]
pub struct WrongCases {
    pub count: usize,
    pub cases: usize,
    /// Those with the same problems together: the number of the first one, how many there are, the problems of the first.
    pub groups: Vec<(usize, usize, CaseErrors)>,
}

/// SHA-256, its first half: of all that the results of a case depend on, and the revision of the numerics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Digest([u8; 16]);

impl Digest {
    fn of(case: &Case) -> Self {
        let hash = Sha256::digest(format!("numerics {NUMERICS}\n{}", case.identity()));
        Self(hash[..16].try_into().expect("a hash has 32 bytes"))
    }
}

impl From<Digest> for String {
    fn from(digest: Digest) -> Self {
        format!("{:032x}", u128::from_be_bytes(digest.0))
    }
}

impl TryFrom<String> for Digest {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let number = u128::from_str_radix(&text, 16).ok().filter(|_| text.len() == 32);
        number.map(|number| Self(number.to_be_bytes())).ok_or_else(|| format!("`{text}` is no digest"))
    }
}

#[derive(Clone, Copy, Debug)]
pub struct Planned {
    /// What its results are known by.
    pub digest: Digest,
    /// Estimated time on one core \[s\].
    pub seconds: f64,
    /// Estimated memory \[bytes\].
    pub memory: u64,
    /// Estimated size of its recording \[bytes\].
    pub file: u64,
}

/// The cases of a sweep, checked; numbered from 1 on.
#[derive(Debug)]
pub struct Plan {
    /// What was asked for, with files read: it stands by itself.
    pub request: Request,
    /// The first case, which has the units of all.
    pub first: Case,
    pub cases: Vec<Planned>,
    base: CaseBuilder,
    axes: Vec<Axis>,
}

impl Plan {
    /// Checks all cases.
    ///
    /// * `folder`: of relative paths in the request
    pub fn new(mut request: Request, folder: &Path) -> Result<Self, SweepError> {
        let vary = std::mem::take(&mut request.vary);
        request.vary = vary.into_iter().map(|vary| vary.resolved(folder)).collect::<Result<_, _>>()?;
        let axes = axes(&request.vary, request.combine)?;
        let set = |key: &&String| {
            request.set.iter().any(|set| set.split_once('=').is_some_and(|(name, _)| name.trim() == *key))
        };
        if let Some(key) = axes.iter().flat_map(|axis| &axis.keys).find(set) {
            return Err(SweepError::Usage(format!("`{key}` is set and varied: keep one of them")));
        }
        let base = base(&mut request, folder)?.overrides(&request.set);
        let count = axes.iter().map(|axis| axis.rows.len()).product();
        let check = |number: usize| {
            settle(&base, &axes, number).map(|case| {
                let estimate = Estimate::new(&case);
                let planned = Planned {
                    digest: Digest::of(&case),
                    seconds: estimate.seconds * rayon::current_num_threads() as f64,
                    memory: estimate.memory,
                    file: estimate.file,
                };
                (planned, case.units())
            })
        };
        // a text that is anything but a case is refused once, not in every case
        if let Err(errors) = settle(&base, &axes, 1)
            && errors.more > 0
        {
            return Err(errors.into());
        }
        let checked: Vec<_> = (1..=count).into_par_iter().map(check).collect();
        let (cases, units): (Vec<Planned>, Vec<Units>) = all_right(checked)?.into_iter().unzip();
        same_units(&units)?;
        let first = settle(&base, &axes, 1)?;
        if first.run.bounces > 1 || axes.iter().flat_map(|axis| &axis.keys).any(|key| key == "run.bounces") {
            let text = "a case of a sweep is one impact: leave run.bounces out, or set it to 1";
            return Err(SweepError::Usage(text.into()));
        }
        Ok(Self { request, first, cases, base, axes })
    }

    /// A case by its number, from 1 on.
    pub fn case(&self, number: usize) -> Result<Case, CaseErrors> {
        settle(&self.base, &self.axes, number)
    }

    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.axes.iter().flat_map(|axis| &axis.keys).map(String::as_str)
    }

    /// All values of a key, by its number from 0 on.
    pub(super) fn column(&self, key: usize) -> impl Iterator<Item = &str> {
        let mut places =
            self.axes.iter().flat_map(|axis| (0..axis.keys.len()).map(move |place| (axis, place)));
        let (axis, place) = places.nth(key).expect("the number of a key");
        axis.rows.iter().map(move |row| row[place].as_str())
    }

    /// Their values in a case by its number, from 1 on, each as it stands in a case file.
    pub fn values(&self, number: usize) -> impl Iterator<Item = &str> {
        row(&self.axes, number).into_iter().flatten().map(String::as_str)
    }
}

/// The case that all others vary. The request of one that is read from a file then has its text and stands by itself.
fn base(request: &mut Request, folder: &Path) -> Result<CaseBuilder, SweepError> {
    if request.text.is_none() {
        if builtin::find(&request.case).is_some() {
            return Ok(CaseBuilder::load(&request.case)?);
        }
        let path = folder.join(&request.case);
        request.text = Some(CaseBuilder::load(&path.to_string_lossy())?.text());
        request.case = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let of_case = path.parent().filter(|folder| *folder != "").unwrap_or(Path::new("."));
        request.folder.get_or_insert_with(|| of_case.to_owned());
    }
    let (text, folder) =
        (request.text.clone().unwrap_or_default(), request.folder.clone().unwrap_or_default());
    // known from anywhere
    let folder =
        std::path::absolute(&folder).map_err(|error| SweepError::unread(&folder)(error.to_string()))?;
    request.folder = Some(folder.clone());
    Ok(CaseBuilder::from_text(&request.case, &text, &folder))
}

/// The rows of the axes that make a case.
fn row(axes: &[Axis], number: usize) -> Vec<&Vec<String>> {
    let mut rest = number - 1;
    let mut rows: Vec<&Vec<String>> = Vec::with_capacity(axes.len());
    for axis in axes.iter().rev() {
        rows.push(&axis.rows[rest % axis.rows.len()]);
        rest /= axis.rows.len();
    }
    rows.reverse();
    rows
}

fn settle(base: &CaseBuilder, axes: &[Axis], number: usize) -> Result<Case, CaseErrors> {
    let keys = axes.iter().flat_map(|axis| &axis.keys);
    let values = row(axes, number).into_iter().flatten();
    let settings: Vec<String> = keys.zip(values).map(|(key, value)| format!("{key}={value}")).collect();
    base.clone().overrides(&settings).build()
}

/// All checked cases, or the wrong ones, those with the same problems together.
fn all_right<T>(checked: Vec<Result<T, CaseErrors>>) -> Result<Vec<T>, WrongCases> {
    let cases = checked.len();
    let (mut right, mut count) = (Vec::with_capacity(cases), 0);
    let mut groups: BTreeMap<Vec<String>, (usize, usize, CaseErrors)> = BTreeMap::new();
    for (number, case) in (1..).zip(checked) {
        match case {
            Ok(case) => right.push(case),
            Err(errors) => {
                count += 1;
                let problems = errors.problems.iter().map(|problem| problem.message.clone()).collect();
                groups.entry(problems).or_insert((number, 0, errors)).1 += 1;
            }
        }
    }
    if count == 0 {
        return Ok(right);
    }
    let mut groups: Vec<_> = groups.into_values().collect();
    groups.sort_unstable_by_key(|(number, ..)| *number);
    Err(WrongCases { count, cases, groups })
}

/// Refuses cases whose numbers cannot stand in one column.
fn same_units(units: &[Units]) -> Result<(), SweepError> {
    let names = |units: &Units| {
        [("time", units.time), ("length", units.length), ("force", units.force)]
            .map(|(what, unit)| (what, unit.name))
    };
    for (number, others) in (1_usize..).zip(units) {
        for ((what, unit), (_, first)) in names(others).into_iter().zip(names(&units[0])) {
            if unit != first {
                return Err(SweepError::Usage(format!(
                    "case {number} has its {what} in {unit}, case 1 its own in {first}: numbers of one column have one unit; sweep them apart"
                )));
            }
        }
    }
    Ok(())
}
