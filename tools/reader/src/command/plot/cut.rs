//! Parts of images: the rows and columns within ranges.

use std::ops::Range;

use percuss_picture::{Image, Side};

use crate::{command::view::Peaks, failure::Failure};

/// The part of an image within ranges of its coordinates, in recorded units.
///
/// # Errors
///
/// Nothing lies within.
pub(super) fn cut(
    image: Image,
    columns: Option<(f64, f64)>,
    rows: Option<(f64, f64)>,
) -> Result<Image, Failure> {
    let across = within(&image.columns, columns, "--x-range")?;
    let down = within(&image.rows, rows, "--y-range")?;
    Ok(part(image, [down, across]))
}

/// Share of the largest value below which a value has the colour of 0, or nearly.
const VISIBLE: f64 = 1.0 / 256.0;

/// Rows and columns of an image in which something can be seen, and as much again around them, if they are less than half of its rows or
/// columns: a field of which little has moved would be a point in an empty picture.
///
/// * `range`: ends of the colours
pub(super) fn visible(image: &Image, range: Option<(f64, f64)>) -> Option<[Range<usize>; 2]> {
    let (low, high) = range.unwrap_or_else(|| image.range());
    let [height, width] = [image.rows.length(), image.columns.length()];
    let mut peaks = Peaks::default();
    peaks.take(&image.values, width);
    let [rows, columns] = peaks.above(VISIBLE * low.abs().max(high.abs()));
    if rows.is_empty() || (2 * rows.len() > height && 2 * columns.len() > width) {
        return None;
    }
    // as far to all sides as it is wide or high, whatever is more
    let more = (rows.len().max(columns.len()) / 2).max(2);
    let wider =
        |seen: Range<usize>, length: usize| seen.start.saturating_sub(more)..(seen.end + more).min(length);
    Some([wider(rows, height), wider(columns, width)])
}

/// The part of an image that has some rows and columns.
pub(super) fn part(image: Image, [down, across]: [Range<usize>; 2]) -> Image {
    let width = image.columns.length();
    let row = |j: usize| &image.values[j * width + across.start..j * width + across.end];
    let values = down.clone().flat_map(|j| row(j).iter().copied()).collect();
    Image { rows: image.rows.part(down), columns: image.columns.part(across), values, ..image }
}

/// Numbers of the elements of a side whose positions lie within a range.
fn within(side: &Side, range: Option<(f64, f64)>, option: &str) -> Result<Range<usize>, Failure> {
    let Some((low, high)) = range else { return Ok(0..side.length()) };
    let is_inside = |i: &usize| (low..=high).contains(&side.at(*i));
    let mut inside = (0..side.length()).filter(is_inside);
    match (inside.next(), inside.next_back()) {
        (Some(first), Some(last)) => Ok(first..last + 1),
        _ => {
            let (first, last) = (side.at(0), side.at(side.length().saturating_sub(1)));
            let text =
                format!("{option} {low},{high} has fewer than two elements; they lie from {first} to {last}");
            Err(Failure::Usage(text))
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
        // little of a large field has moved
        let mut values = vec![0.0; 100 * 40];
        (values[0], values[1], values[40]) = (-8.0, 4.0, 0.5);
        values[9 * 40 + 3] = 0.01;
        let field = Image { rows: side(100), columns: side(40), values, ..Image::default() };
        assert_eq!(visible(&field, None), Some([0..4, 0..4]));
        assert_eq!(visible(&field, Some((-0.1, 0.1))), Some([0..15, 0..9]));
        assert_eq!(visible(&image, None), None);
        assert_eq!(visible(&Image { values: vec![0.0; 12], ..image.clone() }, None), None);
        assert_eq!(cut(image.clone(), None, None).expect("all of it").values.len(), 12);
        let error = cut(image, Some((10.0, 20.0)), None).expect_err("nothing there").to_string();
        assert!(error.contains("--x-range 10,20") && error.contains("0.5 to 3.5"), "{error}");
    }
}
