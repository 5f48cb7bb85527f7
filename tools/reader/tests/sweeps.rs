//! Reports of sweeps.

use std::fs;

use crate::desk::Desk;

/// A desk with the directory of a sweep, `masses`.
fn sweep(summary: &str, journal: &str) -> Desk {
    let desk = Desk::new(&[]);
    fs::create_dir_all(desk.path("masses/runs")).expect("folders");
    for name in ["masses/runs/1.mcap", "masses/javascript:alert(1)"] {
        desk.put(name, "");
    }
    desk.put("masses/summary.csv", summary);
    desk.put("masses/manifest.jsonl", journal);
    desk
}

/// The data in a page.
fn data(page: &str) -> serde_json::Value {
    let data =
        page.split_once("id=\"data\">").and_then(|(_, rest)| rest.split_once("</script>")).expect("data").0;
    serde_json::from_str(data).expect("JSON")
}

#[test]
fn a_sweep_is_a_page_of_its_cases() {
    let desk = sweep(
        "case,indenter.mass,contact,status,peak_force [N],restitution\n1,0.5,bonded,done,2000.0,0.25\n2,1,,failed,,\n\
         3,2,7,done,3e3,0.75\n",
        "{\"sweep\":\"masses\"}\n{\"case\":1,\"state\":\"started\",\"file\":null}\n\
         {\"case\":1,\"state\":\"done\",\"file\":\"runs/1.mcap\",\"seconds\":0.1}\n{\"case\":2,\"state\":\"failed\",\"file\":null}\n\
         {\"case\":3,\"file\":\"runs/3.mc",
    );
    desk.text(0, &["report", "masses/"]);
    let page = fs::read_to_string(desk.path("masses.html")).expect("a page");
    let data = data(&page);
    assert_eq!(data["title"], "masses");
    // the last line of the journal is torn
    assert_eq!(data["links"], serde_json::json!(["masses/runs/1.mcap", null, null]));
    let columns = data["columns"].as_array().expect("columns");
    let numeric: Vec<bool> = columns.iter().map(|column| column["numeric"] == true).collect();
    assert_eq!(numeric, [true, true, false, false, true, true]);
    assert_eq!(columns[4]["unit"], "kN");
    assert_eq!(columns[4]["values"], serde_json::json!([2.0, null, 3.0]));
    assert_eq!(columns[2]["values"], serde_json::json!(["bonded", null, 7]));
    // links lead from where the page is
    desk.text(0, &["report", "masses", "-o", "masses/page.html"]);
    let page = fs::read_to_string(desk.path("masses/page.html")).expect("a page");
    assert_eq!(self::data(&page)["links"][0], "runs/1.mcap");
    assert!(desk.error(1, &["report", "masses"]).contains("--force"));
}

#[test]
fn warnings_of_cases_are_a_column_that_the_page_counts() {
    let desk = sweep("case,status,peak_force [N],warnings\n1,done,1,rigid;cells\n2,done,2,\n", "");
    desk.text(0, &["report", "masses"]);
    let page = fs::read_to_string(desk.path("masses.html")).expect("a page");
    let data = data(&page);
    assert_eq!((&data["columns"][3]["name"], &data["warnings"]), (&"warnings".into(), &"warnings".into()));
    assert_eq!(data["columns"][3]["values"], serde_json::json!(["rigid;cells", null]));
    // its script sets a word beside the title for each of them
    assert!(page.contains("data.warnings") && page.contains("`warning: ${about} in ${cases}`"));
}

#[test]
fn names_of_a_sweep_cannot_leave_their_place_in_the_page() {
    let name = "</script><script>alert(1)</script>";
    let desk = sweep(
        &format!("case,{name} [{name}],status\n1,{name},{name}\n2,5,\"<img src=x>\"\n"),
        "{\"case\":1,\"file\":\"javascript:alert(1)\"}\n{\"case\":2,\"file\":\"../../etc/passwd\"}\n",
    );
    desk.text(0, &["report", "masses"]);
    let page = fs::read_to_string(desk.path("masses.html")).expect("a page");
    assert_eq!(
        (page.matches("</script>").count(), page.matches("<script").count(), page.matches("<img").count()),
        (2, 2, 0)
    );
    assert_eq!(data(&page)["columns"][1]["name"], name);
    assert_eq!(data(&page)["links"], serde_json::json!(["masses/javascript%3Aalert%281%29", null]));
    // the name space of SVG is a name, not an address that is asked for anything
    let page = page.replace("http://www.w3.org/2000/svg", "");
    assert!(page.contains("default-src 'none'") && !page.contains("http://") && !page.contains("https://"));
}

#[test]
fn what_is_no_sweep_is_refused() {
    let desk = sweep("case,status\n1\n", "");
    assert!(desk.error(1, &["report", "masses"]).contains("summary.csv"));
    fs::remove_file(desk.path("masses/summary.csv")).expect("a file");
    let error = desk.error(2, &["report", "masses"]);
    assert!(error.contains("`masses`") && error.contains("summary.csv"), "{error}");
    assert!(!desk.path("masses.html").exists());
}
