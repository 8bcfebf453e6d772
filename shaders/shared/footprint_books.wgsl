// What becomes of the light of cells, added up. Host side: asm-core's `shared/footprint_books.rs`.
//
// Expects the globals of `footprint_light.wgsl` and `ends`.

const LEDGER_SUMS: u32 = 180u; // MOST_NODES * LEDGER_ROWS * LEDGER_WORDS

var<workgroup> sums: array<atomic<u32>, LEDGER_SUMS>;

fn book(node: u32, row: u32, flux: u32, corner: u32) {
    if flux == 0u {
        return;
    }
    let word = LEDGER_WORDS * (LEDGER_ROWS * node + row);
    let before = atomicAdd(&sums[word], flux);
    if before + flux < before {
        atomicAdd(&sums[word + 1u], 1u);
    }
    if corner == 0u {
        atomicAdd(&sums[word + 2u], 1u);
    }
}

// What becomes of a cell's light; parts are taken off in turn, so that all of it is booked.
fn keep_books(emitted: Emitted, cell_flux: u32) {
    for (var path = 0u; path < 4u * params.cells.nodes; path++) {
        let corner = path / params.cells.nodes;
        let node = path % params.cells.nodes;
        let start = cell_share(emitted, cell_flux, node);
        let flux = (start + corner) / 4u;
        book(node, LEDGER_AIMED, flux, corner);
        let left = ends[path_of(emitted, corner, node)];
        if left.end == END_MISSED || left.end == END_BLOCKED {
            book(node, LEDGER_FIRST_END + left.end, flux, corner);
            continue;
        }
        book(node, LEDGER_EMITTED, flux, corner);
        if left.end != END_LANDED {
            book(node, LEDGER_FIRST_END + left.end, flux, corner);
            continue;
        }
        var running = left.reflected;
        var booked = flux_part(flux, running);
        book(node, LEDGER_REFLECTED, booked, corner);
        running += left.absorbed;
        book(node, LEDGER_ABSORBED, flux_part(flux, running) - booked, corner);
        booked = flux_part(flux, running);
        running += left.kept_inside;
        book(node, LEDGER_KEPT_INSIDE, flux_part(flux, running) - booked, corner);
        booked = flux_part(flux, running);
        for (var order = 0u; order < params.cells.orders; order++) {
            let landing = landing_of(emitted, corner, node, order);
            running += landing.part;
            let own = flux_part(flux, running) - booked;
            booked += own;
            if landing.end == END_LANDED {
                let lands = flux_part(own, comes_through(landing, share_of(emitted.cell, node), params.cells.materials).y);
                book(node, LEDGER_ABSORBED, own - lands, corner);
                book(node, LEDGER_FIRST_END + END_LANDED, lands, corner);
            } else {
                book(node, LEDGER_FIRST_END + landing.end, own, corner);
            }
        }
    }
}

// Luminous flux of the bins of a node.
fn cell_share(emitted: Emitted, cell_flux: u32, node: u32) -> u32 {
    let cell = emitted.cell;
    let start = band_weight(cell.first + share_start(params.cells.nodes, node, cell.bins), params.cells.materials).y;
    let end = band_weight(cell.first + share_start(params.cells.nodes, node + 1u, cell.bins), params.cells.materials).y;
    return flux_part(cell_flux, end) - flux_part(cell_flux, start);
}
