// What a material does to light of one wavelength. Host side: asm-core's `shared/optics.rs`.

// A material at one wavelength.
struct Optics {
    index: f32,       // refractive index
    absorption: f32,  // per working unit
    surface: f32,     // share of refracted light that the surface lets pass; a mirror's reflectance at normal incidence
    reserved: f32,
}
