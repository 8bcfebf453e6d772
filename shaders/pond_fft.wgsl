// Fourier transforms of lines of an image, so many points at a time (Stockham; Govindaraju et al. 2008). Host side:
// `passes/pond_fft.rs`.
//
// A line of `length` points takes a pass where `radix` is `length`, else two whose radices multiply up to it. Transform j of a
// line takes points j + r T, T = length / radix, and leaves them at (j / span) span radix + j mod span + r span.

struct PondFft {
    axis: u32,       // 0: lines are rows; 1: columns
    radix: u32,      // a power of two up to 1024
    length: u32,     // of a line, a power of two
    span: u32,       // product of earlier passes' radices
    lines: u32,
    there: u32,      // points of a line that the input has
    behind: u32,     // the last so many points are those before the first
    periodic: u32,   // 1: the input goes on before and after what is there; 0: there it is 0
    pitch_in: u32,   // points from row to row
    plane_in: u32,   // points from image to image
    pitch_out: u32,
    plane_out: u32,
    complex_in: u32, // 1: the input is complex; 0: its images are real and parts of complex ones in turn
    first_in: u32,   // first complex image of the input
    inverse: u32,
    twiddles: u32,   // entries of `twiddles`
}

@group(0) @binding(0) var<uniform> params: PondFft;
@group(0) @binding(1) var<storage, read> input: array<f32>;
@group(0) @binding(2) var<storage, read> roots: array<vec2<f32>>; // exp(-2 pi i k / twiddles)
@group(0) @binding(3) var<storage, read_write> output: array<vec2<f32>>;

const POINTS: u32 = 1024u;      // of a workgroup
const INVOCATIONS: u32 = 256u;

var<workgroup> even: array<vec2<f32>, POINTS>;
var<workgroup> odd: array<vec2<f32>, POINTS>;

fn times(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
}

// exp(-2 pi i k / n), the other way round for inverse transforms.
fn root(k: u32, n: u32) -> vec2<f32> {
    let w = roots[k * (params.twiddles / n)];
    return select(w, vec2<f32>(w.x, -w.y), params.inverse == 1u);
}

fn address(line: u32, point: u32, pitch: u32) -> u32 {
    return select(line * pitch + point, point * pitch + line, params.axis == 1u);
}

fn point_in(image: u32, line: u32, point: u32) -> vec2<f32> {
    var at = i32(point);
    if point >= params.length - params.behind {
        at -= i32(params.length);
    }
    let there = i32(params.there);
    if params.periodic == 1u {
        at = ((at % there) + there) % there;
    } else if at >= there {
        return vec2<f32>(0.0);
    }
    let index = address(line, u32(at), params.pitch_in);
    let complex = params.first_in + image;
    if params.complex_in == 1u {
        let word = 2u * (complex * params.plane_in + index);
        return vec2<f32>(input[word], input[word + 1u]);
    }
    let real = 2u * complex * params.plane_in + index;
    return vec2<f32>(input[real], input[real + params.plane_in]);
}

// The transform of a workgroup that is its `b`th.
struct Transform {
    line: u32,
    j: u32,
    exists: bool,
}

fn transform(first: u32, b: u32) -> Transform {
    let per_line = params.length / params.radix;
    let index = first + b;
    let exists = index < params.lines * per_line;
    if params.axis == 1u {
        return Transform(index % params.lines, index / params.lines, exists);
    }
    return Transform(index / per_line, index % per_line, exists);
}

@compute @workgroup_size(256, 1, 1)
fn pond_fft(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let radix = params.radix;
    let batch = POINTS / radix;
    let per_line = params.length / radix;
    let first = (group.y * groups.x + group.x) * batch;
    // Neighbours in memory are taken by neighbours: points of a row, or points of rows beside each other.
    let rows_in = params.axis == 0u && per_line == 1u;
    for (var i = local; i < POINTS; i += INVOCATIONS) {
        let b = select(i % batch, i / radix, rows_in);
        let r = select(i / batch, i % radix, rows_in);
        let t = transform(first, b);
        var value = vec2<f32>(0.0);
        if t.exists {
            value = point_in(group.z, t.line, t.j + r * per_line);
            if params.span > 1u {
                value = times(value, root((t.j % params.span) * r, params.span * radix));
            }
        }
        even[r * batch + b] = value;
    }
    workgroupBarrier();
    var in_even = true;
    for (var span = 1u; span < radix; span *= 2u) {
        for (var i = local; i < POINTS / 2u; i += INVOCATIONS) {
            let b = i % batch;
            let j = i / batch;
            let k = j % span;
            let w = root(k, 2u * span);
            let low = j * batch + b;
            let high = low + POINTS / 2u;
            let to = ((j - k) * 2u + k) * batch + b;
            if in_even {
                let turned = times(w, even[high]);
                odd[to] = even[low] + turned;
                odd[to + span * batch] = even[low] - turned;
            } else {
                let turned = times(w, odd[high]);
                even[to] = odd[low] + turned;
                even[to + span * batch] = odd[low] - turned;
            }
        }
        in_even = !in_even;
        workgroupBarrier();
    }
    let rows_out = params.axis == 0u && params.span == 1u;
    for (var i = local; i < POINTS; i += INVOCATIONS) {
        let b = select(i % batch, i / radix, rows_out);
        let r = select(i / batch, i % radix, rows_out);
        let t = transform(first, b);
        if t.exists {
            let k = t.j % params.span;
            let point = (t.j - k) * radix + k + r * params.span;
            let value = select(odd[r * batch + b], even[r * batch + b], in_even);
            output[group.z * params.plane_out + address(t.line, point, params.pitch_out)] = value;
        }
    }
}
