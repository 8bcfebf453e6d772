//! A host application that owns device, queue and a target texture, and puts caustics into its own frame.
//!
//! It has no window: at the end it writes what its texture holds to a PNG file.
//! `cargo run -p asm-wgpu --example host [SCENE] [FILE.png]`

use asm_core::{PASSES, Settings};
use asm_wgpu::{AsmRenderer, DisplayPass, WgpuExecutor, wgpu};
use spectral_core::display::{Display, ToneMap};

const SIZE: [u32; 2] = [640, 360];
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
const FRAMES: u32 = 5;
/// Bytes of a row of the target: a multiple of 256, as copies from textures need it.
const ROW_BYTES: u32 = SIZE[0] * 4;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (mut scene, _) = spectral_scene::open(&arguments.next().unwrap_or_else(|| "sphere".into()))?;
    let file = arguments.next().unwrap_or_else(|| "host.png".into());

    // The host's own device and target.
    let instance = wgpu::Instance::default();
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default()))?;
    let target = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("host target"),
        size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = target.create_view(&wgpu::TextureViewDescriptor::default());

    // Once: the executor runs on the host's device, the display draws into targets of this format.
    let mut caustics = AsmRenderer::new(WgpuExecutor::from_host(device.clone(), queue.clone(), PASSES));
    let mut pass = DisplayPass::new(&device, FORMAT);
    let display = Display { exposure: 2.0, tone_map: ToneMap::Reinhard { white: 8.0 } };

    // Every frame: something moves, the host's encoder takes the caustics, and whatever the host draws before and after them.
    for _ in 0..FRAMES {
        scene.cameras[0].world_from_camera.w_axis.x += 0.002;
        caustics.update(&scene, 0, SIZE, &Settings::default())?;
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        pass.record_frame(&mut caustics, &mut encoder, &view, &display)?;
        queue.submit([encoder.finish()]);
    }

    let pixels = read(&device, &queue, &target)?;
    let writer = std::io::BufWriter::new(std::fs::File::create(&file)?);
    let mut png = png::Encoder::new(writer, SIZE[0], SIZE[1]);
    png.set_color(png::ColorType::Rgba);
    png.write_header()?.write_image_data(&pixels)?;
    let lit = pixels.chunks_exact(4).filter(|p| p[..3] != [0; 3]).count();
    println!("{file}: {} x {}, {lit} pixels are not black", SIZE[0], SIZE[1]);
    Ok(())
}

/// What the target holds.
fn read(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    target: &wgpu::Texture,
) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let staging = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("host read back"),
        size: u64::from(ROW_BYTES * SIZE[1]),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(ROW_BYTES), rows_per_image: None };
    encoder.copy_texture_to_buffer(
        target.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &staging, layout },
        target.size(),
    );
    let (sender, receiver) = std::sync::mpsc::channel();
    encoder.map_buffer_on_submit(&staging, wgpu::MapMode::Read, .., move |result| {
        // The receiver waits below.
        let _ = sender.send(result);
    });
    queue.submit([encoder.finish()]);
    device.poll(wgpu::PollType::wait_indefinitely())?;
    receiver.recv()??;
    Ok(staging.get_mapped_range(..)?.to_vec())
}
