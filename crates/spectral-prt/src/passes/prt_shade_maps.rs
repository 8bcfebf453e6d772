//! Relit surfaces, some of which have a spectrum at every texel. Twin of `shaders/prt_shade_maps.wgsl`.

use frame_plan::cpu::TextureView;
use frame_plan::{Binding, BindingKind, PassInfo, PassKind};
use glam::{UVec2, Vec2, Vec3, Vec4};

use super::{binding, wgsl};
use crate::shared::prt_picture::{BINDINGS, Inputs, PrtAlbedo, PrtPicture, Seen, fract};

const WITH_MAPS: [Binding; 10] = {
    let [a, b, c, d, e, f, g, h, i] = BINDINGS;
    let maps = BindingKind::Texture { uint: false, filter: false, array: true };
    [a, b, c, d, e, f, g, h, i, binding("spectral_maps", maps)]
};

/// All that an executor needs to build and run `prt_shade_maps`.
pub const PRT_SHADE_MAPS: PassInfo = PassInfo {
    name: "prt_shade_maps",
    wgsl: wgsl::PRT_SHADE_MAPS,
    params_struct: "PrtPicture",
    params_bytes: size_of::<PrtPicture>() as u32,
    bindings: &WITH_MAPS,
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            prt_shade_maps(&Inputs::bound(args), args.texture("spectral_maps"), args.write("picture"));
        },
    },
};

/// CPU mirror. Of each map `spectral_maps` has, for each block and colour-matching function, a layer of four terms.
pub fn prt_shade_maps(inputs: &Inputs<'_>, spectral_maps: TextureView<'_>, picture: &mut [Vec4]) {
    inputs.shade(picture, |inputs, seen, albedo| {
        if albedo.spectral == 0 {
            return inputs.reflected_by_palette(seen, albedo);
        }
        let taps = Taps::at(seen.uv, albedo.map_size);
        reflected_by_map(inputs, seen, albedo, |layer| taps.terms(&spectral_maps, layer))
    });
}

fn reflected_by_map(
    inputs: &Inputs<'_>,
    seen: &Seen,
    albedo: &PrtAlbedo,
    terms: impl Fn(u32) -> Vec4,
) -> Vec3 {
    let mut xyz = Vec3::ZERO;
    for block in 0..inputs.params.blocks {
        let e = inputs.irradiance_at(seen, block);
        xyz += Vec3::from_array([0, 1, 2].map(|c| terms(albedo.first + 3 * block + c).dot(e)));
    }
    xyz
}

/// Texels and weights of bilinear interpolation; the map goes on beyond its edges.
struct Taps {
    low: UVec2,
    high: UVec2,
    /// Of `high`.
    share: Vec2,
}

impl Taps {
    fn at(uv: Vec2, size: UVec2) -> Self {
        let place = fract(uv) * size.as_vec2() + (size.as_vec2() - 0.5);
        let low = place.as_uvec2();
        Self { low: low % size, high: (low + 1) % size, share: fract(place) }
    }

    fn terms(&self, maps: &TextureView<'_>, layer: u32) -> Vec4 {
        let texel = |x: u32, y: u32| Vec4::from_array(maps.load_layer(x, y, layer));
        let (low, high) = (self.low, self.high);
        let above = mix(texel(low.x, low.y), texel(high.x, low.y), self.share.x);
        let below = mix(texel(low.x, high.y), texel(high.x, high.y), self.share.x);
        mix(above, below, self.share.y)
    }
}

/// WGSL's.
fn mix(a: Vec4, b: Vec4, share: f32) -> Vec4 {
    a * (1.0 - share) + b * share
}
