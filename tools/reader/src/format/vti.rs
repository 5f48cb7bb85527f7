//! Image data of VTK (`.vti`), which ParaView opens: one field on a uniform grid.

use crate::slice::Slice;

/// A field as VTK XML image data: x along the columns, y along the rows, one point per value; binary, appended raw.
///
/// ```text
/// <VTKFile> <ImageData WholeExtent="0 nx-1 0 ny-1 0 0" Origin Spacing> … <AppendedData encoding="raw">_ length values
/// ```
pub fn vti(slice: &Slice) -> Vec<u8> {
    let (nx, ny) = (slice.columns.length.max(1), slice.rows.length.max(1));
    let extent = format!("0 {} 0 {} 0 0", nx - 1, ny - 1);
    let (x, y) = (&slice.columns, &slice.rows);
    let name = escape(&slice.name);
    let (title, time) = (escape(&slice.title()), slice.time);
    let mut bytes = format!(
        "<?xml version=\"1.0\"?>\n\
         <!-- {} -->\n\
         <VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <ImageData WholeExtent=\"{extent}\" Origin=\"{} {} 0\" Spacing=\"{} {} 1\">\n\
         <FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{time}</DataArray></FieldData>\n\
         <Piece Extent=\"{extent}\">\n<PointData Scalars=\"{name}\">\n\
         <DataArray type=\"Float64\" Name=\"{name}\" format=\"appended\" offset=\"0\"/>\n\
         </PointData>\n</Piece>\n</ImageData>\n<AppendedData encoding=\"raw\">\n_",
        title.replace("--", "- -"),
        x.start,
        y.start,
        x.step,
        y.step,
    )
    .into_bytes();
    bytes.extend(((8 * slice.values.len()) as u64).to_le_bytes());
    bytes.extend(slice.values.iter().flat_map(|value| value.to_le_bytes()));
    bytes.extend(b"\n</AppendedData>\n</VTKFile>\n");
    bytes
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
