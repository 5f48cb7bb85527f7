//! The built-in cases: every figure of \[KA\], and some of them in the full theory, a physical case and layered targets, as case
//! files like any other.

macro_rules! cases {
    ($($name:literal),* $(,)?) => {
        /// Name and text of every built-in case, in the order of the paper, those of the full theory, in SI units and of layers last.
        const CASES: &[(&str, &str)] = &[$(($name, include_str!(concat!("builtin/", $name, ".toml")))),*];
    };
}

cases!(
    "fig2",
    "fig2a",
    "fig2-prescribed",
    "fig3",
    "fig4",
    "fig5",
    "fig5-plane",
    "fig6a",
    "fig6b",
    "fig6c",
    "fig6d",
    "fig7a",
    "fig7b",
    "fig8-m2.5",
    "fig8-m5",
    "fig8-m10",
    "fig9-m1",
    "fig9-m2.5",
    "fig9-m5",
    "fig9-m10",
    "fig9-m100",
    "fig9-minf",
    "elastic-fig2",
    "elastic-fig2-prescribed",
    "elastic-fig3",
    "elastic-fig4",
    "elastic-fig5",
    "elastic-fig5-plane",
    "elastic-fig6a",
    "elastic-fig7b",
    "elastic-fig8-m2.5",
    "elastic-fig8-m5",
    "elastic-fig8-m10",
    "ball",
    "laminate-armour",
    "laminate-glass",
    "coating",
    "coating-soft",
    "layers",
);

/// Names of the built-in cases.
pub fn names() -> impl Iterator<Item = &'static str> {
    CASES.iter().map(|(name, _)| *name)
}

/// Text of a built-in case.
pub fn find(name: &str) -> Option<&'static str> {
    CASES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}
