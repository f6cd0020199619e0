//! Objective of a fit: image losses over views, mask losses and regularizers.

use std::time::Duration;

use flatland::random::stream;
use rand::Rng as _;

use super::loss::{Loss, LossError};
use super::mask_loss::{MaskLoss, MaskLossError};
use super::parameters::Parameters;
use super::regularizer::Regularizer;
use super::silhouettes::silhouette_weights;
use crate::Image;
use crate::gradient::{ActiveParameters, Gradient, GradientError, Progress, Stopped, Tangent};
use crate::scene::{Camera, Film, Scene, SceneError};
#[cfg(doc)]
use crate::sdf::network::eikonal_loss;

/// Sample points of an eikonal term.
const EIKONAL_POINTS: usize = 4096;

/// Purposes of random-number streams; views use their own numbers.
const EIKONAL: u64 = u64::MAX;
const PIXELS: u64 = u64::MAX - 1;

/// Target picture with its camera.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Its name in messages.
    pub name: String,
    /// The camera; `None` is allowed for the only view and means the scene's, which may be fitted.
    pub camera: Option<Camera>,
    /// The film.
    pub film: Film,
    /// The picture, of the film's size.
    pub target: Image,
    /// Factor of the difference of each pixel, channel by channel: 0 where the picture is not to be trusted,
    /// or everywhere but near silhouettes. 1 if `None`. The picture must be finite even where its weight is
    /// 0.
    pub weights: Option<Image>,
    /// The mask of the object of [`Objective::masks`], if known: whether it is visible in each pixel, row by
    /// row from the top.
    pub mask: Option<Vec<bool>>,
}

/// Mask loss of all views for one implicit surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaskTerm {
    /// The index of the implicit surface.
    pub implicit: usize,
    /// The mask loss at the first step of a fit; it is [sharpened](MaskLoss::sharpened) from step to step.
    pub loss: MaskLoss,
}

/// Regularisation term of one shape, independent of the pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Penalty {
    /// Regularizer of a mesh.
    Mesh {
        /// The index of the shape.
        shape: usize,
        /// The regularizer.
        regularizer: Regularizer,
        /// The weight of the term.
        weight: f64,
    },
    /// [Eikonal term](eikonal_loss) of a network on a grid, or of a network traced directly with such a grid
    /// as its guide, at 4,096 points, uniform between the corners and drawn anew in every step. It keeps φ
    /// near a distance, whose surface moves by as much as φ changes.
    Eikonal {
        /// The index of the implicit surface.
        implicit: usize,
        /// The weight of the term; 0.1 is usual.
        weight: f64,
    },
}

/// Objective: the sum of the mean loss over views and of the penalties.
#[derive(Clone, Debug, PartialEq)]
pub struct Objective {
    /// The views; at least one.
    pub views: Vec<View>,
    /// The image loss.
    pub loss: Loss,
    /// Regularisation terms, independent of the pictures.
    pub penalties: Vec<Penalty>,
    /// Mask loss of the views that have a mask. Images differentiated without silhouettes, with masks for
    /// these, are IDR (Yariv et al. 2020); [`WarpedArea`](crate::gradient::WarpedArea) needs none.
    pub masks: Option<MaskTerm>,
    /// Restricts the loss to pixels within this distance of a silhouette of the fitted shapes, see
    /// [`silhouette_weights`]: for shapes whose colour or light is unknown.
    pub silhouettes: Option<usize>,
    /// Number of pixels evaluated per view, chosen anew at every evaluation: their mean is an unbiased
    /// estimate of the mean over all, and samples that no chosen pixel uses are not traced. A step costs by
    /// the samples it takes, so that many views with few pixels of each cost as much as few views.
    /// Reconstruction filters wider than a pixel ([`Filter`](crate::scene::Filter)) need the samples of
    /// neighbouring pixels, too: up to nine times as many with a tent. Not for [`Loss::Multiscale`] of
    /// several levels, which needs blocks. Masks are evaluated at all pixels. `None` evaluates all.
    pub pixels: Option<usize>,
    /// Samples per pixel of the renderings from which the adjoint is computed. They are independent of those
    /// of the gradient, so that the product of both is unbiased. Their noise enters the gradient, in
    /// proportion to a pixel's derivative; as many as the gradient has are a good start.
    pub image_samples: usize,
}

/// The derivative of Σ adjoint · image for a seed, usually by
/// [`Estimator::reverse`](crate::gradient::Estimator::reverse).
pub type Reverse<'a> =
    &'a dyn Fn(&Scene, &Image, &ActiveParameters, u64, &Progress) -> Result<Gradient, GradientError>;

/// Estimate of an objective and its derivative at one point.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// The mean loss over the evaluated views. The images are noisy: squared losses are too large by their
    /// variance.
    pub loss: f64,
    /// The sum of the penalties.
    pub penalty: f64,
    /// The derivative of loss plus penalty by x.
    pub gradient: Vec<f64>,
    /// Samples left out because they were not finite.
    pub non_finite: usize,
    /// Time spent rendering.
    pub image_time: Duration,
    /// Time spent on gradients.
    pub gradient_time: Duration,
}

/// Why an objective cannot be evaluated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ObjectiveError {
    /// There are no views.
    #[error("there is no view to compare with")]
    NoViews,
    /// A view without a camera among others: the scene's camera would depend on the view evaluated before.
    #[error("view `{view}` needs a camera of its own, as there are other views")]
    Camera {
        /// The view's name.
        view: String,
    },
    /// A rendering cannot be compared with its target.
    #[error("view `{view}`: {source}")]
    Loss {
        /// The view's name.
        view: String,
        /// The cause.
        source: LossError,
    },
    /// The weights differ in size from the target, or are not finite.
    #[error("view `{view}`: the weights must be finite and as many as the target has pixels, {} x {}", size.0, size.1)]
    Weights {
        /// The view's name.
        view: String,
        /// Columns and rows of the target.
        size: (usize, usize),
    },
    /// An invalid camera or film.
    #[error("view `{view}`: {source}")]
    View {
        /// The view's name.
        view: String,
        /// The cause.
        source: SceneError,
    },
    /// A mask that cannot be compared with the surface.
    #[error("view `{view}`: {source}")]
    Mask {
        /// The view's name.
        view: String,
        /// The cause.
        source: MaskLossError,
    },
    /// The number of chosen pixels is 0, or the loss needs blocks of pixels.
    #[error(
        "view `{view}`: {pixels} pixels cannot be chosen: at least one must be, and not for a multiscale loss, which looks at blocks"
    )]
    Pixels {
        /// The view's name.
        view: String,
        /// [`Objective::pixels`].
        pixels: usize,
    },
    /// An eikonal term of a surface that is not a network on a grid.
    #[error("the eikonal term is for networks on grids, and `{shape}` is none")]
    NoNetwork {
        /// The implicit surface.
        shape: String,
    },
    /// The gradient failed.
    #[error(transparent)]
    Gradient(#[from] GradientError),
}

impl From<Stopped> for ObjectiveError {
    fn from(stopped: Stopped) -> Self {
        Self::Gradient(stopped.into())
    }
}

impl Objective {
    /// Sets the camera and film of a scene to those of a view.
    ///
    /// # Errors
    /// [`ObjectiveError::View`] or [`ObjectiveError::Camera`].
    pub fn look(&self, scene: &mut Scene, view: usize) -> Result<(), ObjectiveError> {
        let View { name, camera, film, .. } = &self.views[view];
        let error = |source| ObjectiveError::View { view: name.clone(), source };
        match camera {
            Some(camera) => scene.set_camera(camera.clone()).map_err(error)?,
            None if self.views.len() > 1 => return Err(ObjectiveError::Camera { view: name.clone() }),
            None => {}
        }
        scene.set_film(*film).map_err(error)
    }

    /// The evaluated pixels of a view; `None` if all are.
    pub(super) fn chosen(&self, view: usize, seed: u64) -> Result<Option<Vec<bool>>, ObjectiveError> {
        let View { name, target, .. } = &self.views[view];
        let count = target.width * target.height;
        let Some(pixels) = self.pixels.filter(|&pixels| pixels < count) else { return Ok(None) };
        let blocks = matches!(self.loss, Loss::Multiscale { levels } if levels > 1);
        if pixels == 0 || blocks {
            return Err(ObjectiveError::Pixels { view: name.clone(), pixels });
        }
        let mut random = stream(seed, &[PIXELS]);
        let mut chosen = vec![false; count];
        // Floyd's sampling without replacement; the remainder's bias is below 10⁻¹² for any film.
        for last in count - pixels..count {
            let pixel = (random.next_u64() % (last as u64 + 1)) as usize;
            let pixel = if chosen[pixel] { last } else { pixel };
            chosen[pixel] = true;
        }
        Ok(Some(chosen))
    }

    /// The rendering in evaluated pixels, and the target elsewhere.
    pub(super) fn only(&self, view: usize, chosen: &Option<Vec<bool>>, image: &Image) -> Image {
        let target = &self.views[view].target;
        let Some(chosen) = chosen.as_ref().filter(|_| image.size() == target.size()) else {
            return image.clone();
        };
        let pixels = image.pixels.iter().zip(&target.pixels).zip(chosen);
        image.with_pixels(
            pixels.map(|((image, target), chosen)| if *chosen { *image } else { *target }).collect(),
        )
    }

    /// The loss of an image of a view, and its derivative by every pixel.
    ///
    /// # Errors
    /// [`ObjectiveError::Loss`] or [`ObjectiveError::Weights`].
    pub fn compare(&self, view: usize, image: &Image) -> Result<(f64, Image), ObjectiveError> {
        self.compare_view(&self.views[view], image)
    }

    /// The loss of an image of a view against any picture of the same size, in the place of its target, with
    /// the view's weights and those of [`silhouettes`](Self::silhouettes) in a scene that is
    /// [seen](Self::look) by the view: of two renderings it is what noise alone makes of the loss.
    ///
    /// # Errors
    /// [`ObjectiveError::Loss`] or [`ObjectiveError::Weights`].
    pub fn loss_between(
        &self,
        scene: &Scene,
        parameters: &Parameters,
        view: usize,
        [image, target]: [&Image; 2],
    ) -> Result<f64, ObjectiveError> {
        let view = View { target: target.clone(), ..self.views[view].clone() };
        Ok(self.compare_seen(scene, &parameters.active(scene), &view, image)?.0)
    }

    /// `compare` with the weights of silhouettes as well.
    pub(super) fn compare_seen(
        &self,
        scene: &Scene,
        active: &ActiveParameters,
        view: &View,
        image: &Image,
    ) -> Result<(f64, Image), ObjectiveError> {
        let Some(reach) = self.silhouettes else { return self.compare_view(view, image) };
        // Implicit surfaces are counted after all meshes.
        let both = active.shapes.iter().chain(&active.implicits).enumerate();
        let shapes: Vec<usize> = both.filter(|(_, active)| **active).map(|(shape, _)| shape).collect();
        let weights = silhouette_weights(scene, &shapes, reach);
        let near = View { weights: Some(product(view.weights.clone(), weights)), ..view.clone() };
        self.compare_view(&near, image)
    }

    fn compare_view(&self, view: &View, image: &Image) -> Result<(f64, Image), ObjectiveError> {
        let View { name, target, weights, .. } = view;
        let error = |source| ObjectiveError::Loss { view: name.clone(), source };
        let Some(weights) = weights else { return self.loss.of(image, target).map_err(error) };
        let sizes = [weights.pixels.len(), image.pixels.len(), target.pixels.len()];
        let fits = weights.size() == target.size() && sizes == [target.width * target.height; 3];
        if !fits || !weights.pixels.iter().all(|w| w.is_finite()) {
            return Err(ObjectiveError::Weights { view: name.clone(), size: target.size() });
        }
        // T + w (I − T) differs from T by the weighted difference.
        let pixels = image.pixels.iter().zip(&target.pixels).zip(&weights.pixels);
        let weighted = image.with_pixels(pixels.map(|((i, t), w)| *t + *w * (*i - *t)).collect());
        let (loss, mut adjoint) = self.loss.of(&weighted, target).map_err(error)?;
        adjoint.pixels.iter_mut().zip(&weights.pixels).for_each(|(a, w)| *a *= *w);
        Ok((loss, adjoint))
    }

    pub(super) fn add_penalties(
        &self,
        scene: &Scene,
        (parameters, x): (&Parameters, &[f64]),
        seed: u64,
        to: &mut Evaluation,
    ) -> Result<(), ObjectiveError> {
        if self.penalties.is_empty() {
            return Ok(());
        }
        let mut tangent = Tangent::still(scene);
        for (i, penalty) in self.penalties.iter().enumerate() {
            match *penalty {
                Penalty::Mesh { shape, regularizer, weight } => {
                    let (value, slopes) = regularizer.of(&scene.description().shapes[shape].mesh);
                    to.penalty += weight * value;
                    let rates = tangent.positions_of_mut(scene, shape).iter_mut();
                    rates.zip(slopes).for_each(|(rate, slope)| *rate += weight * slope);
                }
                Penalty::Eikonal { implicit, weight } => {
                    let surface = &scene.description().implicits[implicit];
                    let none = || ObjectiveError::NoNetwork { shape: surface.id.clone() };
                    let seed = stream(seed, &[EIKONAL, i as u64]).next_u64();
                    let gradient = &mut tangent.implicits[implicit].parameters;
                    let baked = surface.surface.network().ok_or_else(none)?;
                    to.penalty += weight * baked.add_eikonal(weight, EIKONAL_POINTS, seed, gradient);
                }
            }
        }
        add(&mut to.gradient, &parameters.gradient(scene, x, &tangent));
        Ok(())
    }
}

/// The product of two weight images, if both exist and have equal sizes.
fn product(weights: Option<Image>, by: Image) -> Image {
    match weights {
        Some(weights) if weights.size() == by.size() => {
            by.with_pixels(by.pixels.iter().zip(&weights.pixels).map(|(a, b)| *a * *b).collect())
        }
        // A mismatch is refused later, with the view's name.
        Some(weights) => weights,
        None => by,
    }
}

pub(super) fn add(sums: &mut [f64], more: &[f64]) {
    sums.iter_mut().zip(more).for_each(|(sum, m)| *sum += m);
}
