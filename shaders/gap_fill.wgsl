// Fills gaps in a map of 64-bit fixed point. All in integers: the same bits on every device. Host side:
// `passes/gap_fill.rs`.

struct GapFill {
    size: vec2<u32>,  // of one face of the map
    rows: u32,        // of all faces together
    rule: u32,        // GAP_*
    samples: u32,     // of GAP_PAPER and GAP_PAPER_LITERAL
    threshold: u32,   // hits among them
    offsets: u32,     // number of offsets
    share: u32,       // of GAP_DISC: what a texel gives to each other, in 2^-16 of what it has
    first_row: u32,   // of this light's, in `energy`
    reserved0: u32,
    reserved1: u32,
    reserved2: u32,
}

@group(0) @binding(0) var<uniform> params: GapFill;
@group(0) @binding(1) var<storage, read> map: array<u32>;
@group(0) @binding(2) var<storage, read> offsets: array<vec2<i32>>;
@group(0) @binding(3) var<storage, read> mask: array<u32>;
@group(0) @binding(4) var<storage, read_write> filled: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> energy: array<atomic<u32>>;

// 64-bit numbers as low and high word, one per channel.
struct Flux {
    low: vec3<u32>,
    high: vec3<u32>,
}

fn flux_at(index: u32) -> Flux {
    let w = 6u * index;
    return Flux(vec3<u32>(map[w], map[w + 2u], map[w + 4u]), vec3<u32>(map[w + 1u], map[w + 3u], map[w + 5u]));
}

fn plus(a: Flux, b: Flux) -> Flux {
    let low = a.low + b.low;
    return Flux(low, a.high + b.high + vec3<u32>(low < b.low));
}

fn minus(a: Flux, b: Flux) -> Flux {
    return Flux(a.low - b.low, a.high - b.high - vec3<u32>(a.low < b.low));
}

// Division by a number below 2^16, limb by limb.
fn over(a: Flux, divisor: u32) -> Flux {
    let sixteen = vec3<u32>(16u);
    let below = vec3<u32>(0xffffu);
    var limbs = array<vec3<u32>, 4>(a.high >> sixteen, a.high & below, a.low >> sixteen, a.low & below);
    var quotients: array<vec3<u32>, 4>;
    var rest = vec3<u32>(0u);
    for (var i = 0u; i < 4u; i++) {
        let dividend = (rest << sixteen) | limbs[i];
        quotients[i] = dividend / divisor;
        rest = dividend - quotients[i] * divisor;
    }
    return Flux((quotients[2] << sixteen) | quotients[3], (quotients[0] << sixteen) | quotients[1]);
}

// Number times a part in 2^-16 that is below 2^14, rounded down.
fn share_of(a: Flux, part: u32) -> Flux {
    let sixteen = vec3<u32>(16u);
    let below = vec3<u32>(0xffffu);
    let second = (a.high & below) * part;
    var low = (a.low >> sixteen) * part + (((a.low & below) * part) >> sixteen);
    let middle = second << sixteen;
    low += middle;
    return Flux(low, (a.high >> sixteen) * part + (second >> sixteen) + vec3<u32>(low < middle));
}

// Integer hash (Wellons' lowbias32): the pattern is the map's, frame after frame.
fn scrambled(seed: u32) -> u32 {
    var x = seed;
    x = (x ^ (x >> 16u)) * 0x7feb352du;
    x = (x ^ (x >> 15u)) * 0x846ca68bu;
    return x ^ (x >> 16u);
}

fn filled_by_samples(texel: vec2<u32>, index: u32, own: Flux) -> Flux {
    var sum = Flux(vec3<u32>(0u), vec3<u32>(0u));
    var hits = 0u;
    for (var i = 0u; i < params.samples; i++) {
        let pick = scrambled(index * params.samples + i) % params.offsets;
        let at = texel_at(texel, offsets[pick]);
        if at != NO_TEXEL && mask[at] == MASK_LIT {
            sum = plus(sum, flux_at(at));
            hits += 1u;
        }
    }
    if params.rule == GAP_PAPER_LITERAL {
        if hits > params.threshold {
            return sum;
        }
        return own;
    }
    if hits < params.threshold {
        return own;
    }
    return over(plus(sum, own), hits + u32(mask[index] == MASK_LIT));
}

// What one texel gives the other gets, and every texel within the radius of another gives to it as much as that one
// would in its place: light is kept, and where all hold the same nothing changes. Gaps and what is beside them take part.
fn exchanged_in_disc(texel: vec2<u32>, index: u32, own: Flux) -> Flux {
    if mask[index] < MASK_GAP {
        return own;
    }
    let given = share_of(own, params.share);
    var sum = own;
    for (var i = 0u; i < params.offsets; i++) {
        let at = texel_at(texel, offsets[i]);
        if at == NO_TEXEL || mask[at] < MASK_GAP {
            continue;
        }
        sum = minus(sum, given);
        if mask[at] == MASK_BESIDE {
            sum = plus(sum, share_of(flux_at(at), params.share));
        }
    }
    return sum;
}

const TEXELS: u32 = 64u;       // per workgroup
const ENERGY_ROWS: u32 = 8u;   // X, Y, Z before, X, Y, Z after, lit texels before and after
const ENERGY_WORDS: u32 = 3u;  // of a 96-bit number, low word first

var<workgroup> numbers: array<vec2<u32>, 512>; // row * TEXELS + texel

@compute @workgroup_size(8, 8, 1)
fn gap_fill(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    for (var row = 0u; row < ENERGY_ROWS; row++) {
        numbers[row * TEXELS + local] = vec2<u32>(0u);
    }
    if id.x < params.size.x && id.y < params.rows {
        let index = id.y * params.size.x + id.x;
        let before = flux_at(index);
        var after = before;
        if params.rule == GAP_DISC {
            after = exchanged_in_disc(id.xy, index, before);
        } else {
            after = filled_by_samples(id.xy, index, before);
        }
        for (var c = 0u; c < 3u; c++) {
            atomicStore(&filled[6u * index + 2u * c], after.low[c]);
            atomicStore(&filled[6u * index + 2u * c + 1u], after.high[c]);
            numbers[c * TEXELS + local] = vec2<u32>(before.low[c], before.high[c]);
            numbers[(3u + c) * TEXELS + local] = vec2<u32>(after.low[c], after.high[c]);
        }
        numbers[6u * TEXELS + local].x = u32(any((before.low | before.high) != vec3<u32>(0u)));
        numbers[7u * TEXELS + local].x = u32(any((after.low | after.high) != vec3<u32>(0u)));
    }
    workgroupBarrier();
    if local >= ENERGY_ROWS {
        return;
    }
    var sum = vec3<u32>(0u);
    for (var i = 0u; i < TEXELS; i++) {
        let number = numbers[local * TEXELS + i];
        sum.x += number.x;
        let carry = u32(sum.x < number.x);
        sum.y += carry;
        sum.z += u32(sum.y < carry);
        sum.y += number.y;
        sum.z += u32(sum.y < number.y);
    }
    if all(sum == vec3<u32>(0u)) {
        return;
    }
    let word = ENERGY_WORDS * (params.first_row + local);
    let low_before = atomicAdd(&energy[word], sum.x);
    if low_before + sum.x < sum.x && atomicAdd(&energy[word + 1u], 1u) == 0xffffffffu {
        sum.z += 1u;
    }
    let middle_before = atomicAdd(&energy[word + 1u], sum.y);
    if middle_before + sum.y < sum.y {
        sum.z += 1u;
    }
    if sum.z != 0u {
        atomicAdd(&energy[word + 2u], sum.z);
    }
}
