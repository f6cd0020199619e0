//! Derivatives at a bound of a parameter's range.

use super::place::Place;

/// A parameter at a bound of its range is checked from one side, which is said.
#[test]
fn a_check_at_a_bound_is_one_sided() {
    let dark = "<emitter type='constant' id='sky'><rgb name='radiance' value='0 0 1'/></emitter>
        <bsdf type='twosided' id='black'><bsdf type='diffuse'><rgb name='reflectance' value='0 1 1'/></bsdf></bsdf>
        <shape type='cube' id='dark'><transform name='to_world'><scale value='0.3'/></transform><ref id='black'/></shape>";
    let place = Place::with(dark);
    for (change, side, spp) in [
        ("sky:radiance:1,1,1", "from θ to θ + h", 1024),
        ("sky:radiance:-1,-1,-1", "from θ − h to θ", 1024),
        ("black:reflectance:1,1,1", "from θ to θ + h", 4096),
    ] {
        let text = place.succeed(&format!("check scene.xml --move {change} --spp {spp}"));
        assert!(text.contains("ONE-SIDED differences at step 1.7e-2,") && text.contains(side), "{text}");
        assert!(text.contains("AGREE") && text.contains("must be finite and not negative"), "{text}");
        let line = format!("gradient scene.xml --move {change} --method finite-difference -o g.npy --spp 4");
        assert!(place.succeed(&line).contains("ONE-SIDED differences at step 1.0e-3,"));
    }
    let text = place.succeed("tune scene.xml --move sky:radiance:1,1,1 --spp 4");
    assert!(text.contains("ONE-SIDED differences at step 1.7e-3, 5.8e-4, 1.7e-4, from θ to θ + h"), "{text}");
    let text = place.succeed("tune scene.xml --move lamp:radiance:1,1,1 --spp 4");
    assert!(text.contains("--method finite-difference") && !text.contains("ONE-SIDED"), "{text}");
    let (_, text) = place.run("check scene.xml --move lamp:radiance:1,1,1 --spp 16");
    assert!(text.contains("weighted total") && !text.contains("ONE-SIDED"), "{text}");
    place.fail("check scene.xml --move sky:radiance:-1,1,1", 1, &["the radiance of `sky` is -"]);
}
