//! Pages and pictures of runs and files: whole documents that fetch nothing, with all sections, units, and hostile names.

use super::support::{Folder, faults, sph_prep, succeed};
use quick_xml::events::Event;
use std::path::Path;

fn text(path: &Path) -> String {
    path.display().to_string()
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The headings and the figures (each the text of its drawing) of a page, after it was found to be well-formed and to fetch
/// nothing.
fn looked_at(html: &str) -> (Vec<String>, Vec<Vec<String>>) {
    let parts: Vec<&str> = html.split("href=\"data:image/png;base64,").collect();
    // What is left without the pictures, whose letters may spell anything.
    let rest = parts[1..].iter().map(|part| part.split_once('"').unwrap().1);
    let fetched =
        [parts[0]].into_iter().chain(rest).collect::<String>().replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    // Links within the page fetch nothing, and lead somewhere.
    let places: Vec<&str> = fetched.split("href=\"#").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    for place in &places {
        assert!(fetched.contains(&format!("id=\"{place}\"")), "{place}");
    }
    let fetched = fetched.replace("href=\"#", "");
    for mark in ["http:", "https:", "src=", "href", "url(", "@import", "<script", "<link", "onerror=\"", "NaN"] {
        assert!(!fetched.contains(mark), "{mark}");
    }
    assert!(html.starts_with("<!DOCTYPE html>\n<html lang=\"en\">"), "{html:.100}");
    assert!(
        html.contains("prefers-color-scheme:dark")
            && html.contains("@media print")
            && html.contains("width=device-width")
    );
    let mut reader = quick_xml::Reader::from_str(html);
    let (mut open, mut headings, mut figures) = (Vec::new(), Vec::new(), Vec::new());
    loop {
        match reader.read_event().unwrap_or_else(|e| panic!("at {}: {e}", reader.buffer_position())) {
            Event::Start(tag) => {
                tag.attributes().for_each(|a| drop(a.unwrap()));
                let name = tag.name().as_ref().to_owned();
                match name.as_str() {
                    "svg" => figures.push(Vec::new()),
                    "h2" => headings.push(String::new()),
                    "text" => figures.last_mut().unwrap().push(String::new()),
                    _ => {}
                }
                open.push(name);
            }
            Event::End(_) => drop(open.pop()),
            Event::Text(part) => {
                let part = part.as_ref().to_owned();
                match open.last().map(String::as_str) {
                    Some("h2") => headings.last_mut().unwrap().push_str(&part),
                    Some("text") => figures.last_mut().unwrap().last_mut().unwrap().push_str(&part),
                    _ => {}
                }
            }
            Event::Eof => break,
            _ => {}
        }
    }
    assert!(open.is_empty(), "left open: {open:?}");
    for texts in &figures {
        // Both axes name what they show and in which unit; the title comes first.
        let with_units = texts.iter().filter(|t| t.contains('[') && t.contains(']')).count();
        assert!(with_units >= 2, "no units: {texts:?}");
    }
    (headings, figures)
}

/// Titles of the figures.
fn titles(figures: &[Vec<String>]) -> Vec<&str> {
    figures.iter().map(|texts| texts[0].as_str()).collect()
}

const STAR: &str = "input: {profile: {polytrope: {n: 1.5, mass: 1 Msun, radius: 1 Rsun}}}\nparticles: 600\nbalance: {evaluations: 20}\ncertify: 0.1\n";
const DISC: &str = "input: {expression: 'exp(-2*r)', dimension: 2}\ndomain: {ball: {center: [0, 0], radius: 1}}\n\
                    particles: 500\nwvt: {iterations: 5}\nmotion: {rotation: [3]}\nmaterial: [{id: 402, radius: 0.5}, {id: 400}]\n";
const LINE: &str = "input: {expression: '1 + 0.5*sin(2*pi*x)', dimension: 1}\ndomain: {box: [[0], [1]], boundary: [periodic]}\nparticles: 100\n";

#[test]
fn the_page_of_a_star_has_everything_with_units() {
    let folder = Folder::new();
    let scene = folder.file("star.yaml", STAR);
    let page = folder.path("out/page.html");
    let out = folder.path("out/ic.hdf5");
    let ran = succeed(&["--scene", &text(&scene), "--out", &text(&out), "--report", &text(&page)]);
    let html = read(&page);
    let (headings, figures) = looked_at(&html);
    let expected = [
        "Pictures",
        "Profile against target",
        "Histograms",
        "On the way",
        "Figures",
        "Plan",
        "Notes",
        "Scene",
        "Units and versions",
    ];
    let missing: Vec<&str> = expected.into_iter().filter(|h| !headings.iter().any(|found| found == h)).collect();
    assert!(missing.is_empty(), "{missing:?} of {headings:?}");
    let titles = titles(&figures);
    for title in [
        "Density: slice through the center, y up",
        "Density: slice through the center, z up",
        "Projection along z",
        "Density error: slice through the center, y up",
        "Density profile",
        "Force noise",
        "Distance of the nearest neighbor",
        "Error against time",
        "Balance against time",
        "Certificate: motion",
        "Certificate: drifts",
    ] {
        assert!(titles.contains(&title), "{title}: {titles:?}");
    }
    let all: String = figures.concat().concat();
    assert!(all.contains("[Rsun]") && all.contains("[g/cm\u{b3}]"), "{all}");
    assert!(html.contains("the kernel cannot follow") && html.contains("class=\"shade\""));
    // The verdict comes first, in the words of the terminal.
    let verdict = ran.stdout.lines().find_map(|l| l.trim().strip_prefix("verdict")).unwrap();
    let words = verdict.split(" (").next().unwrap().trim();
    assert!(html.find(&format!("Verdict: {words}")).unwrap() < html.find("<h2>").unwrap(), "{words}");
    assert!(html.contains("href=\"#mass-in-place\"") && html.contains("<h3 id=\"mass-in-place\">"), "no links");
    assert!(html.contains("sph-prep --scene ") && html.contains(env!("CARGO_PKG_VERSION")));
    assert!(html.contains("polytrope") && html.contains("balance of pressure") || html.contains("mass trimming"));
}

#[test]
fn motion_materials_and_one_dimension_are_shown() {
    let folder = Folder::new();
    let (out, page) = (text(&folder.path("out/ic.hdf5")), folder.path("out/page.html"));
    let disc = folder.file("disc.yaml", DISC);
    succeed(&["--scene", &text(&disc), "--out", &out, "--report", &text(&page), "--quiet"]);
    let html = read(&page);
    let (_, figures) = looked_at(&html);
    let found = titles(&figures);
    assert!(found.starts_with(&["Density and velocity", "Density error", "Materials"]), "{found:?}");
    // At the rim of a disc that turns three times as fast as its radius is long.
    let at = html.find("The longest arrow is ").unwrap() + "The longest arrow is ".len();
    let longest: f64 = html[at..].split(' ').next().unwrap().parse().unwrap();
    assert!((2.5..=3.0).contains(&longest), "{longest}");
    let materials = figures.iter().find(|f| f[0] == "Materials").unwrap();
    assert!(materials.contains(&"400".to_owned()) && materials.contains(&"402".to_owned()), "{materials:?}");
    let line = folder.file("line.yaml", LINE);
    succeed(&["--scene", &text(&line), "--out", &out, "--report", &text(&page), "--quiet"]);
    let (_, figures) = looked_at(&read(&page));
    let found = titles(&figures);
    assert!(found.contains(&"Density profile") && !found.iter().any(|t| t.contains("slice")), "{found:?}");
}

/// What changes from layer to layer is not hidden by a slice along one of them.
#[test]
fn layers_are_shown_in_a_slice_across_them() {
    let folder = Folder::new();
    let (out, page) = (text(&folder.path("out/ic.hdf5")), folder.path("out/page.html"));
    for (name, expression, first) in [("z", "exp(-3*z)", "z up"), ("y", "exp(-3*y)", "y up"), ("none", "1", "y up")] {
        let scene = format!(
            "input: {{expression: '{expression}'}}\ndomain: {{box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic, periodic, {}]}}\n\
             particles: 800\npolish: none\nwvt: {{iterations: 10}}\n",
            if name == "z" { "reflecting" } else { "periodic" }
        );
        let scene = folder.file(&format!("{name}.yaml"), &scene);
        succeed(&["--scene", &text(&scene), "--out", &out, "--report", &text(&page), "--quiet"]);
        let (_, figures) = looked_at(&read(&page));
        assert!(titles(&figures)[0].ends_with(&format!(", {first}")), "{name}: {:?}", titles(&figures));
    }
}

#[test]
fn a_file_is_drawn_to_the_same_bytes_whatever_the_threads() {
    let folder = Folder::new();
    let disc = folder.file("disc.yaml", DISC);
    for name in ["ic.hdf5", "ic.vtu", "ic.npz"] {
        let out = folder.path(&format!("out/{name}"));
        succeed(&["--scene", &text(&disc), "--out", &text(&out), "--quiet"]);
        let pages: Vec<String> = ["1", "4"]
            .iter()
            .map(|threads| {
                let page = out.with_extension("html");
                let mut command = super::support::command();
                command.env("RAYON_NUM_THREADS", threads).args(["plot", &text(&out)]).assert().success();
                read(&page)
            })
            .collect();
        assert_eq!(pages[0], pages[1], "{name}");
        let (headings, figures) = looked_at(&pages[0]);
        assert!(headings.contains(&"Columns".to_owned()) && figures.len() >= 4, "{name}: {headings:?}");
    }
}

#[test]
fn names_are_no_markup() {
    let folder = Folder::new();
    let name = "<img onerror=\"x\">&'<script>";
    let (out, page) = (folder.path(&format!("out/{name}.hdf5")), folder.path("out/page.html"));
    let line = folder.file("line.yaml", LINE);
    succeed(&["--scene", &text(&line), "--out", &text(&out), "--report", &text(&page), "--quiet"]);
    looked_at(&read(&page));
    assert!(read(&page).contains("&lt;img onerror=&quot;x&quot;&gt;&amp;&#39;&lt;script&gt;"));
    succeed(&["plot", &text(&out), "--out", &text(&page)]);
    looked_at(&read(&page));
}

/// Width, height, and how many pixels are not transparent.
fn decoded(path: &Path) -> (u32, u32, usize) {
    let mut decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    let (width, height) = (reader.info().width, reader.info().height);
    (width, height, pixels.chunks(4).filter(|p| p[3] > 0).count())
}

#[test]
fn a_picture_is_drawn_in_place_of_particles_or_of_a_file() {
    let folder = Folder::new();
    for (name, scene, filled) in [("star", STAR, 0.785), ("disc", DISC, 0.785), ("line", LINE, 0.64)] {
        let scene = folder.file(&format!("{name}.yaml"), scene);
        let (picture, out) = (folder.path("out/a.png"), folder.path("out/ic.hdf5"));
        succeed(&["--scene", &text(&scene), "--out", &text(&picture), "--quiet"]);
        let (width, height, shown) = decoded(&picture);
        assert!(width >= 60 && height >= 60, "{name}: {width} x {height}");
        // A disc in its square, less a margin; columns of a wave two thirds as high on average as its crest.
        let share = shown as f64 / f64::from(width * height);
        assert!((0.8 * filled..1.25 * filled).contains(&share), "{name}: {share}");
        succeed(&["--scene", &text(&scene), "--out", &text(&out), "--quiet"]);
        succeed(&["plot", &text(&out), "--out", &text(&picture)]);
        assert!(decoded(&picture).2 > 1000, "{name}");
    }
}

#[test]
fn what_cannot_be_drawn_is_refused_and_leaves_nothing() {
    let folder = Folder::new();
    let line = text(&folder.file("line.yaml", LINE));
    let table = text(&folder.file("star.txt", "# r density\n0 2\n0.5 1.5\n1 0.5\n"));
    let broken = text(&folder.file("cut.hdf5", b"\x89HDF\r\n\x1a\n and no more"));
    let [page, other] = ["out/a.html", "out/a.txt"].map(|n| text(&folder.path(n)));
    let nowhere = text(&folder.path("out/no/a.html"));
    for (arguments, code, words) in [
        (vec!["plot", &table, "--out", &page], 1, vec!["radial profile", "expected particles"]),
        (vec!["plot", &broken, "--out", &page], 1, vec!["cut.hdf5"]),
        (vec!["plot", &table, "--out", &other], 2, vec!["a.txt", ".html", ".png"]),
        (vec!["plot", &table, "--out", &table], 2, vec!["--out"]),
        (
            vec!["--scene", &line, "--out", &page, "--to", "swift", "--report", &page],
            2,
            vec!["output.report", "output file"],
        ),
        (vec!["--scene", &line, "--out", &page, "--to", "swift", "--report", &nowhere], 1, vec!["out/no"]),
    ] {
        let outcome = sph_prep(&arguments);
        assert_eq!(faults(&outcome, &folder, code, &words), Vec::<String>::new(), "{arguments:?}: {outcome:?}");
    }
    // An older page stays where the run fails.
    std::fs::write(&page, "older").unwrap();
    let out = text(&folder.path("out/ic.hdf5"));
    let outcome = sph_prep(&["--scene", &line, "--out", &out, "--report", &page, "--no-clobber"]);
    assert!(outcome.code == Some(2) && outcome.stderr.contains("output.report"), "{outcome:?}");
    assert_eq!(read(Path::new(&page)), "older");
}

#[test]
fn bodies_have_a_page_with_a_verdict_each() {
    let folder = Folder::new();
    let scene = "bodies:\n- {name: a<b, input: {expression: '1', dimension: 2}, domain: {ball: {center: [0, 0], radius: 1}}, particles: 200, position: [-2, 0], velocity: [0, 1]}\n\
                 - {name: second, input: {expression: '1', dimension: 2}, domain: {ball: {center: [0, 0], radius: 1}}, particles: 200, position: [2, 0], velocity: [0, -1]}\n";
    let scene = folder.file("bodies.yaml", scene);
    let (out, page) = (folder.path("out/ic.hdf5"), folder.path("out/page.html"));
    succeed(&["--scene", &text(&scene), "--out", &text(&out), "--report", &text(&page), "--quiet"]);
    let html = read(&page);
    let (headings, figures) = looked_at(&html);
    assert!(html.contains("a&lt;b: ") && html.contains("<p>second: "), "{html:.3000}");
    assert!(titles(&figures).contains(&"Density and velocity"), "{:?}", titles(&figures));
    assert!(headings.contains(&"Report".to_owned()), "{headings:?}");
}

/// The recipe in the file does not depend on whether a page is made of it.
#[test]
fn a_page_does_not_change_the_particles() {
    let folder = Folder::new();
    let line = text(&folder.file("line.yaml", LINE));
    let [with, without, page] = ["out/a.hdf5", "out/b.hdf5", "out/page.html"].map(|n| folder.path(n));
    succeed(&["--scene", &line, "--out", &text(&with), "--report", &text(&page), "--quiet"]);
    succeed(&["--scene", &line, "--out", &text(&without), "--quiet"]);
    assert_eq!(std::fs::read(with).unwrap(), std::fs::read(without).unwrap());
}
