//! The settings of a study as options of `volume3d gradient`.

use volume3d::tune::Setting;

/// The options of `volume3d gradient`.
pub(super) fn options(setting: Setting) -> String {
    match setting {
        Setting::WarpedArea => "--field jump-mean".to_owned(),
        Setting::Softened => "--field softened".to_owned(),
        Setting::AuxiliaryRays => "--field rays".to_owned(),
        Setting::FewRays(rays) => format!("--debias none --aux {rays}"),
        Setting::FiniteDifference(step) => format!("--method finite-difference --step {step:.1e}"),
        named => format!("--method {}", named.method().unwrap_or_default()),
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::gradient::step;
    use crate::method::MethodOptions;

    #[derive(Debug, Parser)]
    #[command(no_binary_name = true)]
    struct Line {
        #[command(flatten)]
        method: MethodOptions,
        #[arg(long, value_parser = step)]
        step: Option<f64>,
    }

    #[test]
    fn options_are_those_of_the_command() {
        for setting in [
            Setting::WarpedArea,
            Setting::EdgeSampling,
            Setting::Softened,
            Setting::Auto,
            Setting::AuxiliaryRays,
            Setting::FewRays(64),
            Setting::Rotation,
            Setting::Interior,
            Setting::FiniteDifference(0.012),
        ] {
            let line = Line::try_parse_from(options(setting).split_whitespace()).unwrap();
            line.method.check("gradient", line.step.is_some()).unwrap();
            let parsed = line.method.estimator(8, 3, line.step);
            assert_eq!(format!("{parsed:?}"), format!("{:?}", setting.estimator(8, 3)));
        }
    }
}
