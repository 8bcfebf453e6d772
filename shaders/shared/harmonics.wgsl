// Real spherical harmonics of a unit direction, as spectral-prt's `sh` has them. Host side: `shared/harmonics.rs`.

const MOST_BANDS: u32 = 5u; // of those who shine: 25 harmonics
const QUARTER_OVER_PI: f32 = 0.0795774715;

fn harmonics(bands: u32, direction: vec3<f32>) -> array<f32, 25> {
    var out: array<f32, 25>;
    // Sine of the polar angle to the m times cosine and sine of m times the azimuth; over that sine, the sectoral Legendre function.
    var round = vec2<f32>(1.0, 0.0);
    var sectoral = sqrt(QUARTER_OVER_PI);
    for (var m = 0u; m < min(bands, MOST_BANDS); m++) {
        if m > 0u {
            round = vec2<f32>(
                direction.x * round.x - direction.y * round.y,
                direction.x * round.y + direction.y * round.x,
            );
            sectoral *= sqrt(f32(2u * m + 1u) / f32(2u * m));
        }
        let scale = select(1.4142135624, 1.0, m == 0u);
        var before = 0.0;
        var legendre = sectoral;
        for (var l = m; l < min(bands, MOST_BANDS); l++) {
            if l > m {
                let a = sqrt(f32(4u * l * l - 1u) / f32(l * l - m * m));
                let below = (l - 1u) * (l - 1u);
                // At l = m + 1 nothing lies two degrees below: b is 0.
                let b = sqrt(f32(below - min(m * m, below)) / f32(max(4u * below, 2u) - 1u));
                let next = a * (direction.z * legendre - b * before);
                before = legendre;
                legendre = next;
            }
            let at = l * l + l;
            out[at + m] = scale * legendre * round.x;
            if m > 0u {
                out[at - m] = scale * legendre * round.y;
            }
        }
    }
    return out;
}
