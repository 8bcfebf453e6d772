//! Surfaces, light and a camera for small pictures.

use asm_core::Picture;
use frame_plan::cpu::CpuExecutor;
use frame_plan::{Executor, Limits};
use glam::{DMat3, DMat4, DVec3};
use spectral_core::basis::{Optimal, SpectralBasis, Training};
use spectral_core::color_checker;
use spectral_core::grid::SpectralGrid;
use spectral_core::illuminant::Illuminant;
use spectral_core::observer::Observer;
use spectral_prt::{
    Albedo, Bands, Exposure, GlossTransfer, IndexMap, PASSES, Palette, Projection, Relighting,
    RelightingError, RelightingSettings, RelitScene, SceneTransfer, Shot, Sky, SpectralMap, Surface,
    Transfer, TransferSettings, precompute,
};
use spectral_scene::Camera;

pub(crate) const GRID: SpectralGrid = SpectralGrid::SCHWENK_2010;
pub(crate) const OBSERVER: Observer = Observer::Cie1931;
pub(crate) const RGB: Projection<'static> = Projection::Rgb(GRID, OBSERVER);

pub(crate) fn light(illuminant: Illuminant) -> Vec<f64> {
    GRID.sample(|l| illuminant.relative_power(l))
}

pub(crate) fn basis(coefficients: usize) -> SpectralBasis {
    let lights: Vec<Vec<f64>> = Illuminant::ALL.into_iter().map(light).collect();
    let reflectances = color_checker::sampled(&GRID);
    let training = Training { grid: GRID, observer: OBSERVER, reflectances: &reflectances, lights: &lights };
    training.optimal(coefficients, Optimal::default()).expect("within the rank")
}

/// A ball of radius 1 that looks outwards, or inwards.
pub(crate) fn ball(turn: DMat3, outwards: bool) -> Surface {
    const ROWS: u32 = 12;
    const COLUMNS: u32 = 24;
    let mut positions = Vec::new();
    for row in 0..=ROWS {
        for column in 0..COLUMNS {
            let theta = std::f64::consts::PI * f64::from(row) / f64::from(ROWS);
            let phi = std::f64::consts::TAU * f64::from(column) / f64::from(COLUMNS);
            let direction = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            positions.push(turn * direction);
        }
    }
    let mut triangles = Vec::new();
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let at = |r: u32, c: u32| (row + r) * COLUMNS + (column + c) % COLUMNS;
            triangles.push([at(0, 0), at(0, 1), at(1, 0)]);
            triangles.push([at(0, 1), at(1, 1), at(1, 0)]);
        }
    }
    let sign = if outwards { 1.0 } else { -1.0 };
    let normals: Vec<DVec3> = positions.iter().map(|p| sign * *p).collect();
    Surface::new(&positions, &normals, &triangles).expect("a ball")
}

/// A square of side 2 in the plane z = 0 that looks along +Z, and its texture coordinates, from the upper left.
pub(crate) fn square() -> (Surface, Vec<[f32; 2]>) {
    let corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
    let surface = Surface::new(&corners, &[DVec3::Z; 4], &[[0, 3, 1], [1, 3, 2]]).expect("a square");
    (surface, vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
}

pub(crate) fn transfer(surfaces: &[Surface], rays: u32) -> Transfer {
    precompute(surfaces, &TransferSettings { rays, ..TransferSettings::default() }, &mut |_| {})
        .expect("good settings")
}

/// A camera at `eye` that looks at the origin.
pub(crate) fn camera(eye: DVec3) -> Camera {
    Camera::look_at(eye, DVec3::ZERO)
}

/// The camera and all that it looks at, turned.
pub(crate) fn turned(camera: &Camera, turn: DMat3) -> Camera {
    Camera { world_from_camera: DMat4::from_mat3(turn) * camera.world_from_camera, ..camera.clone() }
}

/// What a picture is made of.
pub(crate) struct Stage<'a> {
    pub(crate) surfaces: &'a [Surface],
    pub(crate) transfer: SceneTransfer<'a>,
    pub(crate) gloss: Option<&'a GlossTransfer>,
    pub(crate) palette: Palette,
    pub(crate) index_maps: Vec<IndexMap>,
    pub(crate) spectral_maps: Vec<SpectralMap>,
    pub(crate) albedos: Vec<Albedo>,
    pub(crate) settings: RelightingSettings,
}

impl<'a> Stage<'a> {
    /// Each surface with an entry of the palette of its own.
    pub(crate) fn new(
        surfaces: &'a [Surface],
        transfer: &'a Transfer,
        projection: &Projection<'_>,
        reflectances: &[Vec<f64>],
    ) -> Self {
        Self {
            surfaces,
            transfer: SceneTransfer::Direct(transfer),
            gloss: None,
            palette: Palette::new(projection, reflectances),
            index_maps: Vec::new(),
            spectral_maps: Vec::new(),
            albedos: (0..surfaces.len() as u32).map(Albedo::Entry).collect(),
            settings: RelightingSettings { size: [48, 32], samples: 1 },
        }
    }

    pub(crate) fn scene(&self) -> RelitScene<'_> {
        RelitScene {
            surfaces: self.surfaces,
            transfer: self.transfer,
            gloss: self.gloss,
            palette: &self.palette,
            index_maps: &self.index_maps,
            spectral_maps: &self.spectral_maps,
            albedos: &self.albedos,
        }
    }

    pub(crate) fn plan(&self, shot: &Shot<'_>) -> Result<Relighting, RelightingError> {
        Relighting::new(&self.scene(), shot, &self.settings, &Limits::default())
    }

    pub(crate) fn picture(&self, shot: &Shot<'_>) -> Picture {
        let relighting = self.plan(shot).expect("a plan");
        let mut executor = executor(&relighting);
        frame(&relighting, &mut executor)
    }
}

pub(crate) fn executor(relighting: &Relighting) -> CpuExecutor {
    let mut executor = CpuExecutor::new(PASSES, None).expect("threads");
    executor.prepare(&relighting.plan).expect("a valid plan");
    executor
}

pub(crate) fn frame(relighting: &Relighting, executor: &mut CpuExecutor) -> Picture {
    executor.execute().expect("a frame");
    relighting.read(executor).expect("a picture")
}

/// A shot of an even sky.
pub(crate) fn even(coefficients: &[f64]) -> Sky {
    Sky::even(Bands::default(), coefficients)
}

/// Light mostly from one direction.
pub(crate) fn from_direction(direction: DVec3, coefficients: &[f64]) -> Sky {
    let mut shape = spectral_prt::sh::harmonics(Bands::default(), direction.normalize());
    shape[0] *= 2.0;
    Sky::of_shape(Bands::default(), &shape, coefficients)
}

pub(crate) fn shot<'a>(sky: &'a Sky, camera: &'a Camera) -> Shot<'a> {
    Shot { sky, rotation: DMat3::IDENTITY, camera, exposure: Exposure::default() }
}

/// Pixels that show something.
pub(crate) fn seen(picture: &Picture) -> impl Iterator<Item = [f64; 3]> + '_ {
    picture.xyz.iter().filter(|xyz| **xyz != [0.0; 3]).map(|xyz| xyz.map(f64::from))
}
