//! Fields as VTK XML, which ParaView opens: one field on a uniform (`.vti`) or a rectilinear grid (`.vtr`); binary, appended raw.
//!
//! x runs along the columns, y along the rows, with one point per value. The array has its unit in its name, `stress [Pa]`; one without
//! dimension has none. What x and y are is said by the comment in front, and by the names of the coordinates of a `.vtr`.

use percuss_table::{Heading, units::RECORDED};

use crate::{
    slice::{Side, Slice},
    text::xml,
};

/// A field as image data.
///
/// ```text
/// <VTKFile> <ImageData WholeExtent="0 nx-1 0 ny-1 0 0" Origin Spacing> … <AppendedData encoding="raw">_ length values
/// ```
pub fn vti(slice: &Slice) -> Result<Vec<u8>, &Heading> {
    let even = |side: &Side, axis| match side {
        Side::Even { start, step, .. } => Ok((*start, *step)),
        Side::Listed(_) => Err(axis),
    };
    let [rows, columns] = &slice.axes;
    let ((y, dy), (x, dx)) = (even(&slice.rows, rows)?, even(&slice.columns, columns)?);
    Ok(file(slice, "ImageData", &format!(" Origin=\"{x} {y} 0\" Spacing=\"{dx} {dy} 1\""), []))
}

/// A field on a rectilinear grid. Where a depth stands twice, at an interface, a layer of cells without height keeps its two
/// sides apart.
///
/// ```text
/// <VTKFile> <RectilinearGrid WholeExtent="0 nx-1 0 ny-1 0 0"> … <Coordinates> … <AppendedData encoding="raw">_ length values …
/// ```
pub fn vtr(slice: &Slice) -> Vec<u8> {
    let places = |side: &Side| (0..side.length()).map(|i| side.at(i)).collect();
    let [rows, columns] = slice.axes.each_ref().map(name);
    let coordinates =
        [(&*columns, places(&slice.columns)), (&*rows, places(&slice.rows)), ("plane", vec![0.0])];
    file(slice, "RectilinearGrid", "", coordinates)
}

/// A file of a kind of grid.
///
/// * `attributes`: of the grid, behind its extent
/// * `coordinates`: of its points, by name
fn file<const N: usize>(
    slice: &Slice,
    kind: &str,
    attributes: &str,
    coordinates: [(&str, Vec<f64>); N],
) -> Vec<u8> {
    let (nx, ny) = (slice.columns.length().max(1), slice.rows.length().max(1));
    let extent = format!("0 {} 0 {} 0 0", nx - 1, ny - 1);
    let name = xml(&name(&slice.heading()));
    let [y, x] = slice.axes.each_ref().map(Heading::with_unit);
    let (title, time) = (xml(&format!("{}; x is {x}, y is {y}", slice.title())), slice.time);
    let mut data = Vec::new();
    let mut array = |name: &str, values: &[f64]| {
        let offset = data.len();
        data.extend(((8 * values.len()) as u64).to_le_bytes());
        data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        format!("<DataArray type=\"Float64\" Name=\"{name}\" format=\"appended\" offset=\"{offset}\"/>\n")
    };
    let values = array(&name, &slice.values);
    let axes: String = coordinates.iter().map(|(name, places)| array(&xml(name), places)).collect();
    let axes = if N > 0 { format!("<Coordinates>\n{axes}</Coordinates>\n") } else { axes };
    let head = format!(
        "<?xml version=\"1.0\"?>\n\
         <!-- {} -->\n\
         <VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <{kind} WholeExtent=\"{extent}\"{attributes}>\n\
         <FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{time}</DataArray></FieldData>\n\
         <Piece Extent=\"{extent}\">\n<PointData Scalars=\"{name}\">\n{values}</PointData>\n{axes}</Piece>\n</{kind}>\n\
         <AppendedData encoding=\"raw\">\n_",
        title.replace("--", "- -"),
    );
    [head.as_bytes(), &data, b"\n</AppendedData>\n</VTKFile>\n"].concat()
}

/// Name of an array with its unit, if it has a dimension.
fn name(heading: &Heading) -> String {
    let is_plain = |unit: &String| RECORDED.iter().any(|known| unit == known.plain);
    Heading { unit: heading.unit.clone().filter(|unit| !is_plain(unit)), ..heading.clone() }.with_unit()
}

/// A time series of ParaView: times, and the files of the frames as seen from it.
pub fn pvd(frames: &[(f64, String)]) -> String {
    let entry =
        |(time, file): &(f64, String)| format!("<DataSet timestep=\"{time}\" file=\"{}\"/>\n", xml(file));
    let entries: String = frames.iter().map(entry).collect();
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n<Collection>\n{entries}</Collection>\n</VTKFile>\n"
    )
}
