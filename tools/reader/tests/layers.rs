//! Colours of targets of layers; the table `layers` has what is said of them.

use std::fs;

use crate::cases;

/// Numbers of an attribute of the elements of an SVG that begin like this.
fn attributes(svg: &str, element: &str, name: &str) -> Vec<f64> {
    let elements = svg.split(element).skip(1).map(|rest| rest.split('>').next().unwrap_or_default());
    let value = |element: &str| element.split(&format!(" {name}=\"")).nth(1)?.split('"').next()?.parse().ok();
    elements.filter_map(value).collect()
}

#[test]
fn colours_end_at_the_interface() {
    // a field of two values: one row of colours for each layer
    let desk = cases::desk("layers", "two-values");
    for request in [["--at-time", "0"].as_slice(), &["--map", "--at", "r=0"]] {
        let request = [&["plot", "a.mcap", "-o", "p.svg", "--force", "--topic", "/field/stress"], request];
        desk.text(0, &request.concat());
        let svg = fs::read_to_string(desk.path("p.svg")).expect("a picture");
        // the line is a row of black pixels, and the colours of the lower layer begin under it
        let black = svg
            .split("<rect")
            .filter(|rect| rect.contains("fill=\"#1e1e1e\""))
            .map(|rect| format!("<rect{rect}"));
        let line = attributes(&black.collect::<String>(), "<rect", "y");
        let tops = attributes(&svg, "<rect", "y");
        let is_interface = |y: &f64| tops.iter().any(|top| (0.5..1.1).contains(&(top - y)));
        assert!(line.iter().any(is_interface), "no line where cells begin: {line:?} {tops:?}");
    }
}
