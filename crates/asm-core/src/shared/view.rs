//! Host side of `shaders/shared/view.wgsl`: a light or a camera looking onto a texel grid.

use bytemuck::{Pod, Zeroable};
use glam::{IVec2, UVec2, Vec2, Vec3, Vec4};

/// A light or a camera; mirrors `View` in `shaders/shared/view.wgsl`, which explains the terms.
///
/// Lengths are working units, see [`crate::WorkingSpace`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct View {
    /// Where rays start, or the middle of the plane where parallel rays start.
    pub eye: Vec3,
    /// 1 where rays leave the eye, 0 where they are parallel.
    pub perspective: u32,
    /// Unit, towards greater texel columns.
    pub right: Vec3,
    /// z that maps to depth 1.
    pub near: f32,
    /// Unit, towards smaller texel rows.
    pub up: Vec3,
    /// z that maps to depth 0.
    pub far: f32,
    /// Unit viewing direction.
    pub forward: Vec3,
    /// Padding.
    pub reserved: f32,
    /// Slope of the grid's middle.
    pub slope_center: Vec2,
    /// Slope from the middle to the grid's edges.
    pub slope_half: Vec2,
    /// Texels.
    pub size: UVec2,
    /// Slope per texel.
    pub texel_slope: Vec2,
}

/// A ray with a unit direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Unit.
    pub direction: Vec3,
}

/// Where a point falls on a view's grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projected {
    /// Continuous texel coordinates, x right, y down.
    pub texel: Vec2,
    /// Depth; 0 or less is behind the eye, and the texel then means nothing.
    pub z: f32,
}

impl View {
    /// Clip-space position of `p`.
    pub fn clip(&self, p: Vec3) -> Vec4 {
        let local = p - self.eye;
        let z = local.dot(self.forward);
        let xy = Vec2::new(local.dot(self.right), local.dot(self.up));
        if self.perspective == 1 {
            let ndc = (xy - self.slope_center * z) / self.slope_half;
            return ndc.extend(self.near * (self.far - z) / (self.far - self.near)).extend(z);
        }
        let ndc = (xy - self.slope_center) / self.slope_half;
        ndc.extend((self.far - z) / (self.far - self.near)).extend(1.0)
    }

    /// Texel coordinates of `p`.
    pub fn project(&self, p: Vec3) -> Projected {
        let local = p - self.eye;
        let z = local.dot(self.forward);
        let mut slope = Vec2::new(local.dot(self.right), local.dot(self.up));
        if self.perspective == 1 {
            slope /= z.max(1e-12);
        }
        let offset = (slope - self.slope_center) / self.texel_slope;
        let middle = 0.5 * self.size.as_vec2();
        // Parallel rays come from infinitely far: nothing is behind them.
        Projected {
            texel: Vec2::new(middle.x + offset.x, middle.y - offset.y),
            z: if self.perspective == 1 { z } else { 1.0 },
        }
    }

    /// The texel that shows `p`, or of the grid's edge the nearest.
    pub fn texel(&self, p: Vec3) -> UVec2 {
        self.project(p).texel.clamp(Vec2::ZERO, self.size.as_vec2() - 1.0).as_uvec2()
    }

    /// One of the eight texels round another.
    pub fn texel_beside(&self, texel: UVec2, side: i32) -> UVec2 {
        let place = side + side / 4; // of 3 x 3, without the middle
        let at = texel.as_ivec2() + IVec2::new(place % 3, place / 3) - 1;
        at.clamp(IVec2::ZERO, self.size.as_ivec2() - 1).as_uvec2()
    }

    /// Slope of a place on the grid.
    pub fn slope(&self, texel: Vec2) -> Vec2 {
        let offset = texel - 0.5 * self.size.as_vec2();
        self.slope_center + Vec2::new(offset.x, -offset.y) * self.texel_slope
    }

    /// The ray through a place on the grid.
    pub fn ray(&self, texel: Vec2) -> Ray {
        let slope = self.slope(texel);
        let across = slope.x * self.right + slope.y * self.up;
        if self.perspective == 1 {
            return Ray { origin: self.eye, direction: (self.forward + across).normalize() };
        }
        Ray { origin: self.eye + across, direction: self.forward }
    }

    /// The ray of this view that passes through `p`.
    pub fn ray_through(&self, p: Vec3) -> Ray {
        let local = p - self.eye;
        if self.perspective == 1 {
            return Ray { origin: self.eye, direction: local.normalize() };
        }
        Ray { origin: p - local.dot(self.forward) * self.forward, direction: self.forward }
    }

    /// Share of `texel_slope.x * texel_slope.y` that a texel measures: 1 for parallel rays, where that is its area across
    /// the light; for rays from an eye its solid angle, the integral of (1 + slope^2)^(-3/2) by 2 x 2 Gauss-Legendre points.
    pub fn texel_measure(&self, texel: UVec2) -> f32 {
        if self.perspective == 0 {
            return 1.0;
        }
        const GAUSS: f32 = 0.288_675_13; // 1 / (2 sqrt 3)
        let center = self.slope(texel.as_vec2() + 0.5);
        let mut sum = 0.0;
        for i in 0..4 {
            let side =
                Vec2::new(if i & 1 == 1 { GAUSS } else { -GAUSS }, if i & 2 == 2 { GAUSS } else { -GAUSS });
            let slope = center + side * self.texel_slope;
            let cosine = 1.0 / (1.0 + slope.dot(slope)).sqrt();
            sum += cosine * cosine * cosine;
        }
        0.25 * sum
    }

    /// The projected point lies on the grid.
    pub fn holds(&self, at: &Projected) -> bool {
        let size = self.size.as_vec2();
        at.z > 0.0 && at.texel.x >= 0.0 && at.texel.y >= 0.0 && at.texel.x < size.x && at.texel.y < size.y
    }
}
