//! 3MF packages made up for the tests: `package` zips parts, `model` wraps objects and build items.

use super::{Limits, RawMesh, Unit, parse};
use crate::error::{Error, Result};
use crate::job::Job;
use std::io::Write;

pub(super) fn package(parts: &[(&str, &str)]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut zip = rawzip::ZipArchiveWriter::new(&mut out);
    for (name, text) in parts {
        let new = zip.new_file(name).compression_method(rawzip::CompressionMethod::DEFLATE);
        let (mut entry, config) = new.start().unwrap();
        let encoder = flate2::write::DeflateEncoder::new(&mut entry, flate2::Compression::default());
        let mut writer = config.wrap(encoder);
        writer.write_all(text.as_bytes()).unwrap();
        let (encoder, descriptor) = writer.finish().unwrap();
        encoder.finish().unwrap();
        entry.finish(descriptor).unwrap();
    }
    zip.finish().unwrap();
    out
}

const RELS: &str = r#"<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/Metadata/thumbnail.png" Id="r1" Type="http://x/thumbnail"/>
<Relationship Target="/3D/a.model" Id="r0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>"#;

fn model(attributes: &str, objects: &str, items: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<model {attributes} xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06">
<metadata name="Title">&lt;vertex&gt;</metadata><resources><basematerials id="9"><base name="a" displaycolor="\#fff"/></basematerials>
{objects}</resources><build>{items}</build></model>"#
    )
}

/// A triangle (0 0 0), (1 0 0), (0 1 0) as an object.
fn triangle(id: u32, attributes: &str) -> String {
    format!(
        r#"<object id="{id}" {attributes}><mesh><vertices><vertex x="0" y="0" z="0"/><vertex z="0.0" x="1" y="0" /><vertex x="0" y="1e0" z="0"></vertex></vertices>
<triangles><triangle v1="0" v2="1" v3="2" pid="9" p1="0"/></triangles></mesh></object>"#
    )
}

pub(super) fn simple() -> Vec<u8> {
    let text = model(r#"unit="inch""#, &triangle(1, ""), r#"<item objectid="1"/>"#);
    package(&[("[Content_Types].xml", "<Types/>"), ("_rels/.rels", RELS), ("3D/a.model", &text)])
}

fn read(bytes: &[u8]) -> Result<RawMesh> {
    parse(bytes, "3mf", &Limits::default(), &Job::default())
}

fn read_model(text: &str) -> Result<RawMesh> {
    read(&package(&[("_rels/.rels", RELS), ("3D/a.model", text)]))
}

fn message(result: Result<RawMesh>) -> String {
    match result {
        Err(Error::Format(m)) => m,
        other => panic!("{other:?}"),
    }
}

const CORNERS: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

#[test]
fn a_plain_model_with_its_unit() {
    let mesh = read(&simple()).unwrap();
    assert_eq!(
        mesh,
        RawMesh { positions: CORNERS.into(), triangles: vec![[0, 1, 2]], unit: Unit::Inch, warnings: vec![] }
    );
    assert_eq!(mesh.unit.millimetres(), Some(25.4));
    // Millimetres are what the specification says when the file does not; without relationships the usual name counts.
    let text = model("", &triangle(1, ""), r#"<item objectid="1"/>"#);
    assert_eq!(read(&package(&[("3D/3dmodel.model", &text)])).unwrap().unit, Unit::Millimetre);
    // A prefix for the core namespace.
    let prefixed = text.replace("</", "</c:").replace("<", "<c:").replace("<c:/c:", "</c:").replace("<c:?", "<?");
    let prefixed = prefixed.replace("xmlns=", "xmlns:c=");
    assert_eq!(read_model(&prefixed).unwrap().triangles, [[0, 1, 2]]);
}

#[test]
fn items_and_components_are_transformed_inner_first() {
    // The component turns x to y and shifts by 10 in x; the item scales by 2 and shifts by 100 in z.
    let objects = triangle(1, "")
        + r#"<object id="2"><components><component objectid="1" transform="0 1 0 -1 0 0 0 0 1 10 0 0"/><component objectid="1"/></components></object>"#;
    let items = r#"<item objectid="2" transform="2 0 0 0 2 0 0 0 2 0 0 100"/><item objectid="1"/>"#;
    let mesh = read_model(&model("", &objects, items)).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5], [6, 7, 8]]);
    assert_eq!(mesh.positions[..3], [[20.0, 0.0, 100.0], [20.0, 2.0, 100.0], [18.0, 0.0, 100.0]]);
    assert_eq!(mesh.positions[3..6], [[0.0, 0.0, 100.0], [2.0, 0.0, 100.0], [0.0, 2.0, 100.0]]);
    assert_eq!(mesh.positions[6..], CORNERS);
}

#[test]
fn a_mirror_keeps_the_outside_outside() {
    let item = r#"<item objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>"#;
    let mesh = read_model(&model("", &triangle(1, ""), item)).unwrap();
    assert_eq!(mesh.positions[1], [-1.0, 0.0, 0.0]);
    assert_eq!(mesh.triangles, [[0, 2, 1]]);
}

#[test]
fn objects_in_other_parts_are_followed() {
    let start = model(
        r#"requiredextensions="p""#,
        r#"<object id="1"><components><component p:path="/3D/Objects/B.model" objectid="1"/><component p:path="/3d/objects/b.model" objectid="2"/></components></object>"#,
        r#"<item objectid="1" p:UUID="0"/>"#,
    );
    let other = model("", &(triangle(1, "") + &triangle(2, "")), "");
    let files = [("_rels/.rels", RELS), ("3D/a.model", &start), ("3D/Objects/B.model", &other)];
    assert_eq!(read(&package(&files)).unwrap().triangles, [[0, 1, 2], [3, 4, 5]]);
    assert!(message(read(&package(&files[..2]))).contains("no part '3d/objects/b.model'"));
    let inches = other.replace("<model ", r#"<model unit="inch" "#);
    let m = message(read(&package(&[files[0], files[1], ("3D/Objects/B.model", &inches)])));
    assert!(m.contains("different units"), "{m}");
}

#[test]
fn only_what_is_built_and_solid_counts() {
    let objects = triangle(1, "") + &triangle(2, r#"type="support""#) + &triangle(3, r#"type="surface""#);
    let items = r#"<item objectid="2"/><item objectid="3"/>"#;
    let mesh = read_model(&model("", &objects, items)).unwrap();
    assert_eq!((mesh.triangles.len(), mesh.warnings.len()), (1, 1));
    assert!(matches!(read_model(&model("", &objects, "")), Err(Error::Empty(_))));
}

#[test]
fn an_index_does_not_reach_into_another_object() {
    let bad = triangle(1, "").replace(r#"v3="2""#, r#"v3="3""#);
    let mesh =
        read_model(&model("", &(bad + &triangle(2, "")), r#"<item objectid="1"/><item objectid="2"/>"#)).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, u32::MAX], [3, 4, 5]]);
}

#[test]
fn components_that_double_at_every_level_are_refused_quickly() {
    let mut objects = triangle(1, "");
    for id in 2..60 {
        let child = format!(r#"<component objectid="{}"/>"#, id - 1);
        objects += &format!(r#"<object id="{id}"><components>{child}{child}</components></object>"#);
    }
    let start = std::time::Instant::now();
    let m = message(read_model(&model("", &objects, r#"<item objectid="59"/>"#)));
    assert!(m.contains("expands to 288230376151711744 triangles"), "{m}");
    // Without triangles there is nothing to expand, and nothing to visit either.
    let empty = objects.replace("<triangle ", "<triangel ");
    assert!(matches!(read_model(&model("", &empty, r#"<item objectid="59"/>"#)), Err(Error::Empty(_))));
    assert!(start.elapsed().as_secs() < 5);
}

#[test]
fn cycles_and_deep_nesting_are_refused() {
    let part = |id: u32, child: u32| {
        format!(r#"<object id="{id}"><components><component objectid="{child}"/></components></object>"#)
    };
    let m = message(read_model(&model("", &(part(1, 2) + &part(2, 1)), r#"<item objectid="1"/>"#)));
    assert!(m.contains("component of itself"), "{m}");
    for order in [false, true] {
        // Innermost first, the heights are known before the depth is; outermost first, it is the other way round.
        let ids: Vec<u32> = if order { (2..100_000).collect() } else { (2..100_000).rev().collect() };
        let objects = ids.iter().fold(triangle(1, ""), |text, &id| text + &part(id, id - 1));
        let items: String = (1..1000).map(|i| format!(r#"<item objectid="{}"/>"#, i * 50)).collect();
        let m = message(read_model(&model("", &objects, &items)));
        assert!(m.contains("nested more than 64 deep"), "{m}");
    }
}

#[test]
fn a_bomb_is_refused_by_what_it_unpacks_to() {
    let text = model("", &(triangle(1, "") + &" ".repeat(100 << 20)), r#"<item objectid="1"/>"#);
    let bytes = package(&[("_rels/.rels", RELS), ("3D/a.model", &text)]);
    assert!(bytes.len() < 1 << 20, "{}", bytes.len());
    let m = message(read(&bytes));
    assert!(m.contains("zip bomb"), "{m}");
    let limits = Limits { expanded_bytes: 300, ..Limits::default() };
    assert!(message(parse(&simple(), "", &limits, &Job::default())).contains("zip bomb"));
}

#[test]
fn what_is_no_package_or_not_understood_is_told() {
    assert!(message(read(b"not a zip")).contains("not a 3MF file"));
    assert!(message(read(b"PK\x03\x04 cut off")).contains("zip"));
    assert!(message(read(&package(&[("a.txt", "hello")]))).contains("without a 3MF model"));
    let ok = model("", &triangle(1, ""), r#"<item objectid="1"/>"#);
    for (from, to, wanted) in [
        (r#"objectid="1""#, r#"objectid="7""#, "object 7, which is missing"),
        (r#"objectid="1""#, "", "without objectid"),
        (r#"y="1e0""#, r#"y="1,5""#, "decimal comma"),
        (r#"y="1e0""#, "", "line 4: a vertex without"),
        (r#"v1="0""#, r#"v1="-1""#, "line 5: a corner is '-1'"),
        (r#"v1="0""#, "", "a triangle without"),
        ("</model>", "", "ends early"),
        ("</triangles>", "</triangle>", "3d/a.model, line"),
        ("model ", "modell ", "not 'model'"),
        ("<model", r#"<model unit="parsec""#, "unknown unit"),
        ("<model", r#"<model requiredextensions="q" xmlns:q="http://lattice""#, "extension 'http://lattice'"),
        (r#"objectid="1""#, r#"objectid="1" transform="1 2 3""#, "3 numbers, not 12"),
        (r#"id="1""#, "", "without id"),
    ] {
        let m = message(read_model(&ok.replacen(from, to, 1).replace("</modell", "</model")));
        assert!(m.contains(wanted), "{to}: {m}");
    }
    let twice = ok.replacen("</resources>", &(triangle(1, "") + "</resources>"), 1);
    assert!(message(read_model(&twice)).contains("two objects"));
}

#[test]
fn a_damaged_entry_fails_its_checksum() {
    let mut bytes = simple();
    // The name also stands in the central directory, later: take the local entry's data behind the first one.
    let at = bytes.windows(10).position(|w| w == b"3D/a.model").unwrap() + 60;
    bytes[at] ^= 0x10;
    assert!(message(read(&bytes)).contains("damaged"));
}
