//! Colours of values with a sign, the same in every picture of a run.

/// Colours from the lowest value to the highest, at equal distances: blue, light blue, white, orange, dark red.
pub const DIVERGING: [[u8; 3]; 5] =
    [[18, 52, 120], [98, 160, 214], [247, 247, 247], [232, 128, 78], [120, 12, 32]];

/// Colour of a value: blue below 0, white at 0, red above.
///
/// * `share`: the value relative to the end of the scale, −1 to 1
#[must_use]
pub fn diverging(share: f64) -> [u8; 3] {
    let place = (share.clamp(-1.0, 1.0) + 1.0) * 0.5 * (DIVERGING.len() - 1) as f64;
    let stop = (place as usize).min(DIVERGING.len() - 2);
    let between = |part: usize| {
        let [from, to] = [stop, stop + 1].map(|stop| f64::from(DIVERGING[stop][part]));
        (from + (place - stop as f64) * (to - from)).round() as u8
    };
    [0, 1, 2].map(between)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_differ_and_nothing_is_white() {
        assert_eq!([-1.0, 0.0, 1.0].map(diverging), [DIVERGING[0], DIVERGING[2], DIVERGING[4]]);
        assert_eq!(diverging(0.25), [240, 188, 163]);
        assert_eq!(diverging(-7.0), diverging(-1.0));
    }
}
