// What a path does at other nodes than the middle one, as told by how wavelengths go apart at corners around it. Host side: asm-core's
// `shared/path_spread.rs`.
//
// Expects the globals `landings`, `ends`, `views`, `params.nodes`, `params.orders`, `params.landing_view` and `params.tolerance`.

// Corners around one, and where it lies between them, 0 to 1 in x and y.
struct Around {
    places: vec4<u32>, // upper left, upper right, lower left, lower right
    weight: vec2<f32>,
}

// Of what a path lands off the plane through those around, its nodes land apart by so much at most: dispersion of dense flint.
const MOST_DISPERSION: f32 = 1.0 / 16.0;

// Between corners around, what changes from one to another is off by so much of that at most: a parabola that begins or ends level.
const MOST_BETWEEN: f32 = 0.25;

// Flux is not told where what lies between its nodes changes more from one corner around to another, as a share of a path's.
const MOST_UNEVEN: f32 = 1.0 / 128.0;

// From one part to another, as a share of the whole.
fn share_apart(a: u32, b: u32) -> f32 {
    return f32(i32(b - a)) / f32(WHOLE);
}

// From one node's landing to another's: texels in x and y, share of the flux, length inside.
fn apart_of(a: PathLanding, b: PathLanding) -> vec4<f32> {
    return vec4<f32>(b.texel - a.texel, share_apart(a.part, b.part), b.length - a.length);
}

fn told_part(part: u32, apart: f32, left: u32) -> u32 {
    let by = i32(apart * f32(WHOLE));
    return min(select(part + u32(by), 0u, by < 0 && u32(-by) > part), left);
}

fn landing_around(around: Around, corner: u32, node: u32, order: u32) -> PathLanding {
    return landings[(around.places[corner] * params.nodes + node) * params.orders + order];
}

// From the middle node's landing to another's.
struct NodeShift {
    known: bool,      // light goes one way around at both nodes, and changes so little that it is known between the corners
    apart: vec4<f32>, // see apart_of
}

fn shift_around(own: PathLanding, around: Around, node: u32, order: u32) -> NodeShift {
    var texels: array<vec2<f32>, 4>;
    var apart: array<vec4<f32>, 4>;
    var together = true;
    for (var corner = 0u; corner < 4u; corner++) {
        let a = landing_around(around, corner, middle_node(params.nodes), order);
        let b = landing_around(around, corner, node, order);
        together &= go_together(own, a) && go_together(own, b);
        texels[corner] = a.texel;
        apart[corner] = apart_of(a, b);
    }
    let weight = around.weight;
    let off = own.texel - mix(mix(texels[0], texels[1], weight.x), mix(texels[2], texels[3], weight.x), weight.y);
    let range = max(max(apart[0], apart[1]), max(apart[2], apart[3])) - min(min(apart[0], apart[1]), min(apart[2], apart[3]));
    let error = max(MOST_DISPERSION * max(abs(off.x), abs(off.y)), MOST_BETWEEN * max(range.x, range.y));
    let between = mix(mix(apart[0], apart[1], weight.x), mix(apart[2], apart[3], weight.x), weight.y);
    return NodeShift(together && error <= params.tolerance && range.z <= MOST_UNEVEN, between);
}

// What lands is on the landing view; a path that leaves it ends otherwise.
fn beside_view(landing: PathLanding) -> bool {
    let size = vec2<f32>(views[params.landing_view + (landing.place & 0xffu)].size);
    return landing.end == END_LANDED && (any(landing.texel < vec2<f32>(0.0)) || any(landing.texel >= size));
}

// The path of a place at a node that is not the middle one, if what is around tells it to within the tolerance.
fn tell_path(place: u32, around: Around, node: u32) -> bool {
    let middle = place * params.nodes + middle_node(params.nodes);
    let path = place * params.nodes + node;
    let own = ends[middle];
    if own.end == END_MISSED || own.end == END_BLOCKED {
        // No surface has parted the wavelengths.
        for (var order = 0u; order < params.orders; order++) {
            landings[path * params.orders + order] = landings[middle * params.orders + order];
        }
        ends[path] = own;
        return true;
    }
    var apart: array<vec2<f32>, 4>;
    for (var corner = 0u; corner < 4u; corner++) {
        let a = ends[around.places[corner] * params.nodes + middle_node(params.nodes)];
        let b = ends[around.places[corner] * params.nodes + node];
        if own.end != END_LANDED || a.end != END_LANDED || b.end != END_LANDED {
            return false;
        }
        apart[corner] = vec2<f32>(share_apart(a.absorbed, b.absorbed), share_apart(a.kept_inside, b.kept_inside));
    }
    // Those written for an order before one that is not known are written again by whoever traces them.
    var left = WHOLE;
    for (var order = 0u; order < params.orders; order++) {
        var landing = landings[middle * params.orders + order];
        let shift = shift_around(landing, around, node, order);
        landing.texel += shift.apart.xy;
        if !shift.known || beside_view(landing) {
            return false;
        }
        landing.part = told_part(landing.part, shift.apart.z, left);
        landing.length += shift.apart.w;
        left -= landing.part;
        landings[path * params.orders + order] = landing;
    }
    let between = mix(mix(apart[0], apart[1], around.weight.x), mix(apart[2], apart[3], around.weight.x), around.weight.y);
    let absorbed = told_part(own.absorbed, between.x, left);
    left -= absorbed;
    let kept_inside = told_part(own.kept_inside, between.y, left);
    ends[path] = PathEnds(END_LANDED, left - kept_inside, absorbed, kept_inside);
    return true;
}
