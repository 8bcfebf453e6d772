//! [`Planner`]: plans of a scene that moves from frame to frame.

use std::collections::HashMap;
use std::sync::Arc;

use frame_plan::Limits;
use spectral_scene::{Mesh, Object, Scene, Topology};

use crate::geometry::Geometry;
use crate::{BakePlan, PlanError, RenderPlan, Settings, WorkingSpace};

/// Makes the plans of [`crate::bake_plan`] and [`crate::render_plan`], and keeps what the next one may need again: whether meshes
/// are closed as long as they are the same, all triangles as long as no object moves.
#[derive(Default)]
pub struct Planner {
    geometry: GeometryCache,
}

impl Planner {
    /// As [`crate::bake_plan`].
    ///
    /// # Errors
    /// As [`crate::bake_plan`].
    pub fn bake(
        &mut self,
        scene: &Scene,
        receiver: usize,
        size: [u32; 2],
        settings: &Settings,
        limits: &Limits,
    ) -> Result<BakePlan, PlanError> {
        crate::bake::plan(&mut self.geometry, scene, receiver, size, settings, limits)
    }

    /// As [`crate::render_plan`].
    ///
    /// # Errors
    /// As [`crate::render_plan`].
    pub fn render(
        &mut self,
        scene: &Scene,
        camera: usize,
        size: [u32; 2],
        settings: &Settings,
        limits: &Limits,
    ) -> Result<RenderPlan, PlanError> {
        crate::render::plan(&mut self.geometry, scene, camera, size, settings, limits)
    }
}

/// The geometry made last, and what it was made from.
#[derive(Default)]
pub(crate) struct GeometryCache {
    meshes: Vec<Mesh>,
    /// Of refractors' meshes, and of their mirror images.
    topologies: HashMap<(usize, bool), Topology>,
    last: Option<(Placement, Arc<Geometry>)>,
}

/// Everything besides meshes that geometry depends on.
#[derive(PartialEq)]
struct Placement {
    objects: Vec<Object>,
    refractors: Vec<usize>,
    space: WorkingSpace,
    receiver: Option<usize>,
}

impl GeometryCache {
    /// The geometry of a valid scene.
    pub(crate) fn geometry(
        &mut self,
        scene: &Scene,
        space: &WorkingSpace,
        receiver: Option<usize>,
    ) -> Result<Arc<Geometry>, PlanError> {
        if self.meshes != scene.meshes {
            *self = Self { meshes: scene.meshes.clone(), ..Self::default() };
        }
        let refractors = scene.refractors().collect();
        let placement = Placement { objects: scene.objects.clone(), refractors, space: *space, receiver };
        if let Some((made_for, geometry)) = &self.last
            && *made_for == placement
        {
            return Ok(Arc::clone(geometry));
        }
        let topologies = &mut self.topologies;
        let mut topology = |object: usize| {
            let Object { mesh, world_from_mesh, .. } = &scene.objects[object];
            let mirrored = world_from_mesh.determinant() < 0.0;
            *topologies.entry((*mesh, mirrored)).or_insert_with(|| scene.topology(object))
        };
        let geometry = Arc::new(Geometry::new(scene, space, receiver, &mut topology)?);
        self.last = Some((placement, Arc::clone(&geometry)));
        Ok(geometry)
    }
}
