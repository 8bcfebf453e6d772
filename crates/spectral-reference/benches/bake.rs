//! Photons per second of the oracle.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use spectral_reference::{BakeSettings, Effort, bake};
use spectral_scene::bundled;

const PHOTONS: u64 = 1 << 16;

fn bakes(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("oracle");
    group.sample_size(10).throughput(Throughput::Elements(PHOTONS));
    for name in ["sphere", "gem", "ring"] {
        let scene = bundled(name).expect("a bundled scene");
        let receiver = scene.receiver("receiver").expect("every bundled scene has one");
        let settings =
            BakeSettings { size: [64, 64], effort: Effort::Photons(PHOTONS), ..BakeSettings::default() };
        group.bench_function(name, |b| b.iter(|| bake(&scene, receiver, &settings, &|_| ())));
    }
    group.finish();
}

criterion_group!(benches, bakes);
criterion_main!(benches);
