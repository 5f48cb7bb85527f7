//! `/line/…`: stress along a line in the target, at the interval of the interface stress.

use super::{Channel, FieldNote, HEAD, Rate};
use crate::{case::Case, message::percuss, model::Line, units::Units};

pub fn channel(case: &Case, number: usize, line: Line) -> Channel {
    let Units { length, time, stress, .. } = case.units();
    let meaning = "stress -sigma_zz, compression positive like the interface stress, at s0 + n ds";
    let note = FieldNote::new("stress", stress.name, meaning).along("s0,ds,s");
    let grid = case.grid();
    let (s0, ds, nodes, first, note, place) = match line {
        Line::R(r) => {
            let place = format!("r = {}", length.of(r));
            (0.0, case.sizes.dz, grid.nz + 1, "depth of the first node", note, place)
        }
        Line::Z(z) => {
            let place = format!("z = {}", length.of(z));
            (grid.r0, case.sizes.dr, case.gauges().columns, "radius of the first node", note.even(), place)
        }
    };
    let fields = vec![
        FieldNote::new("s0", length.name, first),
        FieldNote::new("ds", length.name, "distance between nodes"),
        FieldNote::new(
            "s",
            length.name,
            "places of all nodes, where the target has more than one layer or the mesh is graded",
        ),
        note,
    ];
    let mut s = Vec::new();
    match line {
        Line::R(_) if grid.layers.len() > 1 || grid.is_graded() => {
            let striker = case.striker_grid();
            let above = striker.iter().flat_map(|grid| (0..=grid.nz).rev().map(|j| -grid.z(j)));
            s.extend(above.chain((0..=grid.nz).map(|j| grid.z(j))).map(|z| length.of(z)));
        }
        Line::Z(z) if grid.is_graded() => {
            let grid = if z < 0.0 { case.striker_grid().unwrap_or(grid) } else { grid };
            let columns = case.gauges().columns.min(grid.nr());
            s.extend((0..columns).map(|i| length.of(grid.r(i))));
        }
        Line::R(_) | Line::Z(_) => {}
    }
    let [s0, ds] = [s0, ds].map(|x| length.of(x));
    let mut message = percuss::LineSlice { s0, ds, s, ..percuss::LineSlice::default() };
    Channel::new(format!("/line/{number}"), "percuss.LineSlice", fields, move |view, outlet| {
        let Some(line) = view.gauges.as_ref().and_then(|gauges| gauges.lines.get(number)) else { return };
        (message.step, message.time) = (view.step, time.of(view.time));
        message.stress.clear();
        message.stress.extend(line.iter().map(|p| stress.of(*p)));
        outlet.put(&message);
    })
    .emits(Rate::Interval(HEAD + 8 * nodes as u64))
    .remark("line", place)
}
