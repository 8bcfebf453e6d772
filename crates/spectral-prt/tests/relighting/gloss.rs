//! Frames of surfaces that shine, against the same light in f64.

use asm_core::Picture;
use glam::{DMat3, DVec3};
use spectral_core::color_checker;
use spectral_core::illuminant::Illuminant;
use spectral_prt::{
    Bands, BounceSettings, GlossTransfer, PhongLobe, Projection, SceneTransfer, Sky, SpectralMap, Surface,
    Transfer, TransferSettings, add_bounces, precompute,
};
use spectral_scene::Camera;

use crate::frames::{ball_and_wall, difference, expected};
use crate::stage::*;

/// Transfer of nine bands, which five bands of gloss are made of, and its first five.
fn transfers(surfaces: &[Surface]) -> (Transfer, Transfer) {
    let settings = TransferSettings { bands: Bands::new(9).expect("up to ten"), rays: 64 };
    let wide = precompute(surfaces, &settings, &mut |_| {}).expect("good settings");
    let five = wide.with_bands(Bands::default());
    (wide, five)
}

fn lobe(exponent: f64) -> Option<PhongLobe> {
    Some(PhongLobe::new(exponent).expect("a lobe"))
}

/// What the lobes of all vertices of a surface send to the camera.
fn shine(
    sky: &Sky,
    gloss: &GlossTransfer,
    surfaces: &[Surface],
    surface: usize,
    camera: &Camera,
    albedo: &[Vec<[f64; 3]>],
) -> Vec<[f64; 3]> {
    let eye = camera.world_from_camera.w_axis.truncate();
    let of = &surfaces[surface];
    (0..of.positions().len())
        .map(|v| {
            let mirrored = (of.positions()[v] - eye).normalize().reflect(of.normals()[v]);
            sky.gloss_xyz(gloss, (surface, v), mirrored, albedo)
        })
        .collect()
}

fn sums(a: &[[f64; 3]], b: &[[f64; 3]]) -> Vec<[f64; 3]> {
    a.iter().zip(b).map(|(a, b)| [0, 1, 2].map(|c| a[c] + b[c])).collect()
}

/// A ball that shines in front of a wall that does not.
#[test]
fn a_frame_shows_the_lobes_that_f64_shows() {
    let surfaces = ball_and_wall();
    let (wide, direct) = transfers(&surfaces);
    let chart = color_checker::sampled(&GRID);
    let paints = [chart[14].clone(), chart[17].clone()];
    // A lobe with a colour, as of metal, and none.
    let lobes = [chart[15].clone(), GRID.sample(|_| 0.0)];
    let gloss = GlossTransfer::new(&wide, Bands::default(), &[lobe(12.0), None]).expect("enough bands");
    let camera = camera(DVec3::new(1.0, 1.5, 4.0));
    let basis = basis(5);
    for projection in [Projection::Spectral(&basis), RGB] {
        let with = |gloss: &GlossTransfer, lobes: &[Vec<f64>]| -> Picture {
            let sky = from_direction(DVec3::new(1.0, 2.0, 1.5), &projection.light(&light(Illuminant::Fl2)));
            let mut stage = Stage::new(&surfaces, &direct, &projection, &paints);
            stage.settings.size = [72, 48];
            stage.gloss = Some(gloss);
            stage.palette = stage.palette.with_gloss(&projection, lobes);
            stage.picture(&shot(&sky, &camera))
        };
        let sky = from_direction(DVec3::new(1.0, 2.0, 1.5), &projection.light(&light(Illuminant::Fl2)));
        let matt = |s: usize| sky.radiance_xyz(&direct, s, &projection.albedo(&paints[s])[0]);
        let shine = shine(&sky, &gloss, &surfaces, 0, &camera, &projection.albedo(&lobes[0]));
        let truth = expected(&surfaces, &[sums(&matt(0), &shine), matt(1)], &camera, [72, 48]);
        let (worst, compared) = difference(&with(&gloss, &lobes), &truth);
        println!("gloss against f64: {worst:.1e} of the largest Y in {compared} pixels");
        assert!(compared > 1000 && worst < 1e-5, "{worst} in {compared} pixels");

        let wider = GlossTransfer::new(&wide, Bands::default(), &[lobe(11.0), None]).expect("enough bands");
        let other = difference(&with(&wider, &lobes), &truth).0;
        assert!(other > 1e-3, "an exponent of 11 for 12 went unnoticed, {other}");
        let grey = [GRID.sample(|_| 0.9), lobes[1].clone()];
        let other = difference(&with(&gloss, &grey), &truth).0;
        assert!(other > 1e-2, "a grey lobe for a yellow one went unnoticed, {other}");
        let without = Stage {
            settings: spectral_prt::RelightingSettings { size: [72, 48], samples: 1 },
            ..Stage::new(&surfaces, &direct, &projection, &paints)
        };
        let other = difference(&without.picture(&shot(&sky, &camera)), &truth).0;
        assert!(other > 1e-2, "no lobe at all went unnoticed, {other}");
    }
}

/// Gloss beside interreflection, on a surface with a spectrum at every texel: one function more than the matt ones.
#[test]
fn gloss_goes_with_interreflection_and_with_maps() {
    let surfaces = ball_and_wall();
    let (wide, direct) = transfers(&surfaces);
    let chart = color_checker::sampled(&GRID);
    let paints = [chart[14].clone(), chart[17].clone()];
    let settings = BounceSettings { rays: 64, bounces: 1 };
    let bounced =
        add_bounces(&surfaces, &direct, GRID, &paints, &settings, &mut |_| {}).expect("good settings");
    let basis = basis(6);
    let projection = Projection::Bounced(&basis, &bounced);
    let sky_alone =
        GlossTransfer::new(&wide, Bands::default(), &[lobe(6.0), lobe(3.0)]).expect("enough bands");
    let gloss = sky_alone.clone().with_bounces(&surfaces, &bounced, 64, &mut |_| {}).expect("the same scene");
    let lobes = [GRID.sample(|_| 0.2), GRID.sample(|_| 0.1)];
    let camera = camera(DVec3::new(1.0, 1.5, 4.0));
    let sky = from_direction(DVec3::new(1.0, 2.0, 1.5), &projection.light(&light(Illuminant::D50)));
    let mut stage = Stage::new(&surfaces, &direct, &projection, &paints);
    stage.transfer = SceneTransfer::Bounced(&bounced);
    stage.gloss = Some(&gloss);
    stage.palette = stage.palette.with_gloss(&projection, &lobes);
    let all = [0, 1].map(|s| {
        let matt = sky.bounced_radiance_xyz(&bounced, s, &projection.albedo(&paints[s]));
        sums(&matt, &shine(&sky, &gloss, &surfaces, s, &camera, &projection.albedo(&lobes[s])))
    });
    let truth = expected(&surfaces, &all, &camera, stage.settings.size);
    let by_palette = stage.picture(&shot(&sky, &camera));
    let (worst, compared) = difference(&by_palette, &truth);
    assert!(compared > 400 && worst < 1e-5, "{worst} in {compared} pixels");
    let mut other = Stage { gloss: Some(&sky_alone), ..Stage::new(&surfaces, &direct, &projection, &paints) };
    other.transfer = SceneTransfer::Bounced(&bounced);
    let refused = other.plan(&shot(&sky, &camera)).expect_err("gloss of one function").to_string();
    assert!(refused.starts_with("gloss has 1 functions of the wavelength"), "{refused}");
    let map = SpectralMap::new(&projection, [1, 1], vec![0], &paints[..1]).expect("a texel");
    stage.spectral_maps = vec![map.with_gloss(&projection, &lobes[0])];
    let uvs = vec![[0.5; 2]; surfaces[0].positions().len()];
    stage.albedos[0] = spectral_prt::Albedo::Mapped { map: 0, uvs };
    let (worst, _) = difference(&stage.picture(&shot(&sky, &camera)), &truth);
    assert!(worst < 1e-5, "by a map {worst}");
}

#[test]
fn gloss_that_does_not_fit_is_refused() {
    let surfaces = [ball(DMat3::IDENTITY, true)];
    let (wide, direct) = transfers(&surfaces);
    let white = [GRID.sample(|_| 1.0)];
    let camera = camera(DVec3::Z * 4.0);
    let sky = even(&RGB.light(&light(Illuminant::D65)));
    let first = shot(&sky, &camera);
    let gloss = |bands: u8| {
        GlossTransfer::new(&wide, Bands::new(bands).expect("up to ten"), &[lobe(4.0)]).expect("enough bands")
    };
    let (five, three) = (gloss(5), gloss(3));
    let stage = |gloss| Stage { gloss: Some(gloss), ..Stage::new(&surfaces, &direct, &RGB, &white) };
    let text = |stage: Stage<'_>| stage.plan(&first).expect_err("a bad plan").to_string();
    assert_eq!(
        text(stage(&five)),
        "the palette has 1 functions of the wavelength, the transfer with gloss has 2"
    );
    assert_eq!(text(stage(&three)), "gloss has 3 bands of harmonics, the transfer has 5");
    let (other, _) = transfers(&ball_and_wall());
    let other = GlossTransfer::new(&other, Bands::default(), &[lobe(4.0), None]).expect("enough bands");
    assert_eq!(
        text(stage(&other)),
        "gloss and transfer are of different surfaces: make gloss of this transfer, with more bands"
    );
}
