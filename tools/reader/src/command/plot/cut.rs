//! Parts of images: the rows and columns within ranges.

use std::ops::Range;

use percuss_picture::{Image, Side};

use super::request::PlotError;

/// The part of an image within ranges of its coordinates, in recorded units.
///
/// # Errors
///
/// Nothing lies within.
pub(super) fn cut(
    image: Image,
    columns: Option<(f64, f64)>,
    rows: Option<(f64, f64)>,
) -> Result<Image, PlotError> {
    let across = within(&image.columns, columns, "--x-range")?;
    let down = within(&image.rows, rows, "--y-range")?;
    let width = image.columns.length();
    let row = |j: usize| &image.values[j * width + across.start..j * width + across.end];
    let values = down.clone().flat_map(|j| row(j).iter().copied()).collect();
    Ok(Image { rows: image.rows.part(down), columns: image.columns.part(across), values, ..image })
}

/// Numbers of the elements of a side whose positions lie within a range.
fn within(side: &Side, range: Option<(f64, f64)>, option: &str) -> Result<Range<usize>, PlotError> {
    let Some((low, high)) = range else { return Ok(0..side.length()) };
    let is_inside = |i: &usize| (low..=high).contains(&side.at(*i));
    let mut inside = (0..side.length()).filter(is_inside);
    match (inside.next(), inside.next_back()) {
        (Some(first), Some(last)) => Ok(first..last + 1),
        _ => {
            let (first, last) = (side.at(0), side.at(side.length().saturating_sub(1)));
            let text =
                format!("{option} {low},{high} has fewer than two elements; they lie from {first} to {last}");
            Err(PlotError::Unfit(text))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_keeps_its_places() {
        let side = |length| Side::Even { start: 0.5, step: 1.0, length };
        let values = (0..12).map(f64::from).collect();
        let image = Image { rows: side(3), columns: side(4), values, ..Image::default() };
        let part = cut(image.clone(), Some((1.0, 2.6)), Some((1.5, 9.0))).expect("a part");
        assert_eq!(part.values, [5.0, 6.0, 9.0, 10.0]);
        assert_eq!((part.columns.at(0), part.rows.at(0)), (1.5, 1.5));
        assert_eq!(cut(image.clone(), None, None).expect("all of it").values.len(), 12);
        let error = cut(image, Some((10.0, 20.0)), None).expect_err("nothing there").to_string();
        assert!(error.contains("--x-range 10,20") && error.contains("0.5 to 3.5"), "{error}");
    }
}
