//! Kinds of curves, and how many samples each gets.

use glam::DVec3;

/// Kinds of curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::gradient) enum Kind {
    /// Edges and crossings on the film.
    FilmEdges,
    /// Curves on the film where a surface turns its other side to the camera.
    FilmSignChanges,
    /// Edges in front of emitters, as seen from shading points.
    ShadowEdges,
    /// Edges in front of reflecting surfaces and a constant environment, as seen from shading points.
    IndirectEdges,
    /// Silhouettes and borders of emitters, with paths from the camera.
    Outlines,
    /// The same as seen after a bounce, with paths from the emitter.
    ReflectedOutlines,
    /// Horizons of faces with shading normals.
    Horizons,
    /// Curves where a surface turns its other side to an earlier vertex of a path.
    InnerSignChanges,
}

/// Kinds whose noise is reported together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::gradient) enum Group {
    /// Curves on the film.
    Film,
    /// Curves that light of emitters makes, as seen from shading points, and inner sign changes.
    Shading,
    /// Curves in front of all else, and outlines of emitters after a bounce.
    Bounces,
}

impl Kind {
    /// All kinds, in order.
    const ALL: [Self; 8] = [
        Self::FilmEdges,
        Self::FilmSignChanges,
        Self::ShadowEdges,
        Self::IndirectEdges,
        Self::Outlines,
        Self::ReflectedOutlines,
        Self::Horizons,
        Self::InnerSignChanges,
    ];

    /// Its group.
    pub(in crate::gradient) fn group(self) -> Group {
        match self {
            Self::FilmEdges | Self::FilmSignChanges => Group::Film,
            Self::ShadowEdges | Self::Outlines | Self::Horizons | Self::InnerSignChanges => Group::Shading,
            Self::IndirectEdges | Self::ReflectedOutlines => Group::Bounces,
        }
    }
}

/// Sample budget of all curves, and the control variate.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient) struct Budget<'l> {
    samples: [usize; Kind::ALL.len()],
    pub(super) seed: u64,
    /// Control variate of every pixel, for curves of which one side counts; empty if it is 0.
    pub(super) control_variate: &'l [DVec3],
}

impl<'l> Budget<'l> {
    /// From the mean samples per pixel of each kind: 0 where nothing is left to sample.
    pub(in crate::gradient) fn new(
        seed: u64,
        control_variate: &'l [DVec3],
        samples: impl FnMut(Kind) -> usize,
    ) -> Self {
        Self { samples: Kind::ALL.map(samples), seed, control_variate }
    }

    /// Mean samples per pixel of a kind.
    pub(super) fn of(&self, kind: Kind) -> usize {
        self.samples[kind as usize]
    }
}
