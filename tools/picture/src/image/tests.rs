use super::*;

fn image(rows: usize, columns: usize, is_equal: bool) -> Image {
    let side = |length| Side::Even { start: 0.0, step: 0.1, length };
    let value = |i: usize| (i as f64 * 0.7).sin();
    Image {
        title: "a".into(),
        value_label: "v [γc_p²]".into(),
        rows: side(rows),
        columns: side(columns),
        values: (0..rows * columns).map(value).collect(),
        is_equal,
        colours: Colours::Diverging,
        ..Image::default()
    }
}

#[test]
fn distances_are_equal_where_that_is_asked_for() {
    for (rows, columns) in [(10, 40), (40, 10), (300, 300)] {
        let ratio = rows as f64 / columns as f64;
        for place in [
            Place::on_paper(&image(rows, columns, true)),
            Place::in_terminal(&image(rows, columns, true), 100, 30),
        ] {
            assert!((place.height / place.width / ratio - 1.0).abs() < 1e-9, "{rows} {columns}");
            assert!(place.left + place.width < place.size.0 && place.top + place.height < place.size.1);
        }
    }
    // stripes stay legible
    let (equal, free) = (Place::on_paper(&image(2, 400, true)), Place::on_paper(&image(2, 400, false)));
    assert_eq!((equal.width, equal.height), (free.width, free.height));
}

#[test]
fn the_bar_ends_where_it_is_asked_to() {
    let svg = draw_image(&image(4, 9, true), Some((-3.0, 5.0)), Medium::Svg).expect("a picture");
    let svg = String::from_utf8(svg).expect("text");
    for label in ["-2", "0", "4", "v [γc_p²]"] {
        assert!(svg.contains(&format!("<title>{label}</title>")), "{label}");
    }
    // ticks are round whatever the ends are
    let ticks = |low, high| Scale { low, high, colours: Colours::Diverging }.ticks(6);
    assert_eq!(ticks(-360.331, 360.331), [-300.0, -200.0, -100.0, 0.0, 100.0, 200.0, 300.0]);
    assert_eq!(ticks(-3.0, 3.0).last(), Some(&3.0));
    // without a range as far on both sides
    let (low, high) = image(4, 9, true).default_range();
    assert!(low == -high && high > 0.9);
    let above = Image { values: vec![0.5, 2.0], ..image(1, 2, false) };
    assert_eq!(above.default_range(), (0.0, 2.0));
}

#[test]
fn diverging_colours_are_as_strong_on_both_sides() {
    let scale = |low, high| Scale { low, high, colours: Colours::Diverging };
    let one = scale(-2.0, 1.0);
    assert_eq!(one.level(-1.0), scale(-1.0, 2.0).level(-1.0));
    assert!(one.level(0.0) == scale(0.0, 7.0).level(0.0) && one.level(1.0) != one.level(-1.0));
    assert_eq!(one.level(-9.0), one.level(-2.0), "beyond the end as the end");
    assert_eq!((one.level(f64::NAN), scale(0.0, 0.0).level(0.0)), (0, 128));
}
