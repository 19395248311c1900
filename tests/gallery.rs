//! The gallery of the manual: every scene that comes with the project, with its picture.
//!
//! ```sh
//! SPH_PREP_DOCS=1 cargo test --release --test all -- --ignored draw_the_gallery   # minutes
//! ```
//!
//! `SPH_PREP_DOCS=binary,tank` draws these alone.

use crate::docs::folder;
use std::fmt::Write;
use std::path::Path;

const DRAW: &str = "SPH_PREP_DOCS=1 cargo test --release --test all -- --ignored draw_the_gallery";

/// What a picture may take, so that the repository stays small.
const MOST_BYTES: usize = 30_000;

#[test]
fn the_gallery_has_every_scene_with_its_picture() {
    let gallery = std::fs::read_to_string(folder().join("gallery.md")).unwrap();
    for name in scene_names() {
        let picture = folder().join("gallery").join(format!("{name}.png"));
        let bytes = std::fs::read(&picture).unwrap_or_else(|e| panic!("{}: {e}; {DRAW}", picture.display()));
        assert!(bytes.starts_with(b"\x89PNG") && bytes.len() < MOST_BYTES, "{name}: {} bytes", bytes.len());
        assert!(gallery.contains(&format!("(gallery/{name}.png)")), "the gallery lacks {name}: {DRAW}");
    }
    assert_eq!(gallery, gallery_page(), "docs/src/gallery.md is stale: {DRAW}");
}

#[test]
#[ignore = "minutes: places every scene; writes its picture where SPH_PREP_DOCS is set"]
fn draw_the_gallery() {
    let scratch = tempfile::tempdir().unwrap();
    let kept = std::env::var("SPH_PREP_DOCS").ok();
    let is_kept = kept.is_some();
    let only: Option<Vec<&str>> = kept.as_deref().filter(|k| *k != "1").map(|k| k.split(',').collect());
    for name in scene_names().into_iter().filter(|name| only.as_ref().is_none_or(|o| o.contains(&name.as_str()))) {
        let picture = scratch.path().join(format!("{name}.png"));
        let mut run = assert_cmd::Command::new(env!("CARGO_BIN_EXE_sph-prep"));
        let scene = format!("profiles/{name}.yaml");
        let count = particles_of_picture(&name).map_or(Vec::new(), |count| vec!["-n", count]);
        let arguments = ["--scene", &scene, "--quiet", "--out"];
        run.current_dir(env!("CARGO_MANIFEST_DIR")).args(count).args(arguments).arg(&picture);
        let output = run.output().unwrap();
        assert!(matches!(output.status.code(), Some(0 | 3)), "{name}: {output:?}");
        let small = halved(&std::fs::read(&picture).unwrap());
        assert!(small.len() < MOST_BYTES, "{name}: {} bytes", small.len());
        if is_kept {
            std::fs::write(folder().join("gallery").join(format!("{name}.png")), small).unwrap();
        }
    }
    if is_kept {
        std::fs::write(folder().join("gallery.md"), gallery_page()).unwrap();
    }
}

/// A picture of shades at half its width and height, with fewer shades: each pixel is the mean of those of four that are no ground.
fn halved(picture: &[u8]) -> Vec<u8> {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(picture));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().unwrap();
    let mut shades = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut shades).unwrap();
    let info = reader.info();
    assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Indexed, png::BitDepth::Eight));
    let (width, height) = (info.width as usize, info.height as usize);
    let (palette, opacity) = (info.palette.clone().unwrap(), info.trns.clone().unwrap());
    // The last of the palette is the ground, which shows through.
    let ground = (palette.len() / 3 - 1) as u8;
    let pixel = |i: usize| {
        let (x, y) = (2 * (i % (width / 2)), 2 * (i / (width / 2)));
        let four = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(u, v)| shades[(y + v) * width + x + u]);
        let seen: Vec<u32> = four.into_iter().filter(|s| *s != ground).map(u32::from).collect();
        let mean = || (seen.iter().sum::<u32>() / seen.len() as u32) as u8 & !3;
        if seen.len() < 2 { ground } else { mean() }
    };
    let pixels: Vec<u8> = (0..(width / 2) * (height / 2)).map(pixel).collect();
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, (width / 2) as u32, (height / 2) as u32);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette);
    encoder.set_trns(opacity);
    encoder.set_compression(png::Compression::High);
    encoder.set_filter(png::Filter::NoFilter);
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    out
}

/// Enough to show what it is: a line needs fewer than an area, and an area fewer than a slice of a body. What is made of a snapshot has the
/// number that it stands for.
fn particles_of_picture(name: &str) -> Option<&'static str> {
    match name {
        "sine-1d" => Some("200"),
        "refinement-sphere" | "resample-finer" | "resample-coarser" => None,
        _ => Some("4000"),
    }
}

fn scene_names() -> Vec<String> {
    let entries = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles")).unwrap();
    let paths = entries.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some_and(|e| e == "yaml"));
    let mut names: Vec<String> = paths.map(|p| p.file_stem().unwrap().to_str().unwrap().to_owned()).collect();
    names.sort();
    names
}

fn gallery_page() -> String {
    let mut out = format!(
        "# Gallery\n\n<!-- Written by `{DRAW}`. -->\n\nEvery scene that comes with the project, in `profiles/`. Pictures show the density: slices through \
         bodies, all of what is flat, from dark (low) to light (high). The first lines of a scene say what it is; with its picture:\n\n\
         ```sh\nsph-prep --scene profiles/star-1.5.yaml --out star.png -n 4000\n```\n"
    );
    for name in scene_names() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles").join(format!("{name}.yaml"));
        let text = std::fs::read_to_string(path).unwrap();
        let head: Vec<&str> = text.lines().map_while(|l| l.strip_prefix("# ")).collect();
        let body: Vec<&str> = text.lines().filter(|l| !l.starts_with("# ")).collect();
        let _ = write!(
            out,
            "\n## `{name}.yaml`\n\n{}\n\n![{name}](gallery/{name}.png)\n\n```yaml\n{}\n```\n",
            head.join(" "),
            body.join("\n")
        );
    }
    out
}
