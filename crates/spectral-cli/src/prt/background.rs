//! The sky behind the surfaces.

use glam::{DMat3, DVec3};
use spectral_core::mat3;
use spectral_prt::figures::OBSERVER;
use spectral_prt::sh;
use spectral_scene::Camera;

use super::environment::Environment;
use crate::picture::Picture;

/// Put the sky, as far as its bands have it, where no surface is: `uncovered` is the share of each pixel.
pub(super) fn fill(picture: &mut Picture, uncovered: &[f32], camera: &Camera, environment: &Environment) {
    let Some(balance) = environment.balance() else { return };
    let (width, height) = (picture.size.width as usize, picture.size.height as usize);
    let direction = directions(camera, [width, height]);
    let shown = balance.display_from_light();
    let sky: Vec<[f64; 3]> =
        environment.sky.xyz(OBSERVER).iter().map(|xyz| mat3::apply(&shown, *xyz)).collect();
    let mut harmonics = vec![0.0; sky.len()];
    for (i, (xyz, share)) in picture.xyz.iter_mut().zip(uncovered).enumerate() {
        if *share > 0.0 {
            sh::evaluate(environment.sky.bands(), direction(i % width, i / width), &mut harmonics);
            for (c, xyz) in xyz.iter_mut().enumerate() {
                let seen: f64 = sky.iter().zip(&harmonics).map(|(sky, y)| sky[c] * y).sum();
                *xyz += share * seen as f32;
            }
        }
    }
}

/// Where the middle of a pixel, column and row from the top left, looks.
fn directions(camera: &Camera, [width, height]: [usize; 2]) -> impl Fn(usize, usize) -> DVec3 {
    let axes = DMat3::from_mat4(camera.world_from_camera);
    let up = (camera.yfov_rad / 2.0).tan();
    let right = up * width as f64 / height as f64;
    move |column, row| {
        let place = |i: usize, of: usize| 2.0 * (i as f64 + 0.5) / of as f64 - 1.0;
        (axes * DVec3::new(right * place(column, width), -up * place(row, height), -1.0)).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::Size;
    use spectral_core::illuminant::Illuminant;
    use spectral_core::rgb::D65_WHITE_XYZ;
    use spectral_prt::figures::GRID;
    use spectral_prt::{Bands, SpectralSky, shape_of_bands};

    const SIZE: Size = Size { width: 9, height: 5 };

    /// The sky alone, with this slope along y, z and x, seen towards -Z.
    fn seen(slope: [f64; 3], share: f32) -> Vec<[f32; 3]> {
        let bands = Bands::default();
        let shape = shape_of_bands(bands, &[vec![2.0 * std::f64::consts::PI.sqrt()], slope.to_vec()])
            .expect("a shape");
        let white = spectral_prt::figures::power(Illuminant::Fl4);
        let sky = SpectralSky::of_shape(bands, GRID, &shape, &white);
        let mut picture = Picture { size: SIZE, xyz: vec![[0.0; 3]; 45] };
        let camera = Camera::look_at(DVec3::Z, DVec3::ZERO);
        fill(&mut picture, &[share; 45], &camera, &Environment { sky, white });
        picture.xyz
    }

    #[test]
    fn an_even_sky_is_the_screen_s_white_where_nothing_is() {
        for share in [1.0, 0.25, 0.0] {
            for xyz in seen([0.0; 3], share) {
                for (got, white) in xyz.iter().zip(D65_WHITE_XYZ) {
                    assert!((f64::from(*got) - f64::from(share) * white).abs() < 1e-6, "{xyz:?}");
                }
            }
        }
    }

    #[test]
    fn what_is_up_and_right_in_the_world_is_so_in_the_picture() {
        let y = |pixels: &[[f32; 3]], column: usize, row: usize| pixels[row * 9 + column][1];
        let up = seen([0.5, 0.0, 0.0], 1.0);
        assert!(y(&up, 4, 0) > y(&up, 4, 2) && y(&up, 4, 2) > y(&up, 4, 4));
        assert!((y(&up, 0, 2) - y(&up, 8, 2)).abs() < 1e-6);
        let right = seen([0.0, 0.0, 0.5], 1.0);
        assert!(y(&right, 8, 2) > y(&right, 4, 2) && y(&right, 4, 2) > y(&right, 0, 2));
        // Towards -Z, against the slope along z, all of it is darker.
        assert!(y(&seen([0.0, 0.5, 0.0], 1.0), 4, 2) < y(&up, 4, 2));
    }
}
