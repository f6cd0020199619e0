//! Results that are not finite end with a message and an exit code that say so.

use glam::DVec3;
use volume3d::io::{Array, Precision, write_npy};

use super::Place;

/// Light that double precision holds, and single precision does not.
const BRIGHT: &str = "<emitter type='constant' id='sky'><rgb name='radiance' value='1e41,1,1'/></emitter>";

#[test]
fn images_and_gradients() {
    let place = Place::with(BRIGHT);
    let lost = "NOT FINITE: 64 of 64 pixels of a.exr, such as column 0, row 0, which is (";
    let text = place.fail("render scene.xml -o a.exr", 1, &[lost, "wrote a.exr"]);
    assert!(text.contains("single precision ends at 3.4e38"), "{text}");
    place.fail("render scene.xml -o a.npy", 1, &["NOT FINITE: 64 of 64 pixels of a.npy"]);
    // A picture ends at 1 in any case.
    place.succeed("render scene.xml -o a.png");

    let place = Place::new();
    for moved in [
        "sheet:translate:1e308,0,0 --method edge",
        "lamp:radiance:1e308,1,1",
        "sheet:translate:1e308,0,0 --method warped-area",
    ] {
        let line = format!("gradient scene.xml --spp 16 --move {moved} -o a.exr");
        place.fail(&line, 1, &["NOT FINITE: ", " of 64 pixels of a.exr"]);
    }
    let array = Array { shape: vec![8, 8, 3], values: vec![1e308; 192] };
    write_npy(&place.path("adj.npy"), &array, Precision::Double).unwrap();
    let reverse = "gradient scene.xml --adjoint adj.npy --wrt sheet.translation -o a.npy";
    place.fail(reverse, 1, &["NOT FINITE: ", " of 3 numbers of a.npy", "wrote a.npy"]);
    place.write_adjoint(vec![DVec3::ONE; 64]);
    place.succeed(&reverse.replace("adj.npy", "adj.exr"));
}

#[test]
fn penalties_and_targets() {
    let place = Place::with(BRIGHT);
    let sheet = "v -500 -500 0\nv 600 -400 0\nv 500 500 1\nv -400 600 0\nf 1 2 3\nf 1 3 4\n";
    std::fs::write(place.path("sheet.obj"), sheet).unwrap();
    let dark = String::from_utf8(place.bytes("scene.xml")).unwrap().replace("1e41,1,1", "1,1,1");
    std::fs::write(place.path("dark.xml"), dark).unwrap();
    let config = |reference: &str, weight: &str| {
        let text = format!(
            "scene = 'dark.xml'\nsteps = 2\ngradient = {{ spp = 1, method = 'interior' }}\n\
             [reference]\nscene = '{reference}.xml'\nspp = 1\n[[parameter]]\nname = 'sheet.vertex_positions'\nrate = 1e-3\n\
             [[regularizer]]\nshape = 'sheet'\nkind = 'laplacian'\nweight = {weight}\n"
        );
        std::fs::write(place.path("fit.toml"), text).unwrap();
    };
    config("scene", "1");
    let text = place.fail("fit fit.toml -o a", 1, &["the target in column 0, row 0 is ("]);
    assert!(text.contains("view `1`"), "{text}");
    // Lengths are finite, and their squares are not.
    config("dark", "1e304");
    place.fail("fit fit.toml -o a", 1, &["step 1: the loss is ", "penalty of regularizers inf: not finite"]);
    config("dark", "1e-6");
    place.succeed("fit fit.toml -o b");
}
