//! The structures there are, and which options go with each.

use super::options::{Build, BuildOptions, Heuristic, Layout};
use crate::error::Error;

/// What is built over the triangles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Structure {
    /// The Bounding Interval Hierarchy.
    #[default]
    Bih,
    /// A kd-tree by the surface area heuristic (Wald and Havran 2006): docs/decisions/kd-tree.md.
    KdTree,
    /// A bounding volume hierarchy by the binned surface area heuristic (Wald 2007): docs/decisions/bvh.md.
    Bvh,
}

impl Structure {
    /// The name that a person knows it by.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bih => "bih",
            Self::KdTree => "kd_tree",
            Self::Bvh => "bvh",
        }
    }

    /// The layout where none is chosen.
    pub fn layout(self) -> Layout {
        match self {
            Self::Bih | Self::Bvh => Layout::Wide,
            Self::KdTree => Layout::Classic,
        }
    }

    /// The heuristic where none is chosen.
    pub fn heuristic(self) -> Heuristic {
        match self {
            Self::Bih => Heuristic::Global,
            Self::KdTree | Self::Bvh => Heuristic::Sah,
        }
    }
}

impl BuildOptions {
    /// The options of a structure where none is chosen.
    pub fn of(structure: Structure) -> Self {
        Self { structure, layout: structure.layout(), heuristic: structure.heuristic(), ..Default::default() }
    }

    /// Refuse what does not go together.
    pub fn check(&self) -> Result<(), Error> {
        let wrong = |argument: &'static str, value: String, advice: &'static str| {
            Err(Error::Incompatible { structure: self.structure.name(), argument, value, advice })
        };
        if self.structure != Structure::Bih && self.build == Build::OnDemand {
            return wrong("build", "\"on_demand\"".to_owned(), "choose \"eager\"");
        }
        let layout = || format!("{:?}", self.layout.name());
        match self.structure {
            Structure::Bih => return Ok(()),
            Structure::KdTree if self.layout != Layout::Classic => {
                return wrong("layout", layout(), "choose \"classic\"");
            }
            Structure::KdTree if self.leaf_size.is_some() => {
                let size = self.leaf_size.unwrap_or_default().to_string();
                return wrong("leaf_size", size, "leave it out, the heuristic ends where no split is cheaper");
            }
            Structure::Bvh if self.layout == Layout::Classic => {
                return wrong("layout", layout(), "choose \"wide\" or \"compact\"");
            }
            Structure::KdTree | Structure::Bvh => {}
        }
        if self.heuristic != Heuristic::Sah {
            return wrong("heuristic", format!("{:?}", self.heuristic.name()), "choose \"sah\"");
        }
        if self.presort == Some(true) {
            return wrong("presort", "True".to_owned(), "leave it out, it sorts by the cells of the global heuristic");
        }
        Ok(())
    }
}
