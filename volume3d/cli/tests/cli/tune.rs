//! `volume3d tune`: what it measures, what it says, and that time decides nothing but how far it goes.

use std::collections::BTreeMap;

use super::Place;

/// The rows of a CSV by setting and samples, without what the clock says.
fn rows(place: &Place, name: &str) -> BTreeMap<(String, usize), BTreeMap<String, String>> {
    let bytes = place.bytes(name);
    let mut table = csv::Reader::from_reader(&bytes[..]);
    let mut all = BTreeMap::new();
    for row in table.deserialize::<BTreeMap<String, String>>() {
        let mut row = row.unwrap();
        row.remove("seconds").unwrap();
        let samples = row["spp"].parse().unwrap_or(0);
        all.insert((row["setting"].clone(), samples), row);
    }
    all
}

const MOVED: &str = "tune scene.xml --move sheet:translate:1,0,0";

/// Of a sheet that moves before a wall: the interior term alone and a few rays as they are must come out
/// biased, and what is unbiased must not.
#[test]
fn bias_is_seen_where_it_is_and_nowhere_else() {
    let place = Place::new();
    let targets = "--seconds 0.5,1e-9 --error 0.2,1e-9";
    let text = place.succeed(&format!("{MOVED} --spp 128 {targets} --seed 4 -o tune.svg --csv tune.csv"));
    let rows = rows(&place, "tune.csv");
    let number = |setting: &str, column: &str| -> f64 {
        rows[&(setting.to_owned(), 128)][column].parse().unwrap_or_else(|_| panic!("{setting} {column}"))
    };
    let z = |setting: &str| {
        let of = |column: &str, expected: f64| {
            (number(setting, column) - expected) / number(setting, &format!("{column}_error"))
        };
        (of("slope", 1.0), of("relative_bias2", 0.0))
    };
    for unbiased in ["--field jump-mean", "--field softened", "--field rays", "--method edge"] {
        let (slope, bias2) = z(unbiased);
        // What the command itself calls resolved, of 16 runs.
        assert!(slope.abs() < 4.0 && bias2 < 4.0, "{unbiased}: {slope} {bias2}\n{text}");
        // Or the assertion would hold for noise alone.
        assert!(number(unbiased, "slope_error") < 0.2, "{unbiased}\n{text}");
    }
    for biased in ["--method interior", "--debias none --aux 4"] {
        let (slope, bias2) = z(biased);
        assert!(slope < -4.0 && bias2 > 4.0, "{biased}: {slope} {bias2}\n{text}");
    }
    assert!(!text.contains("is unbiased by proof"), "{text}");
    for words in [
        "reference: --",
        "noise by pixel filter",
        "tent 1.00 (the scene's)",
        "every setting takes longer",
        "has a larger bias",
        "wrote tune.svg",
        "wrote tune.csv",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let svg = String::from_utf8(place.bytes("tune.svg")).unwrap();
    assert!(svg.contains("--method edge") && svg.ends_with("</svg>\n"), "{svg}");

    // What is named can be pasted, and errs as was said; noise of one run of 64 pixels is far below a half of
    // itself.
    let lines: Vec<&str> = text.lines().filter_map(|l| l.strip_prefix("  volume3d ")).collect();
    assert_eq!(lines.len(), 2, "{text}");
    for line in lines {
        assert!(line.starts_with("gradient scene.xml --move sheet:translate:1,0,0 --"), "{line}");
        place.succeed(line);
    }
    assert!(place.path("gradient.exr").exists());
}

#[test]
fn time_and_threads_decide_no_number() {
    let place = Place::new();
    let run = |options: &str| {
        place.succeed(&format!("{MOVED} --csv tune.csv {options}"));
        rows(&place, "tune.csv")
    };
    let first = run("--spp 6 --threads 1");
    assert_eq!(first, run("--spp 6 --threads 3"));
    assert_ne!(first, run("--spp 6 --seed 1"));
    assert!(first.keys().any(|(_, samples)| *samples == 6) && first.keys().all(|(_, samples)| *samples <= 6));
    // A budget may choose another reference, which variances do not ask.
    let within = run("--budget 3");
    let mut common = 0;
    for (key, row) in &first {
        if let Some(other) = within.get(key) {
            assert_eq!(
                (&row["variance"], &row["variance_error"]),
                (&other["variance"], &other["variance_error"])
            );
            common += 1;
        }
    }
    assert!(common >= 12, "{common} rows of {} and {}", first.len(), within.len());
}

#[test]
fn what_is_refused_is_listed_and_differences_take_its_place() {
    let bulb = "<emitter type='point' id='bulb'><point name='position' value='0,0,2'/></emitter>";
    let text = Place::with(bulb).succeed(&format!("{MOVED} --spp 64 --error 0.9"));
    assert!(text.contains("refused: --method edge: ") && text.contains("`bulb`"), "{text}");
    assert!(!text.contains("no unbiased method supports this scene"), "{text}");
    let beam = "<emitter type='spot' id='beam'><transform name='to_world'><lookat origin='0,0,2' target='0,0,0' up='0,1,0'/></transform>
      <float name='cutoff_angle' value='12'/><float name='beam_width' value='12'/></emitter>";
    let text = Place::with(beam).succeed(&format!("{MOVED} --spp 64 --error 0.9"));
    for words in ["refused: --method edge: ", "`beam`", "WARNING: no unbiased method supports this scene"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert!(text.contains("--method finite-difference --step") && text.contains("--spp"), "{text}");
}

#[test]
fn without_geometry_one_method_stands_for_all() {
    let text = Place::new().succeed("tune scene.xml --move lamp:radiance:1,1,1 --spp 8");
    assert!(text.contains("--field jump-mean") && !text.contains("--method edge"), "{text}");
}

#[test]
fn what_cannot_be_tuned_says_why() {
    let behind =
        "<shape type='cube' id='behind'><transform name='to_world'><translate z='90'/></transform></shape>";
    let place = Place::with(behind);
    let before = place.bytes("scene.xml");
    let cases = [
        ("tune scene.xml", 2, "say what changes: --move"),
        ("tune scene.xml --move sheat:translate:1,0,0", 1, "did you mean `sheet`"),
        (&format!("{MOVED} -o a.png"), 1, "the picture is written as .svg"),
        (&format!("{MOVED} --csv a.txt"), 1, "the table is written as .csv"),
        (&format!("{MOVED} --csv none/a.csv"), 1, "there is no folder none"),
        (&format!("{MOVED} --budget 0"), 2, "positive"),
        (&format!("{MOVED} --budget -3"), 2, "positive"),
        (&format!("{MOVED} --error nan"), 2, "positive"),
        (&format!("{MOVED} --seconds 1,,2"), 2, "positive"),
        (&format!("{MOVED} --spp 4 --budget 9"), 2, "cannot be used with"),
        ("tune scene.xml --move sheet:translate:0,0,0 --spp 1", 1, "NOTHING CHANGES"),
        ("tune scene.xml --move behind:translate:1,0,0 --spp 1", 1, "NOTHING CHANGES"),
        (&format!("{MOVED} --budget 1e-9"), 3, "OPEN: "),
        ("tune none.xml --move sheet:translate:1,0,0", 1, "cannot read none.xml"),
    ];
    for (line, code, words) in cases {
        place.fail(line, code, &[words]);
    }
    assert_eq!(place.bytes("scene.xml"), before);
}
