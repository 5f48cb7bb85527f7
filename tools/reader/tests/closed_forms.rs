//! Recordings of closed forms are sound, though they have fewer channels than a run.

use std::{fs, path::Path};

use percuss::{
    case::{Case, HeadKind, builtin},
    exact::closed_form::ClosedForm,
    session::{Session, Source, Status},
    validity::Validity,
};
use percuss_reader::{
    command::{report::report, verify::verify},
    recording::Limits,
};

/// Records the closed form of a case; false if there is none.
fn record(name: &str, path: &Path) -> bool {
    let overrides = ["mesh.cells=20".to_owned(), "run.end_time=1.5".to_owned()];
    let text = builtin::find(name).expect("a built-in case");
    let case = Case::parse(name, text, &overrides, "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"));
    let Ok(mut form) = ClosedForm::for_case(&case) else { return false };
    let source = Source::Exact { form: form.name(), knows_drag: form.has_drag() };
    let mut session = Session::begin(&case, source, path, false, 1).expect("a new file");
    for step in 0..=form.last_step() {
        session.observe(&form.evaluate(step)).expect("room on the disk");
    }
    let status = match form.last_step() == case.sizes.steps {
        true => Status::Completed,
        false => Status::Stopped("the closed form holds no longer".into()),
    };
    session
        .end(&status, &Validity::new(case.impact.velocity, case.indenter.head == HeadKind::Flat))
        .expect("room on the disk");
    true
}

#[test]
fn every_closed_form_is_sound() {
    let folder = tempfile::tempdir().expect("a folder");
    let (mut with_drag, mut without) = (0, 0);
    for name in builtin::names() {
        let path = folder.path().join(format!("{name}.mcap"));
        if !record(name, &path) {
            continue;
        }
        let verdict = verify(&path, Limits::default()).expect("a recording");
        assert!(verdict.is_sound() && !verdict.partial, "{name}: {:?}", verdict.problems);
        let bytes = fs::read(&path).expect("the recording");
        let summary = mcap::Summary::read(&bytes).expect("a sound file").expect("a summary");
        let has_drag = summary.channels.values().any(|channel| channel.topic == "/drag");
        *(if has_drag { &mut with_drag } else { &mut without }) += 1;
        let (page, damages) = report(&path, Limits::default()).expect("a report");
        assert!(page.contains("\"sound\":true") && damages.is_empty(), "{name}");
    }
    assert!(with_drag >= 4 && without >= 9, "{with_drag} forms have the drag, {without} do not");
}
