// Where a ray inside a refractor leaves it, from what a view shows of its faces. Host side: asm-core's
// `shared/exit_search.rs`.
//
// guess     a distance along the ray; the view shows a face there, and that face's plane is the next guess as long as it lies
//           between where the ray was seen inside and where outside; else the middle of those two is
//
// A crossing inside its triangle is the answer, and so is the plane on which guesses come to rest: its triangle is looked for
// in the texels round about, since a texel shows what its centre sees. Where guesses find no rest, the nearest plane is taken,
// which is right for convex bodies. No choice hangs on which of two distances that are equal up to rounding is the greater: two
// devices round differently. Expects the global `triangles`; a pass loads what its own texture shows:
//
//     var search = exit_search(reach, side);
//     for (var i = 0u; i < iterations && !search.done; i++) {
//         search = exit_search_step(search, shown(exit_search_guess(search, ray)), ray, object);
//     }
//     if exit_search_is_close(search) {
//         for each of the eight texels round the guess { search = exit_search_beside(search, shown(texel), ray, object); }
//     }

struct ExitSearch {
    found: bool,
    contained: bool,  // the crossing is in its triangle, not only in its plane
    done: bool,
    triangle: u32,
    hit: PlaneHit,
    distance: f32,    // the guess
    inner: f32,       // the ray was seen inside here
    outer: f32,       // and outside here
    side: f32,        // 1 in a body, EXIT_OF_BODY; -1 in what a hollow one encloses, as is light that a ring throws inwards
}

const EXIT_OF_BODY: f32 = 1.0;

// No way out is longer than `reach`.
fn exit_search(reach: f32, side: f32) -> ExitSearch {
    return ExitSearch(false, false, false, 0u, PlaneHit(false, 0.0, 0.0, 0.0, 0.0), 0.0, 0.0, reach, side);
}

// The crossing of a face that a ray can leave by, `facing` above 0 there whatever the ray is in. A ray that starts on a face
// starts up to SAME_SURFACE beside it, and does not leave by it.
fn exit_hit(visible: u32, ray: Ray, object: u32, side: f32) -> PlaneHit {
    if visible == NOTHING || triangles[visible - 1u].object != object {
        return PlaneHit(false, 0.0, 0.0, 0.0, 0.0);
    }
    var hit = plane_hit(triangles[visible - 1u], ray);
    hit.facing *= side;
    hit.crosses = hit.crosses && hit.facing > 0.0 && hit.distance > SAME_SURFACE;
    return hit;
}

// `visible` is what the view shows at the guess.
fn exit_search_step(before: ExitSearch, visible: u32, ray: Ray, object: u32) -> ExitSearch {
    var search = before;
    let hit = exit_hit(visible, ray, object, search.side);
    if hit.crosses {
        search.contained = inside(hit);
        search.done = search.contained || abs(hit.distance - search.distance) <= SAME_SURFACE;
        if search.done || !search.found || hit.distance < search.hit.distance {
            search.found = true;
            search.triangle = visible - 1u;
            search.hit = hit;
        }
        if search.done {
            search.distance = hit.distance;
            return search;
        }
    }
    // Behind the plane of a face of the body, or where the view shows none of it, a guess is outside.
    if hit.facing * (search.distance - hit.distance) < 0.0 {
        search.inner = search.distance;
    } else if search.distance > 0.0 {
        search.outer = search.distance;
    }
    let between = hit.crosses && hit.distance > search.inner && hit.distance < search.outer;
    search.distance = select(0.5 * (search.inner + search.outer), hit.distance, between);
    return search;
}

// The crossing may be another triangle's round about: rounding chooses between those that meet in an edge, and a line of
// photons may follow one.
fn exit_search_is_close(search: ExitSearch) -> bool {
    return search.found && !well_inside(search.hit);
}

// `visible` is what the view shows beside the crossing.
fn exit_search_beside(before: ExitSearch, visible: u32, ray: Ray, object: u32) -> ExitSearch {
    var search = before;
    let hit = exit_hit(visible, ray, object, search.side);
    if preferred(hit, visible - 1u, search.hit, search.triangle) {
        search.triangle = visible - 1u;
        search.hit = hit;
        search.contained = true;
    }
    return search;
}
