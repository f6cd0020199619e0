//! Cameras and films.

use glam::{DMat3, DQuat, DVec2, DVec3};

/// A camera with an orthonormal frame: a pinhole, or a thin lens.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Position of the pinhole, or of the lens centre.
    pub origin: DVec3,
    /// Unit vector to the right of the image.
    pub right: DVec3,
    /// Unit vector to the top of the image.
    pub up: DVec3,
    /// Unit vector into the scene.
    pub forward: DVec3,
    /// Horizontal field of view of the whole film, radians, in (0, π), for a centred principal point:
    /// f_x = (W/2)/tan(fov/2) pixels.
    pub field_of_view: f64,
    /// Principal point relative to the centre of the film, in units of its width and height, x to the right
    /// and y down. Nonzero for cropped pictures or calibrated lenses.
    pub principal_point: DVec2,
    /// Ratio of focal lengths f_y/f_x, positive; 1 for square pixels.
    pub pixel_aspect: f64,
    /// The lens; `None` for a pinhole, with infinite depth of field.
    pub lens: Option<Lens>,
    /// Distance from [`origin`](Self::origin) to the sensor for an orthographic sensor, which is modelled by
    /// a distant perspective camera: the camera rotates about the sensor and has no field of view. `None` for
    /// a perspective camera.
    pub orthographic: Option<f64>,
}

/// A thin lens: a disc orthogonal to the camera's axis.
///
/// The image is the mean over pinholes distributed uniformly over the disc, whose image planes are shifted to
/// agree at the focus distance: all of them see the same point there at a given film point. A point at depth
/// z spreads over the circle of confusion, of radius f·radius·|1/z − 1/focus_distance| pixels, with f the
/// focal length in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius of the disc, scene units, positive.
    pub radius: f64,
    /// Depth of the plane in focus along the camera's axis; positive.
    pub focus_distance: f64,
}

/// A calibrated pinhole: x_c = R (x − c), with x_c to the right, down and into the picture, is seen at
/// u = f_x x_c/z_c + c_x, v = f_y y_c/z_c + c_y, in pixels from the picture's top left corner. The middle of
/// the top left pixel is (½, ½), as in COLMAP; OpenCV has it at (0, 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// R, a rotation.
    pub rotation: DMat3,
    /// c, scene units.
    pub center: DVec3,
    /// (f_x, f_y), pixels, positive.
    pub focal: DVec2,
    /// (c_x, c_y), pixels.
    pub principal: DVec2,
    /// Columns and rows of the picture.
    pub size: DVec2,
}

impl From<Calibration> for Camera {
    fn from(calibration: Calibration) -> Self {
        let Calibration { rotation, center, focal, principal, size } = calibration;
        let [right, down, forward] = [0, 1, 2].map(|i| rotation.row(i));
        Self {
            origin: center,
            right,
            up: -down,
            forward,
            field_of_view: 2.0 * (0.5 * size.x / focal.x).atan(),
            principal_point: (principal - 0.5 * size) / size,
            pixel_aspect: focal.y / focal.x,
            lens: None,
            orthographic: None,
        }
    }
}

impl Camera {
    /// The camera translated.
    pub(super) fn moved(&self, by: DVec3) -> Self {
        Self { origin: self.origin + by, ..self.clone() }
    }

    /// A camera at `origin` that looks at `target`, with a horizontal field of view in radians.
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

    /// The calibration of the camera on a film of these columns and rows. `None` with a thin lens or an
    /// orthographic sensor.
    #[must_use]
    pub fn calibration(&self, size: DVec2) -> Option<Calibration> {
        if self.lens.is_some() || self.orthographic.is_some() {
            return None;
        }
        let rotation = DMat3::from_cols(self.right, -self.up, self.forward).transpose();
        let focal = 0.5 * size.x / (0.5 * self.field_of_view).tan() * DVec2::new(1.0, self.pixel_aspect);
        let principal = (self.principal_point + 0.5) * size;
        Some(Calibration { rotation, center: self.origin, focal, principal, size })
    }

    /// Centre of rotation: the origin, or the centre of an orthographic sensor.
    #[must_use]
    pub fn pivot(&self) -> DVec3 {
        self.origin + self.orthographic.unwrap_or(0.0) * self.forward
    }

    /// The camera rotated about its pivot.
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

/// Reconstruction filter h of a pixel, a product of functions of the distance to its centre in pixels along
/// each axis, with ∫∫ h = 1.
///
/// Samples are distributed uniformly on the film and weighted by h, also where it is negative: the image and
/// its derivatives stay unbiased. The effect of a filter on noise is (∫h²)² for the image, and ∫h′² ∫h² for
/// the area term of derivatives: 0.44 and 1.33 for a tent of radius 1, 0.32 and 0.64 for a Gaussian of
/// deviation ½, 0.46 and 1.11 for Mitchell–Netravali (B = C = ⅓), 0.66 and 1.90 for Catmull–Rom, and 0.80 and
/// 2.27 for Lanczos with three lobes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// 1 within the pixel.
    Box,
    /// max(0, 1 − |x|/r)/r along each axis.
    Tent {
        /// r.
        radius: f64,
    },
    /// e^{−x²/2σ²}, truncated and shifted to 0 at 4σ, as in Mitsuba 3.
    Gaussian {
        /// σ.
        deviation: f64,
    },
    /// The cubic splines of Mitchell and Netravali (1988), of radius 2, negative beyond 1. B = 0 and C = ½ is
    /// the interpolating Catmull–Rom spline.
    Cubic {
        /// B: amount of blur.
        b: f64,
        /// C: amount of ringing.
        c: f64,
    },
    /// sinc(x) sinc(x/a)/I of radius a, with its integral I, negative in every second lobe.
    Lanczos {
        /// a, from 1 to 16.
        lobes: u32,
    },
}

impl Filter {
    /// Distance from the pixel's centre beyond which it is 0 along each axis.
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

/// Standard deviations at which Mitsuba 3 truncates its Gaussian.
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
    /// The part that is rendered, if not the whole film.
    pub crop: Option<Crop>,
    /// Whether a filter that reaches over the border of the film, or of its crop, samples the scene beyond
    /// it. If false, as in Mitsuba unless its `sample_border` is true, a pixel near the border is the
    /// normalised mean over the film, ∫ h L/∫ h. For the box filter, which does not reach over the border,
    /// both are the same.
    pub sample_border: bool,
    /// The filter of every pixel.
    pub filter: Filter,
}
