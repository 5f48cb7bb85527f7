//! Places of the names of layers: one above the other, as far apart as letters need.

/// Heights of names, each in the middle of its layer where there is room, and beside it otherwise; of more layers than there is room
/// for, every second one or fewer: pairs of the number of a layer and the depth of its name.
///
/// * `faces`: depths of the upper faces of the layers, from the surface down
/// * `depth`: the lower end of the picture
/// * `pitch`: least distance of names
pub fn spread(faces: &[f64], depth: f64, pitch: f64) -> Vec<(usize, f64)> {
    let shown = faces.partition_point(|face| *face < depth);
    let room = ((depth / pitch) as usize).max(1);
    let every = shown.div_ceil(room).max(1);
    let middle = |i: usize| 0.5 * (faces[i] + faces.get(i + 1).map_or(depth, |next| next.min(depth)));
    let mut names: Vec<(usize, f64)> = (0..shown).step_by(every).map(|i| (i, middle(i))).collect();
    // down, then up again from the lower end
    let mut least = 0.5 * pitch;
    for (_, at) in &mut names {
        *at = at.max(least);
        least = *at + pitch;
    }
    let mut most = depth - 0.5 * pitch;
    for (_, at) in names.iter_mut().rev() {
        *at = at.min(most);
        most = *at - pitch;
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_keep_their_distance() {
        // thick layers: in their middles
        assert_eq!(spread(&[0.0, 4.0], 10.0, 1.0), [(0, 2.0), (1, 7.0)]);
        // a coating on a half-space, two of them, and one above the lower end
        assert_eq!(spread(&[0.0, 0.1], 10.0, 1.0), [(0, 0.5), (1, 5.05)]);
        assert_eq!(spread(&[0.0, 0.1, 0.2], 10.0, 1.0), [(0, 0.5), (1, 1.5), (2, 5.1)]);
        assert_eq!(spread(&[0.0, 9.8, 9.9], 10.0, 1.0), [(0, 4.9), (1, 8.5), (2, 9.5)]);
        // below the picture; more than there is room for
        assert_eq!(spread(&[0.0, 4.0, 11.0], 10.0, 1.0), [(0, 2.0), (1, 7.0)]);
        let plies: Vec<f64> = (0..20).map(f64::from).collect();
        let names = spread(&plies, 20.0, 3.0);
        assert!(names.len() == 5 && names.windows(2).all(|pair| pair[1].1 - pair[0].1 > 2.999), "{names:?}");
    }
}
