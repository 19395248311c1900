//! The schema, the help on keys and the full scene: what they say is what scenes can say.

use super::support::{sph_prep, succeed};
use super::wrong::SCENES;
use serde_json::{Value, json};
use sph_prep::Scene;
use sph_prep::scene::reference::{Key, keys};
use std::path::Path;

/// Why a value does not fit a schema; `None` where it does. The words of the standard that our schema uses, and no others.
fn misfit(value: &Value, schema: &Value, root: &Value, path: &str) -> Option<String> {
    let fits = |s: &Value| misfit(value, s, root, path).is_none();
    let wrong = |what: &str| Some(format!("{path}: {value} is not {what}"));
    let (Some(object), true) = (schema.as_object(), true) else {
        return (schema == &Value::Bool(false)).then(|| format!("{path}: nothing is allowed"));
    };
    for (word, rule) in object {
        let fault = match word.as_str() {
            "$ref" => {
                let name = rule.as_str()?.strip_prefix("#/$defs/").unwrap();
                misfit(value, &root["$defs"][name], root, path)
            }
            "type" => {
                let is = |name: &Value| match name.as_str().unwrap() {
                    "null" => value.is_null(),
                    "boolean" => value.is_boolean(),
                    "number" => value.is_number(),
                    "integer" => value.as_f64().is_some_and(|v| v.fract() == 0.0),
                    "string" => value.is_string(),
                    "array" => value.is_array(),
                    "object" => value.is_object(),
                    other => panic!("a type {other}"),
                };
                let any = rule.as_array().map_or_else(|| is(rule), |all| all.iter().any(is));
                if any { None } else { wrong(&rule.to_string()) }
            }
            "enum" => (!rule.as_array().unwrap().contains(value)).then(|| format!("{path}: {value} is none of {rule}")),
            "const" => (rule != value).then(|| format!("{path}: {value} is not {rule}")),
            "anyOf" => {
                (!rule.as_array().unwrap().iter().any(fits)).then(|| format!("{path}: {value} fits none of {rule}"))
            }
            "oneOf" => {
                let count = rule.as_array().unwrap().iter().filter(|s| fits(s)).count();
                (count != 1).then(|| format!("{path}: {value} fits {count} of {rule}"))
            }
            "pattern" => {
                let pattern = regex_lite::Regex::new(rule.as_str().unwrap()).unwrap();
                value.as_str().filter(|t| !pattern.is_match(t)).and_then(|_| wrong(&rule.to_string()))
            }
            "minimum" => value.as_f64().filter(|v| *v < rule.as_f64().unwrap()).and_then(|_| wrong("large enough")),
            "maximum" => value.as_f64().filter(|v| *v > rule.as_f64().unwrap()).and_then(|_| wrong("small enough")),
            "multipleOf" => value.as_f64().filter(|v| v % rule.as_f64().unwrap() != 0.0).and_then(|_| wrong("whole")),
            "minItems" => {
                value.as_array().filter(|v| v.len() < rule.as_u64().unwrap() as usize).and_then(|_| wrong("long"))
            }
            "maxItems" => {
                value.as_array().filter(|v| v.len() > rule.as_u64().unwrap() as usize).and_then(|_| wrong("short"))
            }
            "items" => value.as_array().and_then(|all| {
                all.iter().enumerate().find_map(|(i, v)| misfit(v, rule, root, &format!("{path}[{i}]")))
            }),
            "required" => {
                let missing = |name: &&Value| value.get(name.as_str().unwrap()).is_none();
                value
                    .as_object()
                    .and(rule.as_array().unwrap().iter().find(missing))
                    .map(|n| format!("{path} lacks {n}"))
            }
            "properties" => value
                .as_object()
                .and_then(|all| all.iter().find_map(|(k, v)| misfit(v, rule.get(k)?, root, &format!("{path}.{k}")))),
            "additionalProperties" => value.as_object().and_then(|all| {
                let known = |k: &str| schema["properties"].get(k).is_some();
                all.iter().filter(|(k, _)| !known(k)).find_map(|(k, v)| misfit(v, rule, root, &format!("{path}.{k}")))
            }),
            "$schema" | "$defs" | "title" | "description" | "default" | "examples" | "format" | "x-unit" => None,
            other => panic!("the schema has a word '{other}' that this check does not know"),
        };
        if fault.is_some() {
            return fault;
        }
    }
    None
}

fn check(text: &str) -> Option<String> {
    let value: Value = serde_saphyr::from_str(text).unwrap();
    let schema = Scene::schema();
    misfit(&value, &schema, &schema, "scene")
}

fn bundled() -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles");
    let files = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    let scenes = files.filter(|p| p.extension().is_some_and(|e| e == "yaml"));
    scenes.map(|p| (p.display().to_string(), std::fs::read_to_string(&p).unwrap())).collect()
}

#[test]
fn scenes_that_work_fit_the_schema() {
    let mut scenes = bundled();
    assert!(scenes.len() > 10);
    let mut pages = crate::docs::pages();
    for name in ["README.md", "profiles/README.md", "python/README.md"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        let text = std::fs::read_to_string(&path).unwrap();
        pages.push((path, text));
    }
    let before = scenes.len();
    for (path, text) in &pages {
        let blocks = text.split("```yaml\n").skip(1).map(|b| b.split("```").next().unwrap().to_owned());
        scenes.extend(blocks.map(|b| (path.display().to_string(), b)));
    }
    assert!(scenes.len() > before + 50, "{}", scenes.len() - before);
    for (name, text) in &scenes {
        Scene::parse(text).unwrap_or_else(|e| panic!("{name}: {e}\n{text}"));
    }
    for text in [
        "particles: 1e5",
        "particles: 100k",
        "particles: '2.3M'",
        "balance: true",
        "balance: {evaluations: 100k}",
        "balance: {equation_of_state: at-rest}",
        "domain: {boundary: periodic}",
        "domain: {boundary: [open, periodic]}",
        "domain: {ball: {radius: 1 Rsun, center: [0, 0, 3e10 cm]}}",
        "kernel: null",
        "fields: {velocity: [-y, x, 0], Temperature: 5e3}",
        "map: {vel1: velocity-x}",
    ] {
        Scene::parse(text).unwrap_or_else(|e| panic!("{text}: {e}"));
        scenes.push((text.into(), text.into()));
    }
    let faults: Vec<String> =
        scenes.iter().filter_map(|(name, text)| Some(format!("{name}: {}", check(text)?))).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Other names of keys and words, as the sources state them, are taken by the reader and known to the schema, and no others.
#[test]
fn the_schema_knows_every_name() {
    let printed = Scene::schema().to_string();
    assert!(!printed.contains("x-aliases"), "notes of the program's own");
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut names = 0;
    for folder in ["scene", "seeding"] {
        for file in std::fs::read_dir(sources.join(folder)).unwrap().map(|e| e.unwrap().path()) {
            let text = std::fs::read_to_string(&file).unwrap();
            for name in text.split("alias = \"").skip(1).map(|rest| rest.split('"').next().unwrap()) {
                assert!(printed.contains(&format!("\"{name}\"")), "{}: the schema lacks '{name}'", file.display());
                names += 1;
            }
        }
    }
    assert!(names > 15, "{names}");
    for text in [
        "domain: {rectangle: [[0, 0], [1, 1]]}",
        "domain: {interval: [[0], [1]]}",
        "domain: {sphere: {radius: 1}}",
        "domain: {circle: {center: [0, 0], radius: 1}}",
        "domain: {ellipse: {radii: [1, 2]}}",
        "domain: {union: [{circle: {radius: 1}}, {half-plane: {point: [0, 0], normal: [0, 1]}}]}",
        "seeding: fcc",
        "bodies: [{seeding: bcc}]",
        "input: {profile: {planet: {mass: 1 Mearth, layers: [{material: tillotson_iron}, {material: {ideal_gas: {mean_molecular_weight: 2}}}]}}}",
    ] {
        // The schema takes what the reader takes, where that comes so far.
        let read = Scene::parse(text).map_err(|e| e.to_string());
        let unknown = read.as_ref().is_err_and(|e| e.contains("no key") || e.contains("no choice"));
        assert!(!unknown, "{text}: {read:?}");
        let misfit = check(text).filter(|_| read.is_ok());
        assert!(misfit.is_none(), "{text}: {misfit:?}");
    }
    for text in ["domain: {disk: {radius: 1}}", "seeding: hpc", "domain: {ball: {radius: 1, sphere: 2}}"] {
        assert!(check(text).is_some() && Scene::parse(text).is_err(), "{text}");
    }
    let told = succeed(&["help", "scene.domain.box"]).stdout;
    assert!(told.contains("also") && told.contains("rectangle, interval"), "{told}");
}

#[test]
fn scenes_that_cannot_be_read_do_not_fit_it() {
    let mut refused = 0;
    for (text, _) in SCENES.iter().chain(&[
        ("input: {profile: {polytrop: {n: 1}}}", &[][..]),
        ("input: {profile: {polytrope: {n: 1, mass: 1}}}", &[][..]),
        ("bodies: [{nmae: a}]", &[][..]),
        ("turbulence: {wavenumbers: [1]}", &[][..]),
        ("material: [{radius: 1}]", &[][..]),
    ]) {
        // Those whose text is no YAML, or which are wrong by what they say, are no business of a schema.
        let is_yaml = serde_saphyr::from_str::<Value>(text).is_ok();
        if is_yaml && !text.is_empty() && Scene::parse(text).is_err() {
            assert!(check(text).is_some(), "{text} fits");
            refused += 1;
        }
    }
    assert!(refused > 25, "only {refused} were looked at");
}

/// An object on the way to a key, with what it cannot do without.
fn within(keys: &[Key], path: &[&str], value: &Value) -> Value {
    let mut object = serde_json::Map::new();
    for key in keys {
        if key.name() == path[0] {
            let inner = if path.len() == 1 { value.clone() } else { within(&key.keys, &path[1..], value) };
            let list = path.len() > 1 && key.kind.starts_with("a list");
            object.insert(key.name().into(), if list { json!([inner]) } else { inner });
        } else if key.is_required {
            object.insert(key.name().into(), key.example.clone().unwrap());
        }
    }
    Value::Object(object)
}

#[test]
fn every_key_says_what_it_is_with_unit_default_and_an_example_that_works() {
    let top = keys();
    let all: Vec<&Key> = top.iter().flat_map(Key::all).collect();
    assert!(all.len() > 150, "{}", all.len());
    assert_eq!(top[0].name(), "input", "not in the order in which they are declared");
    let (mut faults, mut quantities) = (Vec::new(), 0);
    for key in &all {
        let path: Vec<&str> = key.path.split('.').collect();
        if key.description.len() < 4 || key.kind.is_empty() {
            faults.push(format!("{}: '{}' ({})", key.path, key.description, key.kind));
        }
        if key.keys.is_empty() && key.example.is_none() {
            faults.push(format!("{}: has no example", key.path));
        }
        if let Some(example) = &key.example {
            let scene = within(&top, &path, example).to_string();
            if let Err(e) = Scene::parse(&scene) {
                faults.push(format!("{}: its example is refused: {e}", key.path));
            }
            faults.extend(check(&scene).map(|e| format!("{}: its example does not fit: {e}", key.path)));
        }
        if key.kind.contains("with its unit") {
            quantities += 1;
            // A unit of another dimension is refused by name where checks of the whole scene come that far.
            let example = key.example.as_ref().map(Value::to_string).unwrap_or_default();
            if key.unit.is_none() || !example.contains(|c: char| c.is_ascii_digit()) {
                faults.push(format!("{}: measures nothing", key.path));
            }
        }
    }
    assert!(quantities > 30, "{quantities}");
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}

/// A unit of another dimension is refused, so that what the schema says a key measures is what the program takes.
#[test]
fn units_are_those_that_the_program_takes() {
    let top = keys();
    let mut seen = 0;
    for key in top.iter().flat_map(Key::all).filter(|k| k.kind.contains("with its unit")) {
        // Bodies are checked as scenes of their own, those of gravity_of as well, and orbits and particle masses with them.
        if ["bodies", "gravity_of", "orbit", "particle_mass"].contains(&key.path.split('.').next().unwrap()) {
            continue;
        }
        let path: Vec<&str> = key.path.split('.').collect();
        let parsed = |value: &Value| {
            let mut scene = within(&top, &path, value);
            if scene["input"].get("profile").is_none() {
                scene["input"]["expression"] = json!("1");
            }
            if scene.get("domain").is_none() {
                scene["domain"] = json!({"box": [[0, 0, 0], [1, 1, 1]]});
            }
            Scene::parse(&scene.to_string()).unwrap().validate().map_err(|e| e.to_string())
        };
        let replaced = key.example.as_ref().unwrap().to_string();
        let is_temperature = key.unit.as_deref() == Some("temperature");
        let (wrong, what) = if is_temperature { ("1 km", "a length") } else { ("1 K", "a temperature") };
        let other: Value = match key.example.as_ref().unwrap() {
            Value::Array(_) if key.name() == "box" => json!([[wrong, 0, 0], [1, 1, 1]]),
            Value::Array(all) => Value::Array(vec![json!(wrong); all.len()]),
            _ => json!(wrong),
        };
        let Err(error) = parsed(&other) else { panic!("{}: {wrong} in place of {replaced} is taken", key.path) };
        let name = if key.name() == "box" { "" } else { key.name() };
        assert!(error.contains(&format!("which is {what}")) && error.contains(name), "{}: {error}", key.path);
        // With its own unit there may be other objections, but none to that.
        let own = parsed(key.example.as_ref().unwrap()).err().unwrap_or_default();
        assert!(!own.contains("which is") && !own.contains("not known"), "{}: {own}", key.path);
        seen += 1;
    }
    assert!(seen > 25, "{seen}");
}

#[test]
fn a_full_scene_has_every_key_and_reads_back_the_same() {
    for (name, text) in bundled().into_iter().chain([("empty".into(), "{}".into())]) {
        let scene = Scene::parse(&text).unwrap();
        let full = scene.to_full_yaml().unwrap();
        let back = Scene::parse(&full).unwrap_or_else(|e| panic!("{name}: {e}\n{full}"));
        assert_eq!(back, scene, "{name}:\n{full}");
        for key in keys() {
            assert!(
                full.lines().any(|l| l.trim_start_matches('#').starts_with(&format!("{}:", key.name()))),
                "{name}: {}",
                key.path
            );
        }
        // A text that the scene has in one piece stays in one.
        let is_text = |l: &&str| l.ends_with('\'') && l.matches('\'').count() == 2;
        let long: Vec<&str> = full.lines().filter(|l| l.len() > 120 && !is_text(l)).collect();
        assert!(long.is_empty(), "{name}: {long:?}");
    }
}

#[test]
fn help_says_what_the_figures_of_a_verdict_mean() {
    let all = succeed(&["help", "numbers"]).stdout;
    let page = include_str!("../../docs/src/numbers.md");
    let mut sections = 0;
    for heading in page.lines().filter_map(|l| l.strip_prefix("## ")) {
        let name = heading.to_lowercase().replace(' ', "-");
        let one = succeed(&["help", &format!("numbers.{name}")]).stdout;
        assert!(one.starts_with(&format!("{heading}\n\n")) && one.len() < all.len(), "{one}");
        assert!(all.contains(&one), "{name} is not in the whole");
        sections += 1;
    }
    assert!(sections > 10 && all.lines().all(|l| l.chars().count() <= 100), "{all}");
    assert_eq!(
        succeed(&["help", "numbers", "force", "noise"]).stdout,
        succeed(&["help", "numbers.force-noise"]).stdout
    );
    let wrong = sph_prep(&["help", "numbers.pair"]);
    assert!(wrong.code == Some(2) && wrong.stderr.contains("did you mean 'pairs'"), "{wrong:?}");
}

/// Points within numbers do not end what is said of a key in a line.
#[test]
fn what_help_says_of_keys_is_not_cut_within_numbers() {
    let help = succeed(&["help", "scene.input.profile"]).stdout;
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in ["0 <= n < 4.99", "0.05 G M/R (Evrard 1988)"] {
        assert!(help.contains(part), "{part}: {help}");
    }
}

#[test]
fn help_leads_from_scenes_to_their_keys() {
    let top = succeed(&["help", "scene"]).stdout;
    for key in keys() {
        assert!(top.contains(&format!("\n  {}", key.name())), "{}", key.name());
    }
    let radius = succeed(&["help", "scene.domain.ball.radius"]).stdout;
    for part in ["scene.domain.ball.radius", "length", "1 Rsun", "has to be stated"] {
        assert!(radius.contains(part), "{part}: {radius}");
    }
    assert_eq!(succeed(&["help", "scene", "domain"]).stdout, succeed(&["help", "scene.domain"]).stdout);
    let polish = succeed(&["help", "scene.polish"]).stdout;
    assert!(polish.contains("solver") && polish.contains("The density solver."), "{polish}");
    assert!(succeed(&["help", "compare"]).stdout.contains("--methods"));
    assert!(succeed(&["help"]).stdout.contains("--print-scene"));
    for (topic, part) in
        [("scene.domian", "did you mean 'domain'"), ("scene.domain.x", "'domain' has box"), ("comparee", "compare")]
    {
        let outcome = sph_prep(&["help", topic]);
        assert!(outcome.code == Some(2) && outcome.stderr.contains(part), "{topic}: {outcome:?}");
    }
    let printed = succeed(&["schema"]).stdout;
    assert_eq!(serde_json::from_str::<Value>(&printed).unwrap(), Scene::schema());
    let full = succeed(&["--print-scene", "--all", "-n", "500"]).stdout;
    assert!(full.contains("\nparticles: 500\n") && full.contains("\n#tolerance: "), "{full}");
}
