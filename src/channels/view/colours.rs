//! Colours of pictures.

use crate::message::foxglove::Color;

/// A colour of a scene.
pub const fn opaque(r: f64, g: f64, b: f64) -> Color {
    Color { r, g, b, a: 1.0 }
}

/// Deformed surface and backing.
pub const SURFACE: Color = opaque(0.0, 0.45, 0.70);
/// Outline of the indenter.
pub const OUTLINE: Color = opaque(0.35, 0.35, 0.35);
/// Body of the indenter.
pub const BODY: Color = opaque(0.62, 0.62, 0.62);
/// Drag.
pub const DRAG: Color = opaque(0.84, 0.37, 0.0);
/// Contact radius.
pub const CONTACT: Color = opaque(0.0, 0.62, 0.45);
/// Wave fronts.
pub const FRONT: Color = opaque(0.90, 0.62, 0.0);

/// Colours of levels in images: 0 is no value, 1 the indenter, 2 to 254 run from blue (tension) over white at 128 to
/// red (compression). Shape `(256, [red, green, blue])`, flat.
pub fn palette() -> Vec<u8> {
    // blue, light blue, white, orange, dark red at equal distances
    const STOPS: [[f64; 3]; 5] = [
        [18.0, 52.0, 120.0],
        [98.0, 160.0, 214.0],
        [247.0, 247.0, 247.0],
        [232.0, 128.0, 78.0],
        [120.0, 12.0, 32.0],
    ];
    let colour = |level: u32| {
        if level < 2 {
            return if level == 0 { [255; 3] } else { [90; 3] };
        }
        let place = (f64::from(level.min(254)) - 2.0) / 63.0;
        let stop = (place as usize).min(STOPS.len() - 2);
        let share = place - stop as f64;
        let mix = |part: usize| STOPS[stop][part] + share * (STOPS[stop + 1][part] - STOPS[stop][part]);
        [mix(0), mix(1), mix(2)].map(|part| part.round() as u8)
    };
    (0..256).flat_map(colour).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_white_and_signs_differ() {
        let palette = palette();
        let colour = |level: usize| &palette[3 * level..3 * level + 3];
        assert_eq!(colour(128), [247; 3]);
        assert_eq!(colour(2), [18, 52, 120]);
        assert_eq!(colour(254), [120, 12, 32]);
    }
}
