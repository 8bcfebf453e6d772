//! A figure in f64: what each pixel's centre sees, by a depth buffer of its own.
//!
//! Transfer is the plan's own; everything after it, irradiance, projection, texels and colours, is done again, so that frames can be held
//! against it.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DMat4, DVec2, DVec3};
use spectral_prt::figures::Figure;
use spectral_prt::{Albedo, Transfer};

/// Vulkan lets rasterisers be so far off: another triangle or paint so near to a pixel's centre may be what one sees.
const BESIDE_PIXELS: f64 = 1.0 / 16.0;

/// What a camera sees of a figure.
pub struct Reference {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Row after row from the top.
    seen: Vec<Option<Seen>>,
    certain: Vec<bool>,
    brightest: f64,
}

/// What is seen at a point of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seen {
    surface: usize,
    /// Of the surface.
    triangle: usize,
    /// Of the palette.
    paint: usize,
    /// 0 on backs.
    irradiance: f64,
}

impl Reference {
    /// A figure under a sky with these harmonic coefficients.
    ///
    /// # Panics
    /// If the transfer is of another figure or the shape of other bands, and for albedos of spectral maps, which figures have not.
    #[must_use]
    pub fn draw(figure: &Figure, transfer: &Transfer, shape: &[f64], size: [u32; 2]) -> Self {
        let light: Vec<Vec<f64>> =
            (0..figure.surfaces.len()).map(|surface| transfer.irradiance(surface, shape)).collect();
        let at = |beside: DVec2| Canvas::new(figure, size, beside).draw(&light);
        let seen = at(DVec2::ZERO);
        let brightest = seen.iter().flatten().map(|s| s.irradiance).fold(0.0, f64::max);
        let place = |seen: &Option<Seen>| seen.map(|s| (s.surface, s.triangle, s.paint));
        let mut certain = vec![true; seen.len()];
        for direction in [DVec2::X, DVec2::Y, -DVec2::X, -DVec2::Y] {
            let there = at(BESIDE_PIXELS * direction);
            for (certain, (here, there)) in certain.iter_mut().zip(seen.iter().zip(&there)) {
                *certain &= place(here) == place(there);
            }
        }
        Self { size, seen, certain, brightest }
    }

    /// XYZ of all pixels, multiplied by `factor`; black where nothing is seen.
    #[must_use]
    pub fn xyz(&self, paints: &[[f64; 3]], factor: f64) -> Vec<[f64; 3]> {
        let pixel = |seen: &Option<Seen>| {
            seen.map_or([0.0; 3], |s| paints[s.paint].map(|v| factor * FRAC_1_PI * s.irradiance * v))
        };
        self.seen.iter().map(pixel).collect()
    }

    /// The factor that takes white, where light is strongest, to the screen's.
    #[must_use]
    pub fn exposure(&self) -> f64 {
        PI / self.brightest
    }

    /// Pixels, by their index, in which every rasteriser sees the same, if only nothing: those that are judged.
    pub fn certain_pixels(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.certain.len()).filter(|&i| self.certain[i])
    }

    /// Those of them that show something.
    pub fn shown_pixels(&self) -> impl Iterator<Item = usize> + '_ {
        self.certain_pixels().filter(|&i| self.seen[i].is_some())
    }

    /// What share of the pixels that show something is judged.
    #[must_use]
    pub fn certain_share(&self) -> f64 {
        self.shown_pixels().count() as f64 / self.seen.iter().flatten().count() as f64
    }
}

/// A depth buffer of points beside the pixels' centres.
struct Canvas<'a> {
    figure: &'a Figure,
    size: [usize; 2],
    beside: DVec2,
    eye: DVec3,
    camera_from_world: DMat4,
    /// Pixels per unit of slope.
    scale: f64,
    nearest: Vec<(f64, Option<Seen>)>,
}

impl<'a> Canvas<'a> {
    fn new(figure: &'a Figure, size: [u32; 2], beside: DVec2) -> Self {
        let size = size.map(|side| side as usize);
        let camera = &figure.camera;
        Self {
            figure,
            size,
            beside,
            eye: camera.world_from_camera.w_axis.truncate(),
            camera_from_world: camera.world_from_camera.inverse(),
            scale: 0.5 * size[1] as f64 / (0.5 * camera.yfov_rad).tan(),
            nearest: vec![(f64::INFINITY, None); size[0] * size[1]],
        }
    }

    /// Everything, with the irradiance of each surface's vertices.
    fn draw(mut self, light: &[Vec<f64>]) -> Vec<Option<Seen>> {
        for (surface, light) in light.iter().enumerate() {
            for triangle in 0..self.figure.surfaces[surface].triangles().len() {
                self.triangle(surface, triangle, light);
            }
        }
        self.nearest.into_iter().map(|(_, seen)| seen).collect()
    }

    fn middle(&self) -> DVec2 {
        0.5 * DVec2::new(self.size[0] as f64, self.size[1] as f64)
    }

    /// Of a picture's point, not of unit length.
    fn direction(&self, at: DVec2) -> DVec3 {
        let slope = (at - self.middle()) * DVec2::new(1.0, -1.0) / self.scale;
        self.figure.camera.world_from_camera.transform_vector3(slope.extend(-1.0))
    }

    /// Where points are in the picture; all of it if one is beside or behind the eye.
    fn bounds(&self, corners: [DVec3; 3]) -> [[usize; 2]; 2] {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for corner in corners {
            let p = self.camera_from_world.transform_point3(corner);
            if p.z >= -self.figure.camera.znear_m {
                (low, high) = (DVec2::ZERO, 2.0 * self.middle());
                break;
            }
            let at = self.middle() + DVec2::new(p.x, -p.y) * (self.scale / -p.z);
            (low, high) = (low.min(at), high.max(at));
        }
        let pixels = |low: f64, high: f64, beside: f64, side: usize| {
            let first = (low - 0.5 - beside).ceil().max(0.0) as usize;
            let end = ((high - 0.5 - beside).floor() + 1.0).clamp(0.0, side as f64) as usize;
            [first, end]
        };
        [
            pixels(low.x, high.x, self.beside.x, self.size[0]),
            pixels(low.y, high.y, self.beside.y, self.size[1]),
        ]
    }

    fn triangle(&mut self, surface: usize, triangle: usize, light: &[f64]) {
        let of = &self.figure.surfaces[surface];
        let vertices = of.triangles()[triangle].map(|v| v as usize);
        let [a, b, c] = vertices.map(|v| of.positions()[v]);
        let normals: DVec3 = vertices.iter().map(|v| of.normals()[*v]).sum();
        let facet = (b - a).cross(c - a);
        let front = facet.dot(normals).signum();
        let [[left, right], [top, bottom]] = self.bounds([a, b, c]);
        for y in top..bottom {
            for x in left..right {
                let at = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) + self.beside;
                let direction = self.direction(at);
                let facing = direction.dot(facet);
                let q = direction.cross(self.eye - a);
                let (u, v) = (q.dot(c - a) / facing, -q.dot(b - a) / facing);
                let weights = [1.0 - u - v, u, v];
                let distance = -(self.eye - a).dot(facet) / facing;
                let nearest = &mut self.nearest[y * self.size[0] + x];
                // Written so that triangles seen from the side, which divide by 0, are not seen.
                if weights.iter().all(|w| *w >= 0.0) && distance > 0.0 && distance < nearest.0 {
                    let mean = |of: &dyn Fn(usize) -> f64| {
                        weights.iter().zip(vertices).map(|(w, v)| w * of(v)).sum::<f64>()
                    };
                    let irradiance = if front * facing < 0.0 { mean(&|v| light[v]) } else { 0.0 };
                    let paint = match &self.figure.albedos[surface] {
                        Albedo::Entry(entry) => *entry as usize,
                        Albedo::Indexed { map, uvs } => {
                            let uv = [0, 1].map(|axis| mean(&|v| f64::from(uvs[v][axis])));
                            self.figure.index_maps[*map].nearest(uv) as usize
                        }
                        Albedo::Mapped { .. } => unreachable!("figures are painted from palettes"),
                    };
                    *nearest = (distance, Some(Seen { surface, triangle, paint, irradiance }));
                }
            }
        }
    }
}
