//! Model `elastic`: cases whose scheme would not be stable are refused, and say why. Its spectrum is tested beside the scheme.

use percuss::{case::Case, model::elastic::largest_damping};

/// Problems of the flat punch on a layer in the full theory, or its damping.
fn damping(overrides: &[&str]) -> Result<f64, String> {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    let settings = [vec!["model=elastic".to_owned()], overrides].concat();
    let case = Case::load("fig5", &settings);
    case.map(|case| case.mesh.damping).map_err(|errors| format!("{errors:?}"))
}

#[test]
fn damping_is_what_the_target_bears() {
    assert_eq!(damping(&[]), Ok(0.5));
    assert_eq!(damping(&["mesh.damping=0.8"]), Ok(0.8));
    // the default is less where 0.5 is not stable
    let default = damping(&["target.shear_wave_speed=0.86"]);
    assert_eq!(default, Ok(largest_damping(0.86)));
    let error = damping(&["target.shear_wave_speed=0.86", "mesh.damping=0.5"]).expect_err("not stable");
    for part in ["`mesh.damping` = 0.5 is not stable at c_s/c_p = 0.86", "≤ 0.2403"] {
        assert!(error.contains(part), "{error}");
    }
    assert!(damping(&["target.shear_wave_speed=0.86", "mesh.damping=0.2403"]).is_ok());
    assert!(damping(&["mesh.damping=0.9"]).is_err());
}

#[test]
fn layers_of_a_few_rows_are_refused() {
    let thin = ["mesh.cells=20", "target.thickness=0.1"];
    let error = damping(&thin).expect_err("two rows");
    assert!(error.contains("the layer has 2 rows of cells"), "{error}");
    assert!(damping(&["mesh.cells=40", "target.thickness=0.1"]).is_ok());
}
