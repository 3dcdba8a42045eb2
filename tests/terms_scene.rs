//! Factors of terms in scenes: keys of `[model]` that come from the list of terms.

use std::path::Path;

use monolayer::model::terms::factor;
use monolayer::scene::{Scene, SceneSource};

const SCENE: &str = include_str!("data/strip.toml");

fn with(changes: &[(&str, &str)]) -> Result<Scene, String> {
    let mut source = SceneSource::parse(SCENE, Path::new("strip.toml")).map_err(|error| error.to_string())?;
    changes.iter().try_for_each(|(key, value)| source.set(key, value)).map_err(|error| error.to_string())?;
    Scene::check(source).map_err(|error| error.to_string())
}

#[test]
fn every_factor_can_be_given_and_is_written_back() {
    for (factor, [incompressible, _]) in factor::all().filter(|(_, kinds)| kinds[0]) {
        assert!(incompressible);
        let key = format!("model.{}", factor.key);
        let scene = with(&[(&key, "0.25")]).unwrap();
        assert_eq!(scene.parameters.factors.of(factor.key), 0.25);
        let again = Scene::parse(&scene.resolved_toml(), Path::new("again.toml")).unwrap();
        assert_eq!(again.parameters, scene.parameters);
        let on = |scene: &Scene| {
            let reason = format!("{} = ", factor.key);
            scene.terms().iter().find(|term| term.reason.starts_with(&reason)).map(|term| term.on)
        };
        assert_eq!((on(&scene), on(&with(&[]).unwrap())), (Some(true), Some(false)), "{}", factor.key);
        for (value, rule) in [("nan", "must be finite"), ("inf", "must be finite"), ("1e300", "must lie between")] {
            let error = with(&[(&key, value)]).unwrap_err();
            assert!(error.contains(&key) && error.contains(rule), "{error}");
        }
        let error = with(&[(&key, "\"fast\"")]).unwrap_err();
        assert!(error.contains(&key) && error.contains("expected a number"), "{error}");
        // formulas know it
        let formula = format!("[\"{}\", \"0\"]", factor.key);
        assert!(with(&[(&key, "0.25"), ("source.polarity", &formula)]).is_ok());
        let mistyped = format!("model.{}x", factor.key);
        let error = with(&[(&mistyped, "1")]).unwrap_err();
        assert!(error.contains(&format!("did you mean `{}`?", factor.key)), "{error}");
    }
}

#[test]
fn an_unknown_key_of_the_model_names_all_that_exist() {
    let error = with(&[("model.zzz", "1")]).unwrap_err();
    for key in factor::all().map(|(factor, _)| factor.key).chain(["kind", "friction", "peclet"]) {
        assert!(error.contains(key), "{key} is not in: {error}");
    }
}
