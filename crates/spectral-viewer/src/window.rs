//! The window: events in, frames out.

use std::sync::Arc;
use std::time::{Duration, Instant};

use asm_core::{PASSES, Picture};
use asm_wgpu::{WgpuExecutor, wgpu};
use egui::ViewportId;
use frame_plan::{DeviceInfo, Executor};
use spectral_cli::CliError;
use spectral_cli::output::atomic_file::AtomicFile;
use spectral_cli::output::png;
use spectral_cli::picture::auto_exposure;
use spectral_cli::values::Size;
use spectral_cli::view::ViewArgs;
use spectral_core::display::Display;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Window, WindowId};

use crate::graphics::Graphics;
use crate::maker::{Finished, Maker, Progress};
use crate::panel::{self, Shown, Status};
use crate::runner::Place;
use crate::screen::Screen;
use crate::subject::{Job, Report, Subject};
use crate::times::{PassTimes, moving_mean};
use crate::worker::Wake;

/// Show what `begin` makes in a window on the device that it is told, with what wakes that window, until the window is closed.
///
/// # Errors
/// Those of `begin`, no display, no device; with `--frames`, whatever keeps a picture from being made.
pub(crate) fn show<S: Subject>(
    args: &ViewArgs,
    title: &str,
    begin: impl FnOnce(&DeviceInfo, Wake) -> Result<S, CliError>,
) -> Result<(), CliError> {
    // Before a window appears.
    let screenshot = args.screenshot_file()?;
    let event_loop = EventLoop::new().map_err(no_window)?;
    let mut program = Program {
        args,
        title: format!("spectral view {title}"),
        begin: Some(begin),
        screenshot,
        wake: event_loop.create_proxy(),
        open: None,
        ended: Ok(()),
    };
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
struct Program<'a, S: Subject, B> {
    args: &'a ViewArgs,
    title: String,
    /// Taken when there is a window.
    begin: Option<B>,
    screenshot: Option<AtomicFile>,
    wake: EventLoopProxy<()>,
    open: Option<Open<S>>,
    ended: Result<(), CliError>,
}

/// The window with everything in it.
struct Open<S: Subject> {
    wake: EventLoopProxy<()>,
    graphics: Graphics,
    input: egui_winit::State,
    painter: egui_wgpu::Renderer,
    screen: Screen,
    subject: S,
    maker: Maker<S::Job>,
    /// Whom `maker` was made for.
    place: Place,
    /// What was last begun, and how it was to be shown.
    last: Option<(S::Job, Display)>,
    /// How the newest frame shows its picture.
    drawn: Option<Display>,
    status: Status<S::Job>,
    /// The status has changed since the panel last told it.
    untold: bool,
    /// Pictures shown so far.
    pictures: u32,
    last_frame: Instant,
    last_picture: Option<Instant>,
}

impl<S: Subject, B> Program<'_, S, B> {
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

impl<S: Subject, B: FnOnce(&DeviceInfo, Wake) -> Result<S, CliError>> ApplicationHandler
    for Program<'_, S, B>
{
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if let Some(begin) = self.begin.take() {
            match Open::new(event_loop, (self.args, &self.title), begin, self.wake.clone()) {
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

impl<S: Subject> Open<S> {
    fn new(
        event_loop: &ActiveEventLoop,
        (args, title): (&ViewArgs, &str),
        begin: impl FnOnce(&DeviceInfo, Wake) -> Result<S, CliError>,
        wake: EventLoopProxy<()>,
    ) -> Result<Self, CliError> {
        let attributes = Window::default_attributes()
            .with_title(title)
            .with_inner_size(PhysicalSize::new(args.size.width, args.size.height));
        let window = event_loop.create_window(attributes).map_err(no_window)?;
        let graphics = Graphics::new(event_loop, Arc::new(window), args.screenshot.is_some())?;
        let options = egui_wgpu::RendererOptions::default();
        let mut painter = egui_wgpu::Renderer::new(&graphics.device, graphics.format(), options);
        let screen = Screen::new(&graphics, &mut painter, S::FILTER);
        let (device, queue) = (graphics.device.clone(), graphics.queue.clone());
        let device_info = WgpuExecutor::from_host(device, queue, PASSES).info().clone();
        let subject = begin(&device_info, waking(&wake))?;
        let place = subject.place();
        let most = graphics.device.limits().max_texture_dimension_2d as usize;
        let context = egui::Context::default();
        // Pictures are judged against dark surroundings.
        context.set_theme(egui::Theme::Dark);
        let input =
            egui_winit::State::new(context, ViewportId::ROOT, &*graphics.window, None, None, Some(most));
        graphics.window.request_redraw();
        Ok(Self {
            maker: subject.maker(&graphics, waking(&wake)),
            wake,
            graphics,
            input,
            painter,
            screen,
            subject,
            place,
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
        self.subject.advance(self.last_frame.elapsed().as_secs_f64());
        self.last_frame = Instant::now();

        let window = Arc::clone(&self.graphics.window);
        let context = self.input.egui_ctx().clone();
        let mut area = [0, 0];
        let egui::FullOutput { platform_output, textures_delta, shapes, pixels_per_point, viewport_output } =
            context.run_ui(self.input.take_egui_input(&window), |ui| {
                area = panel::show(ui, &mut self.subject, &self.status, self.screen.id);
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
        if recorded && let Some(report) = self.maker.after_submit() {
            self.made(report);
        }
        self.schedule(event_loop, viewport_output.get(&ViewportId::ROOT).map(|root| root.repaint_delay));
        Ok(copy)
    }

    /// Have a picture made where one is due; whether it is part of this frame.
    fn record_picture(&mut self, area: [u32; 2], encoder: &mut wgpu::CommandEncoder) -> bool {
        let Self { graphics, painter, screen, subject, maker, status, .. } = self;
        if self.place != subject.place() {
            self.place = subject.place();
            *maker = subject.maker(graphics, waking(&self.wake));
            (self.last, self.last_picture, *status) = (None, None, Status::default());
        }
        let showing = subject.showing();
        let now = (subject.job(area), showing.display());
        let changed = self.last.as_ref() != Some(&now);
        // What failed is tried again once it is something else.
        let due = changed || !(showing.paused || status.error.is_some());
        let wanted = showing.exposure.is_none() || subject.wants(&now.0);
        screen.fit(graphics, painter, now.0.size());
        let (job, display) = &now;
        let progress = maker.record((job, due, wanted), (graphics, encoder), screen, display);
        self.drawn = Some(*display);
        match progress {
            Err(error) => {
                self.failed(error);
                self.last = Some(now);
                false
            }
            Ok(Progress { current, recorded, begun, arrived, copied, idle }) => {
                if recorded {
                    self.status.shown = if current { Shown::Now } else { Shown::Nothing };
                }
                // What came while another executor was busy is still due, and what a late plan was recorded for.
                if current || begun {
                    self.last = Some(now);
                } else if recorded {
                    self.last = None;
                }
                match arrived {
                    Some(Ok(Finished { picture, job, report })) => {
                        self.made(report);
                        self.arrived(&job, &picture);
                        self.status.shown = Shown::Of(self.place.runner, job);
                    }
                    Some(Err(error)) => self.failed(error),
                    None => {}
                }
                if let Some((job, picture)) = copied {
                    self.arrived(&job, &picture);
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

    /// Take in why there is no picture.
    fn failed(&mut self, error: String) {
        self.status.error = Some(error);
        self.untold = true;
    }

    /// Take in a picture that has come to the host. It is shown with its exposure from the next frame on.
    fn arrived(&mut self, job: &S::Job, picture: &Picture) {
        let showing = self.subject.showing_mut();
        if showing.exposure.is_none() {
            showing.exposure = Some(auto_exposure(&picture.xyz));
        }
        self.subject.take(job, picture);
        self.untold = true;
    }

    /// Take in that a picture was made.
    fn made(&mut self, report: Report<<S::Job as Job>::Facts>) {
        self.status.error = None;
        self.untold = true;
        if self.subject.showing().exposure.is_some() {
            self.pictures += 1;
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
        let showing = self.subject.showing();
        let running = self.maker.is_inside() && !showing.paused && self.status.error.is_none();
        let running = running || self.maker.goes_on();
        let stale = self.drawn != Some(showing.display());
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

/// Brings the window's loop to its next frame, from any thread.
fn waking(wake: &EventLoopProxy<()>) -> Wake {
    let wake = wake.clone();
    // A loop that has ended needs no waking.
    Arc::new(move || {
        let _ = wake.send_event(());
    })
}
