//! The window: events in, frames out.

use std::sync::Arc;
use std::time::{Duration, Instant};

use asm_core::{PASSES, Picture};
use asm_wgpu::{WgpuExecutor, wgpu};
use egui::ViewportId;
use frame_plan::Executor;
use spectral_cli::CliError;
use spectral_cli::output::atomic_file::AtomicFile;
use spectral_cli::output::png;
use spectral_cli::picture::auto_exposure;
use spectral_cli::values::Size;
use spectral_cli::view::ViewArgs;
use spectral_core::display::Display;
use spectral_scene::Scene;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Window, WindowId};

use crate::choices::Runner;
use crate::graphics::Graphics;
use crate::job::{Job, Report};
use crate::maker::{Maker, Progress};
use crate::panel::{self, Status};
use crate::screen::Screen;
use crate::times::{PassTimes, moving_mean};
use crate::view::View;

/// Show the scene of the command line until the window is closed.
///
/// # Errors
/// A scene that cannot be shown, no display, no device; with `--frames`, whatever keeps a picture from being made.
pub(crate) fn show(args: &ViewArgs) -> Result<(), CliError> {
    // Before a window appears.
    args.settings()?;
    let screenshot = args.screenshot_file()?;
    let scene = spectral_cli::open(&args.scene)?.scene;
    let event_loop = EventLoop::new().map_err(no_window)?;
    let mut program =
        Program { args, scene, screenshot, wake: event_loop.create_proxy(), open: None, ended: Ok(()) };
    event_loop.run_app(&mut program).map_err(no_window)?;
    program.ended
}

/// A failure of the display.
fn no_window(error: impl std::fmt::Display) -> CliError {
    let text = error.to_string();
    // winit says which line of its source found out, and then what.
    let words = text
        .split_once(".rs:")
        .and_then(|(_, rest)| rest.split_once(": "))
        .map_or(&*text, |(_, words)| words);
    CliError::Failed(format!("no window can be opened: {words}"))
}

/// The program while its event loop runs.
struct Program<'a> {
    args: &'a ViewArgs,
    scene: Scene,
    screenshot: Option<AtomicFile>,
    wake: EventLoopProxy<()>,
    open: Option<Open>,
    ended: Result<(), CliError>,
}

/// The window with everything in it.
struct Open {
    scene: Scene,
    wake: EventLoopProxy<()>,
    graphics: Graphics,
    input: egui_winit::State,
    painter: egui_wgpu::Renderer,
    screen: Screen,
    view: View,
    maker: Maker,
    /// Whom `maker` was made for.
    runner: Runner,
    /// What was last begun, and how it was to be shown.
    last: Option<(Job, Display)>,
    /// How the newest frame shows its picture.
    drawn: Option<Display>,
    status: Status,
    /// The status has changed since the panel last told it.
    untold: bool,
    /// Pictures shown so far.
    pictures: u32,
    last_frame: Instant,
    last_picture: Option<Instant>,
}

impl Program<'_> {
    /// A failure ends the program.
    fn end(&mut self, event_loop: &ActiveEventLoop, ended: Result<(), CliError>) {
        self.ended = ended;
        event_loop.exit();
    }

    fn frame(&mut self, event_loop: &ActiveEventLoop) -> Result<(), CliError> {
        let Some(open) = &mut self.open else { return Ok(()) };
        // What the panel says of a picture stands in the frame after it.
        let last = self.args.frames.is_some_and(|frames| open.pictures >= frames);
        let copied = open.frame(event_loop, last && self.screenshot.is_some())?;
        let Some(frames) = self.args.frames else { return Ok(()) };
        if let Some(error) = open.status.error.take() {
            return Err(CliError::Failed(error));
        }
        match (&self.screenshot, copied) {
            _ if open.pictures < frames => return Ok(()),
            (Some(_), None) => {
                open.graphics.window.request_redraw();
                return Ok(());
            }
            (Some(file), Some(copied)) => {
                let [width, height] = open.graphics.size();
                let pixels = open.graphics.read_frame(&copied)?;
                png::write(file, Size { width, height }, &pixels).map_err(|error| {
                    CliError::Failed(format!("cannot write {}: {error}", file.path().display()))
                })?;
            }
            (None, _) => {}
        }
        event_loop.exit();
        Ok(())
    }
}

impl ApplicationHandler for Program<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.open.is_none() {
            match Open::new(event_loop, self.args, self.scene.clone(), self.wake.clone()) {
                Ok(open) => self.open = Some(open),
                Err(error) => self.end(event_loop, Err(error)),
            }
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else { return };
        let response = open.input.on_window_event(&open.graphics.window, &event);
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => {
                open.graphics.resize(size);
                open.graphics.window.request_redraw();
            }
            WindowEvent::RedrawRequested => {
                if let Err(error) = self.frame(event_loop) {
                    self.end(event_loop, Err(error));
                }
            }
            _ if response.repaint => open.graphics.window.request_redraw(),
            _ => {}
        }
    }

    /// A picture from another thread is there.
    fn user_event(&mut self, _: &ActiveEventLoop, (): ()) {
        if let Some(open) = &self.open {
            open.graphics.window.request_redraw();
        }
    }

    fn new_events(&mut self, event_loop: &ActiveEventLoop, cause: StartCause) {
        if let (StartCause::ResumeTimeReached { .. }, Some(open)) = (cause, &self.open) {
            event_loop.set_control_flow(ControlFlow::Wait);
            open.graphics.window.request_redraw();
        }
    }

    /// What lives on the display goes before it.
    fn exiting(&mut self, _: &ActiveEventLoop) {
        self.open = None;
    }
}

impl Open {
    fn new(
        event_loop: &ActiveEventLoop,
        args: &ViewArgs,
        scene: Scene,
        wake: EventLoopProxy<()>,
    ) -> Result<Self, CliError> {
        let attributes = Window::default_attributes()
            .with_title(format!("spectral view {}", scene.name))
            .with_inner_size(PhysicalSize::new(args.size.width, args.size.height));
        let window = event_loop.create_window(attributes).map_err(no_window)?;
        let graphics = Graphics::new(event_loop, Arc::new(window), args.screenshot.is_some())?;
        let options = egui_wgpu::RendererOptions::default();
        let mut painter = egui_wgpu::Renderer::new(&graphics.device, graphics.format(), options);
        let screen = Screen::new(&graphics, &mut painter);
        let (device, queue) = (graphics.device.clone(), graphics.queue.clone());
        let device_info = WgpuExecutor::from_host(device, queue, PASSES).info().clone();
        let view = View::new(&scene, args, &device_info)?;
        let runner = view.choices.runner;
        let most = graphics.device.limits().max_texture_dimension_2d as usize;
        let context = egui::Context::default();
        // Pictures are judged against dark surroundings.
        context.set_theme(egui::Theme::Dark);
        let input =
            egui_winit::State::new(context, ViewportId::ROOT, &*graphics.window, None, None, Some(most));
        graphics.window.request_redraw();
        Ok(Self {
            maker: maker(runner, &scene, &graphics, &wake),
            scene,
            wake,
            graphics,
            input,
            painter,
            screen,
            view,
            runner,
            last: None,
            drawn: None,
            status: Status::default(),
            untold: false,
            pictures: 0,
            last_frame: Instant::now(),
            last_picture: None,
        })
    }

    /// Draw a frame, unless there is nothing to see it; `copied` for a screenshot.
    ///
    /// # Errors
    /// If the window's device failed. Whatever keeps a picture from being made goes into the status.
    fn frame(
        &mut self,
        event_loop: &ActiveEventLoop,
        copied: bool,
    ) -> Result<Option<wgpu::Buffer>, CliError> {
        let Some(frame) = self.graphics.next_frame()? else { return Ok(None) };
        self.view.advance(self.last_frame.elapsed().as_secs_f64());
        self.last_frame = Instant::now();

        let window = Arc::clone(&self.graphics.window);
        let context = self.input.egui_ctx().clone();
        let mut area = [0, 0];
        let egui::FullOutput { platform_output, textures_delta, shapes, pixels_per_point, viewport_output } =
            context.run_ui(self.input.take_egui_input(&window), |ui| {
                area = panel::show(ui, &mut self.view, &self.status, self.screen.id);
            });
        self.input.handle_platform_output(&window, platform_output);
        self.untold = false;

        let mut encoder =
            self.graphics.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let recorded = self.record_picture(area, &mut encoder);
        let shapes = context.tessellate(shapes, pixels_per_point);
        self.paint(&frame.texture, &mut encoder, &shapes, textures_delta, pixels_per_point);
        let copy = copied.then(|| self.graphics.copy_frame(&frame.texture, &mut encoder));
        self.graphics.queue.submit([encoder.finish()]);
        self.graphics.queue.present(frame);
        if recorded {
            self.after_submit();
        }
        self.schedule(event_loop, viewport_output.get(&ViewportId::ROOT).map(|root| root.repaint_delay));
        Ok(copy)
    }

    /// Have a picture made where one is due; whether it is part of this frame.
    fn record_picture(&mut self, area: [u32; 2], encoder: &mut wgpu::CommandEncoder) -> bool {
        let Self { graphics, painter, screen, view, maker, status, .. } = self;
        if self.runner != view.choices.runner {
            self.runner = view.choices.runner;
            *maker = self::maker(self.runner, &self.scene, graphics, &self.wake);
            (self.last, self.last_picture, *status) = (None, None, Status::default());
        }
        let (job, display) = (view.job(area), view.display());
        let now = (job, display);
        let changed = self.last.as_ref() != Some(&now);
        // What failed is tried again once it is something else.
        let due = changed || !(view.paused || status.error.is_some());
        screen.fit(graphics, painter, now.0.size);
        let progress = maker.record(&now.0, due, (graphics, encoder), screen, &display);
        self.drawn = Some(display);
        match progress {
            Err(error) => {
                self.failed(error);
                self.last = Some(now);
                false
            }
            Ok(Progress { recorded, begun, arrived, idle }) => {
                // What came while another executor was busy is still due.
                if recorded || begun {
                    self.last = Some(now);
                }
                match arrived {
                    Some(Ok((picture, job, report))) => {
                        self.status.shown = Some((self.runner, job));
                        self.made(Some(picture), report);
                    }
                    Some(Err(error)) => self.failed(error),
                    None => {}
                }
                if idle {
                    // A pause is no part of what a picture takes.
                    self.last_picture = None;
                }
                recorded
            }
        }
    }

    /// Paint picture and panel over the frame.
    fn paint(
        &mut self,
        frame: &wgpu::Texture,
        encoder: &mut wgpu::CommandEncoder,
        shapes: &[egui::ClippedPrimitive],
        mut textures: egui::TexturesDelta,
        pixels_per_point: f32,
    ) {
        let Graphics { device, queue, .. } = &self.graphics;
        let screen = egui_wgpu::ScreenDescriptor { size_in_pixels: self.graphics.size(), pixels_per_point };
        for (id, deltas) in textures.set.drain() {
            for delta in deltas {
                self.painter.update_texture(device, queue, id, &delta);
            }
        }
        let before = self.painter.update_buffers(device, queue, encoder, shapes, &screen);
        debug_assert!(before.is_empty(), "only paint callbacks record commands, and there are none");
        let target = frame.create_view(&wgpu::TextureViewDescriptor::default());
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("window"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        self.painter.render(&mut pass.forget_lifetime(), shapes, &screen);
        for id in textures.free.drain() {
            self.painter.free_texture(&id);
        }
    }

    /// Learn about a picture made inside this frame.
    fn after_submit(&mut self) {
        match self.maker.after_submit(self.view.exposure.is_none()) {
            Ok((picture, report)) => self.made(picture, report),
            Err(error) => self.failed(error),
        }
    }

    /// Take in why there is no picture.
    fn failed(&mut self, error: String) {
        self.status.error = Some(error);
        self.untold = true;
    }

    /// Take in a picture. It is shown with its exposure from the next frame on.
    fn made(&mut self, picture: Option<Picture>, report: Report) {
        self.status.error = None;
        self.untold = true;
        if self.view.exposure.is_some() {
            self.pictures += 1;
        } else if let Some(picture) = picture {
            self.view.exposure = Some(auto_exposure(&picture.xyz));
        }
        let since = self.last_picture.replace(Instant::now()).map(|last| last.elapsed().as_secs_f64() * 1e3);
        self.status.between_ms = match (self.status.between_ms, since) {
            (Some(mean), Some(new)) => Some(moving_mean(mean, new)),
            (mean, new) => new.or(mean),
        };
        if report.decisions != self.status.report.decisions {
            self.status.times = PassTimes::default();
        }
        self.status.times.add(&report.step_times);
        self.status.report = report;
    }

    /// When to draw again.
    fn schedule(&self, event_loop: &ActiveEventLoop, panel: Option<Duration>) {
        let inside = matches!(self.maker, Maker::Inside { .. });
        let running = inside && !self.view.paused && self.status.error.is_none();
        let stale = self.drawn != Some(self.view.display());
        match panel {
            Some(Duration::ZERO) => self.graphics.window.request_redraw(),
            _ if running || stale || self.untold => self.graphics.window.request_redraw(),
            Some(delay) => match Instant::now().checked_add(delay) {
                Some(at) => event_loop.set_control_flow(ControlFlow::WaitUntil(at)),
                None => event_loop.set_control_flow(ControlFlow::Wait),
            },
            None => event_loop.set_control_flow(ControlFlow::Wait),
        }
    }
}

/// What makes pictures for the window from now on.
fn maker(runner: Runner, scene: &Scene, graphics: &Graphics, wake: &EventLoopProxy<()>) -> Maker {
    let wake = wake.clone();
    // A loop that has ended needs no waking.
    Maker::new(
        runner,
        scene.clone(),
        graphics,
        Box::new(move || {
            let _ = wake.send_event(());
        }),
    )
}
