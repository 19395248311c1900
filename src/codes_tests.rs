use super::*;

#[test]
fn codes_have_the_neighbors_that_they_say() {
    for (text, d, expected) in [
        ("swift", 3, 48.0),
        ("swift:planetary", 3, 48.0),
        ("swift:wendland-c4", 3, 84.9),
        ("swift:wendland-c4,eta=1.1239", 3, 64.0),
        ("gadget4", 3, 64.0),
        ("gizmo", 3, 32.0),
        ("phantom", 3, 57.9),
        ("phantom:hfact=1.0", 3, 33.5),
        // Phantom's kernel_quintic.f90 and kernel_WendlandC4.f90: radkern 3 and 2, hfact_default 1.0 and 1.5.
        ("phantom:quintic", 3, 113.1),
        ("phantom:quintic,hfact=1.1", 3, 150.5),
        ("phantom:quartic", 3, 87.1),
        ("phantom:wendland-c4", 3, 113.1),
        ("pysph", 2, 21.2),
        ("pysph:quintic,hdx=1.0", 2, 28.3),
        // pi 8 and 4/3 pi (2 sqrt 3)^3.
        ("dualsphysics", 2, 25.1),
        ("dualsphysics", 3, 174.1),
        ("dualsphysics:cubic-spline,coefh=1.2", 2, 36.2),
        ("arepo", 3, 64.0),
        ("sph-exa", 3, 100.0),
        ("sph-exa:ng0=150", 3, 150.0),
        ("swift", 2, 15.1),
    ] {
        let found = TargetCode::parse(text).unwrap().kernel_neighbors(d);
        assert!((found - expected).abs() < 0.06, "{text} in {d}-D: {found}");
    }
}

#[test]
fn what_is_not_known_is_refused_with_what_is() {
    for (text, parts) in [
        ("swfit", vec!["no code of the name 'swfit'", "swift, gadget4"]),
        ("swift:wendland", vec!["'wendland' is no kernel", "wendland-c4"]),
        ("swift:eta=0", vec!["eta is '0'", "positive"]),
        ("swift:hfact=1.2", vec!["'hfact' is no option", "eta=NUMBER"]),
        ("swift:scheme=gizmo", vec!["scheme 'gizmo'", "sphenix"]),
        ("gadget2:wendland-c2", vec!["no kernel but cubic spline"]),
        ("sph-exa:wendland-c2", vec!["no kernel but sinc^6"]),
        ("", vec!["no code of the name ''"]),
        ("arepo:wendland-c2", vec!["'wendland-c2' is no option", "AREPO has a mesh"]),
        ("arepo:neighbors=64", vec!["'neighbors=64' is no option", "no kernel"]),
        ("pysph:hfact=1.2", vec!["'hfact' is no option", "hdx=NUMBER"]),
        ("dualsphysics:quintic", vec!["no kernel but Wendland C2 and cubic spline"]),
    ] {
        let error = TargetCode::parse(text).unwrap_err().to_string();
        for part in parts {
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}

#[test]
fn forces_that_differ_are_not_balanced() {
    let of = |text: &str| TargetCode::parse(text).unwrap().unknown_force();
    assert!(of("gizmo").unwrap().contains("GIZMO with mfm"));
    assert!(of("swift:scheme=gasoline").unwrap().contains("sphenix, minimal, planetary"));
    assert!(of("sph-exa").unwrap().ends_with("SPH-EXA with ve are not those that are balanced here"));
    assert_eq!((of("swift"), of("gizmo:scheme=density-sph"), of("phantom")), (None, None, None));
}

#[test]
fn builds_that_make_pairs_are_told_how_not_to() {
    let of = |text: &str| TargetCode::parse(text).unwrap().pairing(3);
    let solid = |text: &str| TargetCode::parse(text).unwrap().pairing_of_solids(3);
    assert!(solid("swift:planetary").unwrap().contains("--for swift:scheme=planetary,wendland-c4"));
    assert_eq!(solid("swift:planetary,wendland-c2"), None);
    assert!(of("gadget4").unwrap().contains("--for gadget4:neighbors=44, with DesNumNgb 44"));
    // With what the one makes of it, the other is told the same.
    for d in [1, 2] {
        let told = TargetCode::parse("gadget4").unwrap().pairing(d).unwrap();
        let number = |after: &str| -> f64 {
            let text = told.split(after).nth(1).unwrap().split([',', ' ']).next().unwrap();
            text.parse().unwrap()
        };
        let code = TargetCode::parse(&format!("gadget4:neighbors={}", number("neighbors="))).unwrap();
        assert_eq!(code.setting_in(d), number("DesNumNgb "), "{told}");
    }
    assert!(of("phantom").unwrap().contains("--for phantom:hfact=1.09"));
    assert_eq!((of("swift"), of("gadget4:neighbors=48"), of("gadget4:wendland-c2")), (None, None, None));
    let near = |text: &str| TargetCode::parse(text).unwrap().nearly_pairing(3);
    assert!(near("swift").unwrap().contains("--for swift:eta=1.2, with SPH:resolution_eta 1.2"));
    assert!(near("gadget4:neighbors=48").is_some());
    for quiet in ["swift:eta=1.2", "swift:wendland-c2", "gadget4:neighbors=44", "phantom:hfact=1.12", "phantom"] {
        assert_eq!(near(quiet), None, "{quiet}");
    }
}

#[test]
fn another_kernel_is_named_with_the_remedy() {
    let swift = TargetCode::of_format("swift").unwrap();
    assert_eq!(swift.mismatch(KernelName::CubicSpline, 3, 48.0), None);
    let text = swift.mismatch(KernelName::WendlandC4, 3, 64.0).unwrap();
    for part in ["Wendland C4 with 64.0", "cubic spline", "--for swift", "resolution_eta to 1.1239"] {
        assert!(text.contains(part), "{text}");
    }
}

/// Numbers of neighbors that a code reads as integers are integers in every dimension, and counts are what it sums with.
#[test]
fn whole_numbers_of_neighbors_are_kept_whole() {
    for name in ["gadget4", "gadget2"] {
        let error = TargetCode::parse(&format!("{name}:neighbors=48.41")).unwrap_err().to_string();
        assert!(error.contains("DesNumNgb") && error.contains("48 or 49"), "{error}");
        for d in 1..=3 {
            let code = TargetCode::parse(&format!("{name}:neighbors=61")).unwrap();
            assert_eq!(code.setting_in(d).fract(), 0.0, "{d}-D");
            assert_eq!(code.setting_in(d), code.kernel_neighbors(d), "{d}-D");
        }
    }
    assert!(TargetCode::parse("gizmo:neighbors=32.5").is_ok());
}
