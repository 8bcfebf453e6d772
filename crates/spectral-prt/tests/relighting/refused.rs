//! What makes no plan and no frame says why.

use frame_plan::Limits;
use glam::{DMat3, DVec3};
use spectral_core::illuminant::Illuminant;
use spectral_prt::{
    Albedo, Bands, Exposure, IndexMap, Palette, Projection, Relighting, RelightingSettings, Shot, Sky,
    SpectralMap,
};

use crate::stage::*;

#[test]
fn what_does_not_fit_together_is_refused_with_its_place() {
    let (surface, uvs) = square();
    let surfaces = [surface];
    let transfer = transfer(&surfaces, 1);
    let white = [GRID.sample(|_| 1.0)];
    let basis = basis(5);
    let camera = camera(DVec3::new(0.0, 0.0, 4.0));
    let d65 = light(Illuminant::D65);
    let sky = even(&RGB.light(&d65));
    let good = || Stage::new(&surfaces, &transfer, &RGB, &white);
    let text = |stage: &Stage<'_>, shot: &Shot<'_>| stage.plan(shot).expect_err("a bad plan").to_string();
    let first = shot(&sky, &camera);
    assert!(good().plan(&first).is_ok());

    let with = |albedos: Vec<Albedo>| Stage { albedos, ..good() };
    assert_eq!(text(&with(vec![]), &first), "0 albedos for 1 surfaces; there is one for each");
    assert_eq!(
        text(&with(vec![Albedo::Entry(3)]), &first),
        "surface 0 names entry of the palette 3, there are 1"
    );
    assert_eq!(
        text(&with(vec![Albedo::Indexed { map: 0, uvs: uvs.clone() }]), &first),
        "surface 0 names index map 0, there are 0"
    );
    let mut mapped = with(vec![Albedo::Indexed { map: 0, uvs: uvs[..2].to_vec() }]);
    mapped.index_maps = vec![IndexMap::new([1, 1], vec![0]).unwrap()];
    assert_eq!(
        text(&mapped, &first),
        "surface 0 has 4 vertices and 2 texture coordinates; there is one for each"
    );
    mapped.albedos = vec![Albedo::Indexed { map: 0, uvs: vec![[0.0, f32::NAN]; 4] }];
    assert_eq!(
        text(&mapped, &first),
        "a texture coordinate is NaN; it must be finite, as all texture coordinates"
    );
    mapped.index_maps = vec![IndexMap::new([1, 1], vec![1]).unwrap()];
    assert_eq!(text(&mapped, &first), "index map 0 names entry of the palette 1, there are 1");
    let maps = [[1, 1], [2, 1]]
        .map(|size: [u32; 2]| SpectralMap::new(&RGB, size, vec![0; size[0] as usize], &white).unwrap());
    let two_sizes = Stage { spectral_maps: maps.to_vec(), ..good() };
    assert_eq!(
        text(&two_sizes, &first),
        "spectral map 1 has 2 x 1 texels, map 0 has 1 x 1: all have one size"
    );

    let other = Stage { palette: Palette::new(&Projection::Spectral(&basis), &white), ..good() };
    assert_eq!(text(&other, &first), "the sky has 3 spectral coefficients, the palette has 5");
    let few = Sky::even(Bands::new(3).unwrap(), &RGB.light(&d65));
    assert_eq!(
        text(&good(), &Shot { sky: &few, ..first }),
        "the sky has 3 bands of harmonics, the transfer has 5"
    );
    let bad = even(&[1.0, f64::NAN, 0.0]);
    assert_eq!(
        text(&good(), &Shot { sky: &bad, ..first }),
        "a coefficient of the sky is NaN; it must be finite in f32"
    );
    let sheared = DMat3::from_diagonal(DVec3::new(1.0, 2.0, 1.0));
    assert!(text(&good(), &Shot { rotation: sheared, ..first }).starts_with("not a rotation"));
    let exposure = Exposure { factor: -1.0, balance: None };
    assert_eq!(
        text(&good(), &Shot { exposure, ..first }),
        "the exposure is -1; it must be finite and not negative"
    );
    let mut blind = camera.clone();
    blind.yfov_rad = 0.0;
    assert_eq!(
        text(&good(), &Shot { camera: &blind, ..first }),
        "the camera's opening, rad is 0; it must be above 0 and below pi"
    );
    let none = Stage { settings: RelightingSettings { size: [0, 4], samples: 1 }, ..good() };
    assert_eq!(text(&none, &first), "the picture's width is 0; it must be 1 or more");
}

#[test]
fn what_does_not_fit_into_a_device_is_refused_with_the_numbers() {
    let surfaces = [ball(DMat3::IDENTITY, true)];
    let transfer = transfer(&surfaces, 1);
    let white = [GRID.sample(|_| 1.0)];
    let camera = camera(DVec3::new(0.0, 0.0, 4.0));
    let sky = even(&RGB.light(&light(Illuminant::D65)));
    let stage = Stage::new(&surfaces, &transfer, &RGB, &white);
    let refused = |limits: Limits, settings: RelightingSettings| {
        Relighting::new(&stage.scene(), &shot(&sky, &camera), &settings, &limits)
            .expect_err("too large")
            .to_string()
    };
    let limits = Limits::default();
    assert_eq!(
        refused(limits, RelightingSettings { size: [5000, 10], samples: 2 }),
        "the view needs 10000 texels along a side, the device takes 8192: lower the picture's size"
    );
    let small = Limits { max_storage_binding_bytes: 8192, ..limits };
    let bytes = 4 * 25 * surfaces[0].positions().len();
    assert_eq!(
        refused(small, stage.settings),
        format!(
            "buffer transfer needs {bytes} bytes, the device takes 8192: lower the number of vertices, bands or bounces"
        )
    );
}

#[test]
fn maps_need_their_texels() {
    let text = |size, texels: Vec<u32>| IndexMap::new(size, texels).expect_err("a bad map").to_string();
    assert_eq!(text([2, 2], vec![0; 3]), "a map of 2 x 2 texels has 3");
    assert_eq!(text([0, 2], vec![]), "a map of 0 x 2 texels has 0");
    let white = [GRID.sample(|_| 1.0)];
    let named = SpectralMap::new(&RGB, [1, 1], vec![1], &white).expect_err("a bad map").to_string();
    assert_eq!(named, "a texel names reflectance 1, there are 1");
}
