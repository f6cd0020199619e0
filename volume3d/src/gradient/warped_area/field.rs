//! The kinds of warp field.

use crate::gradient::GradientError;

/// What the warp field is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Field {
    /// The velocities of the edges near a direction, by their exact mean over those edges: no auxiliary ray,
    /// and no bias (jumps of interpolated normals are no edges: see
    /// [`WarpedArea::sign_changes`](super::WarpedArea::sign_changes)). Edges of meshes are listed once. None
    /// of them is tested for visibility, and none is sampled but the borders of flat emitters. Implicit
    /// surfaces join the mean by the points of their sphere tracer, as
    /// [`WarpedArea::implicit`](super::WarpedArea::implicit) says: this field and the softened one know them
    /// so.
    JumpMean {
        /// How far away edges count on the film, in pixels.
        film: f64,
        /// How far away they count on directions, in widths 1/√κ of the kernel, see
        /// [`Kernels`](crate::Kernels); down to half of it where silhouettes are crowded. A blob of 122,888 edges has 1.05 times the variance
        /// with it, and 2,000 leaves 1.03 times, and samples take about .9 and .8 of the time; a closed box would have 1.7 times the variance, and keeps all of it.
        lobe: f64,
    },
    /// The same mean, softened, with samples of the curves for what it leaves to them (Theory 6 and 7): no
    /// bias for any softness, from the exact mean, ε = 0, to none at all on the film, ε = ∞. Where
    /// silhouettes of different velocities cross or pass close by one another, ∇·V of the exact mean has no
    /// bound, and its samples have heavy tails. This one's have a bound: with v the largest velocity of the N
    /// jumps within reach, |V| ≤ v, |∇·V| is of the order of (1 + N) v/ε, and curves have at most 2v. The
    /// borders of a face that is seen w wide, which it follows, may move against one another, as where a face
    /// that is seen almost edge-on opens: that is 2v/w more, at most 200 v/ε, as those of narrower faces are
    /// softened, too. (Width is area over length: a spike of a wide face has no such bound.) That is the
    /// field's part. What a path meets after a bounce moves at a speed that grows with 1/cos of the angle of
    /// incidence, by this field as by all that trace from the camera; [edge
    /// sampling](crate::gradient::EdgeSampling) traces such points backwards.
    ///
    /// Directions towards lights are not warped: the edges of shadows and the outlines of emitters are
    /// sampled, with the speed at which they pass the shading point. Within lobes the mean is softened as on
    /// the film, or exact. Towards lights it is exact where an emitter has a texture, or something passes
    /// through one or covers part of it in one plane, and beside implicit surfaces where normals are
    /// interpolated.
    ///
    /// The density of samples of shadows has a bound at any gap between an edge and a lamp, none included:
    /// it is uniform by solid angle, on pieces of edges that are no longer than their distance from the
    /// lamp or a quarter of its size. Where more than 32 triangles emit it is so within a tenth of the
    /// radius of a ball around each shape. Where more than 64 shapes emit and edges times shapes are more
    /// than 10⁷, the mean is exact towards lights. Within lobes the exact mean has none as a gap before a
    /// surface that reflects closes.
    ///
    /// The silhouettes and shadows of implicit surfaces are no curves that could be drawn: what the points of
    /// their tracer give to the mean is not softened ([`WarpedArea::implicit`](super::WarpedArea::implicit)),
    /// and is all of the field towards lights whose shadows are sampled. It grows without bound at their
    /// silhouettes, so that the field is continuous there, and the curves of meshes are sampled with the
    /// speed that it leaves them. The bounds above are those of meshes.
    Softened {
        /// How far away edges count on the film, in pixels.
        film: f64,
        /// How far away they count on directions, in widths 1/√κ of the kernel.
        lobe: f64,
        /// ε in pixels: 0.3 to 0.5. Within lobes it is the same part of the reach.
        softness: f64,
        /// Samples of silhouettes on the film, a pixel on average. 0 leaves them out, which is **biased**.
        silhouettes: usize,
        /// Samples of the edges of shadows, a pixel on average, as many of outlines of emitters that are not flat, and of horizons of
        /// faces with interpolated normals. With 0 none are, and the mean follows them exactly. An emitter of thousands of triangles has as
        /// many edges to draw from, most of which are no silhouettes.
        shadows: usize,
        /// Samples of silhouettes as bounces see them, before surfaces that reflect and a constant environment, a pixel on average. With
        /// 0 none are, and the mean within lobes is exact. An eighth of the samples of the area suffices in a room; where the film shows a small
        /// part of a large world few are found.
        bounces: usize,
    },
    /// The velocities of what auxiliary rays hit (Bangaru, Li and Durand 2020). At a hit of an implicit surface that is the velocity of its
    /// level set, and the angle to its silhouette comes from its curvature along the ray,
    /// [`SilhouetteDistance::Curvature`](flatland::sdf::fields::SilhouetteDistance): exact on spheres to first order, and blind to corners. Over a floor
    /// that it shades, the gradient of a ball has 4.6 times the standard error of the default.
    AuxiliaryRays,
}

impl Default for Field {
    fn default() -> Self {
        Self::JumpMean { film: 1.2, lobe: 0.5 }
    }
}

impl Field {
    /// The softened mean for so many samples of the area: a quarter as many of silhouettes, and half as many of shadows.
    ///
    /// Relative squared error times processor seconds, forward, 16 samples a pixel, tent filter, one thread, means over 6 seeds (4 for the last
    /// two of edge sampling), which heavy tails make uncertain by a fifth; of the exact mean, of this, and of edge sampling with its
    /// samples split by hand: 20 thin prisms that turn .31, .046, .028; 2,000 leaves that turn 2.0, .45, .24; a sphere that moves over a
    /// plane .040, .040, .017; a block in a closed box with four bounces .43, .35, .23; a bumpy sphere of 81,920 triangles that turns
    /// .24, .24, 1.05.
    #[must_use]
    pub fn softened(samples: usize) -> Self {
        let part = |n: usize| samples.div_ceil(n).max(1);
        Self::Softened {
            film: 1.2,
            lobe: 0.5,
            softness: 0.4,
            silhouettes: part(4),
            shadows: part(2),
            bounces: 0,
        }
    }

    pub(super) fn check(&self) -> Result<(), GradientError> {
        let (film, lobe) = match *self {
            Self::JumpMean { film, lobe } => (film, lobe),
            Self::Softened { softness, .. } if softness.is_nan() || softness < 0.0 => {
                return Err(GradientError::Softness { softness });
            }
            Self::Softened { film, lobe, .. } => (film, lobe),
            Self::AuxiliaryRays => return Ok(()),
        };
        for (name, reach) in [("film", film), ("lobe", lobe)] {
            if !(reach > 0.0 && reach.is_finite()) {
                return Err(GradientError::Reach { name, reach });
            }
        }
        Ok(())
    }
}
