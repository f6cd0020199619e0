//! Cameras and films.

use glam::{DQuat, DVec2, DVec3};

/// A camera with an orthonormal frame: a pinhole, or a thin lens.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Where the pinhole is, or the middle of the lens.
    pub origin: DVec3,
    /// Unit vector to the right of the image.
    pub right: DVec3,
    /// Unit vector to the top of the image.
    pub up: DVec3,
    /// Unit vector into the scene.
    pub forward: DVec3,
    /// The field of view of the whole film's width, radians, in (0, π), as if the axis met its middle: f_x = (W/2)/tan(fov/2) pixels.
    pub field_of_view: f64,
    /// Where the axis meets the film, from its middle, in parts of its width and height, x to the right and y down. 0 unless pictures were cut, or a lens
    /// was measured.
    pub principal_point: DVec2,
    /// f_y/f_x, positive: by how many more pixels the same angle is shown along columns than along rows. 1 for square pixels.
    pub pixel_aspect: f64,
    /// The lens; nothing for a pinhole, before which all is sharp.
    pub lens: Option<Lens>,
    /// How far before [`origin`](Self::origin) the sensor is, if this is an orthographic sensor, for which a
    /// camera far behind it stands: the camera turns about the sensor, and has no field of view that could
    /// change. Nothing for a perspective camera.
    pub orthographic: Option<f64>,
}

/// A thin lens: an ideal one, a disc across the camera's axis.
///
/// The image is the mean of those of pinholes all over the disc, uniform by area, whose image planes are shifted so that
/// they agree at the distance in focus: a film point sees one point there through all of them. What is at a depth z
/// spreads over a disc on the film, the circle of confusion, whose radius is f·radius·|1/z − 1/focus_distance| pixels, with f
/// the focal length in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// The radius of the disc, in the scene's units, positive.
    pub radius: f64,
    /// How deep, along the camera's axis, is what is sharp; positive.
    pub focus_distance: f64,
}

impl Camera {
    /// The same elsewhere.
    pub(super) fn moved(&self, by: DVec3) -> Self {
        Self { origin: self.origin + by, ..self.clone() }
    }

    /// A camera at `origin` that looks at `target`, with the horizontal field of view in radians.
    #[must_use]
    pub fn look_at(origin: DVec3, target: DVec3, up: DVec3, field_of_view: f64) -> Self {
        let forward = (target - origin).normalize_or(DVec3::NEG_Z);
        let right = forward.cross(up).normalize_or(forward.any_orthonormal_vector());
        let (principal_point, pixel_aspect) = (DVec2::ZERO, 1.0);
        Self {
            origin,
            right,
            up: right.cross(forward),
            forward,
            field_of_view,
            principal_point,
            pixel_aspect,
            lens: None,
            orthographic: None,
        }
    }

    /// What the camera turns about: its origin, or the middle of an orthographic sensor.
    #[must_use]
    pub fn pivot(&self) -> DVec3 {
        self.origin + self.orthographic.unwrap_or(0.0) * self.forward
    }

    /// The same turned about its pivot.
    #[must_use]
    pub fn turned(&self, turn: DQuat) -> Self {
        let [right, up, forward] = [self.right, self.up, self.forward].map(|axis| turn * axis);
        let turned = Self { right, up, forward, ..self.clone() };
        match self.orthographic {
            None => turned,
            Some(distance) => Self { origin: self.pivot() - distance * forward, ..turned },
        }
    }
}

/// The reconstruction filter h of a pixel, a function of the distance to its centre in pixels along each
/// axis, with ∫∫ h = 1.
///
/// Samples fall evenly on the film and count with the weight h, below 0 where h is: the image and its
/// derivatives stay unbiased. What a filter does to their noise goes by (∫h²)² for the image, and by ∫h′²
/// ∫h² for the part of the area in derivatives: a tent of radius 1 has 0.44 and 1.33, the Gaussian of
/// deviation ½ 0.32 and 0.64, Mitchell's and Netravali's filter (B = C = ⅓) 0.46 and 1.11, Catmull's and
/// Rom's 0.66 and 1.90, and Lanczos's of three lobes 0.80 and 2.27.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// 1 within the pixel.
    Box,
    /// max(0, 1 − |x|/r)/r along each axis.
    Tent {
        /// r.
        radius: f64,
    },
    /// e^{−x²/2σ²} cut off and shifted to 0 at 4σ, as in Mitsuba 3.
    Gaussian {
        /// σ.
        deviation: f64,
    },
    /// The cubic splines of Mitchell and Netravali (1988), of radius 2: in three pieces, negative beyond 1.
    /// With B = 0 and C = ½ it is that of Catmull and Rom, which goes through the values at pixels'
    /// centres.
    Cubic {
        /// B: how much is blurred.
        b: f64,
        /// C: how much edges ring.
        c: f64,
    },
    /// sinc(x) sinc(x/a)/I of radius a, with its integral I, negative in every second lobe.
    Lanczos {
        /// a, from 1 to 16.
        lobes: u32,
    },
}

impl Filter {
    /// How far from a pixel's centre it is 0 along each axis.
    #[must_use]
    pub fn radius(&self) -> f64 {
        match *self {
            Self::Box => 0.5,
            Self::Tent { radius } => radius,
            Self::Gaussian { deviation } => GAUSSIAN_CUT * deviation,
            Self::Cubic { .. } => 2.0,
            Self::Lanczos { lobes } => f64::from(lobes),
        }
    }
}

/// Mitsuba 3 cuts its Gaussian off at this many standard deviations.
pub(crate) const GAUSSIAN_CUT: f64 = 4.0;

/// Part of a film, in pixels from its top left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// The first column.
    pub x: usize,
    /// The first row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// A film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film {
    /// Columns of the whole film.
    pub width: usize,
    /// Rows of the whole film.
    pub height: usize,
    /// The part that is rendered, if not the whole.
    pub crop: Option<Crop>,
    /// Whether a filter that reaches over the border of the film, or of its crop, sees what is there, so that
    /// no pixel is special. Where it is not, as in Mitsuba unless its `sample_border` is true, a pixel near the
    /// border is the mean of what is within, by the same weights: ∫ h L/∫ h over the film. To the box filter,
    /// which does not reach over, both are the same.
    pub sample_border: bool,
    /// The filter of every pixel.
    pub filter: Filter,
}
