//! The layout of PlotJuggler: drag, velocity and probes against time.

use std::fmt::Write;

use super::LayoutBuilder;
use crate::units::{Unit, Units};

/// Colours of Okabe and Ito, in the order of their use.
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#e69f00", "#cc79a7", "#56b4e9", "#000000"];

/// The layout: one tab, the plots one above the other.
pub fn layout(builder: &LayoutBuilder<'_>) -> String {
    let Units { force, speed, stress, .. } = builder.units;
    // numbers in SI need their unit
    let name = |name: &str, unit: Unit| {
        if builder.is_physical() { format!("{name} [{}]", unit.name) } else { name.to_owned() }
    };
    let mut plots: Vec<(String, Vec<String>)> = Vec::new();
    if builder.has("/drag") {
        plots.push((name("drag", force), vec!["/drag/force".into()]));
    }
    plots.push((name("velocity", speed), vec!["/velocity/velocity".into()]));
    let probes: Vec<String> = builder.probes().map(|(i, _)| format!("/probes/stress[{i}]")).collect();
    if !probes.is_empty() {
        plots.push((name("interface stress", stress), probes));
    }
    let share = 1.0 / plots.len() as f64;
    let shares = vec![format!("{share:.6}"); plots.len()].join(";");
    let mut areas = String::new();
    for (name, curves) in &plots {
        let _ = writeln!(areas, "     <DockArea name=\"{name}\">");
        areas.push_str("      <plot mode=\"TimeSeries\" style=\"Lines\" flip_x=\"false\" flip_y=\"false\">\n       <limitY/>\n");
        for (curve, colour) in curves.iter().zip(COLOURS.iter().cycle()) {
            let _ = writeln!(areas, "       <curve name=\"{curve}\" color=\"{colour}\"/>");
        }
        areas.push_str("      </plot>\n     </DockArea>\n");
    }
    format!(
        "<?xml version='1.0' encoding='UTF-8'?>
<root>
 <tabbed_widget name=\"Main Window\" parent=\"main_window\">
  <Tab tab_name=\"percuss\" containers=\"1\">
   <Container>
    <DockSplitter orientation=\"-\" count=\"{}\" sizes=\"{shares}\">
{areas}    </DockSplitter>
   </Container>
  </Tab>
  <currentTabIndex index=\"0\"/>
 </tabbed_widget>
 <use_relative_time_offset enabled=\"1\"/>
</root>
",
        plots.len()
    )
}
